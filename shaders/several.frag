#version 330
// A stack of slabs of several volumes on a pixel's ray, in a fragment of a polygon.
//
// Switches: those of several.glsl.

#include "several.glsl"

flat in vec2 slab_range;
out vec4 stack_color;

void main() {
    if (!draw_stack(gl_FragCoord.xy, slab_range, stack_color)) discard;
}
