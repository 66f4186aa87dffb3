#version 330
// A stack of slabs of one volume on a pixel's ray, in a fragment of a polygon.
//
// Switches: those of slab_stack.glsl.

#include "slab_stack.glsl"

flat in vec2 slab_range;
out vec4 stack_color;

void main() {
    if (!draw_stack(gl_FragCoord.xy, slab_range, stack_color)) discard;
}
