#version 330
// Colour and opacity of one slab on the rays that go through the whole of it; slab_ends.frag draws where the box cuts
// it short.
//
// Switches: those of slab_stack.glsl.

#include "end_slabs.glsl"
#include "obliquity.glsl"
#include "pixel_ray.glsl"
#include "view.glsl"

uniform sampler2D whole_range;   // see slab_ends.frag

flat in float slab;
out vec4 slab_target;

void main() {
    vec2 range = texelFetch(whole_range, ivec2(gl_FragCoord.xy), 0).xy;
    if (slab < range.x || slab >= range.y) discard;
    vec2 pixel = pixel_at(gl_FragCoord.xy);
    prepare_medium(pixel);
    // Not interpolated between the corners: to 2^-22 of the box the position would be another than that of slab stacks,
    // which noise shows in the sixth digit, and texels of 8 bits, whose filter has steps, in the third.
    BoxWalk walk = walk_through(pixel_ray(pixel), real2(0.0), obliquity_of(pixel) * slab_length);
    slab_target = target_color(whole_slab(walk, slab), 1.0);
}
