#version 330
#extension GL_ARB_compute_shader : require
#extension GL_ARB_shader_image_load_store : require
// Stacks of slabs on the rays of pixels, an invocation for each, in place of polygons and their blending: what a fragment
// of slab_stack.frag, several.frag or projection.frag draws is composited in registers with the picture so far.
//
// Switches: those of the DRAWN file. TARGET 0: the target has 32 bits, 1: 16 bits, 2: 8 bits for each component.
//           BLENDING 0: behind what is there, 1: added to it, 2: the larger number.

#include DRAWN

#if TARGET == 0
layout(rgba32f) uniform image2D target;
#elif TARGET == 1
layout(rgba16f) uniform image2D target;
#else
layout(rgba8) uniform image2D target;
#endif
uniform ivec2 first_pixel;        // of those that are drawn, and the one behind the last
uniform ivec2 end_pixel;
uniform vec3 slab_span;           // first slab, the one behind the last, and slabs of a stack

layout(local_size_x = 8, local_size_y = 8) in;

// A picture with a stack's colour, as polygons are blended.
vec4 blended(vec4 picture, vec4 color) {
#if BLENDING == 0
    return picture + (1.0 - picture.a) * color;
#elif BLENDING == 1
    return picture + color;
#else
    return max(picture, color);
#endif
}

void main() {
    ivec2 pixel = first_pixel + ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, end_pixel))) return;
    vec4 picture = imageLoad(target, pixel);
    for (float first = slab_span.x; first < slab_span.y; first += slab_span.z) {
        vec4 color;
        vec2 stack = vec2(first, min(first + slab_span.z, slab_span.y));
        if (draw_stack(vec2(pixel) + 0.5, stack, color)) picture = blended(picture, color);
        if (first + slab_span.z >= slab_span.y) break;  // see compositing.glsl
    }
    imageStore(target, pixel, picture);
}
