#version 330
// A corner of a slab's polygon.

uniform mat4 projection;         // from eye space to clip coordinates

in vec3 in_position;             // eye space
in vec3 in_texture_position;

out vec3 texture_position;

void main() {
    texture_position = in_texture_position;
    gl_Position = projection * vec4(in_position, 1.0);
}
