#version 330
// A projection of a volume's values on a pixel's ray, in a fragment of a polygon.
//
// Switches: those of projection.glsl.

#include "projection.glsl"

flat in vec2 slab_range;
out vec4 stack_color;

void main() {
    if (!draw_stack(gl_FragCoord.xy, slab_range, stack_color)) discard;
}
