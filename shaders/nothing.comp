#version 330
#extension GL_ARB_compute_shader : require
#extension GL_ARB_shader_image_load_store : require
// Compiles where the driver has what rays.comp needs.

layout(rgba32f) uniform image2D target;

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    imageStore(target, ivec2(gl_GlobalInvocationID.xy), vec4(0.0));
}
