#version 330
// A projection of a volume's values on a pixel's ray through one brick, without a medium.
//
// Switches: MODE 1: the integral of the value, see line_integral.glsl; 2: the largest value, or the least one, see
//                extreme_value.glsl; 3: the first surface of one value, see isosurface.glsl.
//           DEPTH, SKIPS, COUNT, LIT, CUE and those of lights: see isosurface.glsl. MISSING: see value_pieces.glsl.
//           PERSPECTIVE, BRICKS, HALF_SPACES, INTERVAL: see stack_walk.glsl. GRADIENT: see volume_texture.glsl.

#include "stack_walk.glsl"
#include "value_pieces.glsl"
#if MODE == 1
#include "line_integral.glsl"
#elif MODE == 2
#include "extreme_value.glsl"
#else
#include "isosurface.glsl"
#endif

flat in vec2 slab_range;
out vec4 number;

void main() {
    vec2 slabs;
    BoxWalk walk = stack_walk(gl_FragCoord.xy, slab_range, 1.0, slabs);
    if (slabs.x >= slabs.y) discard;
#if MODE == 1
    number = integral_along(walk, slabs) * walk.path_length;
#elif MODE == 2
    number = extreme_along(walk, slabs);
#else
    float looked_at;
    bool is_met;
    number = first_surface(walk, slabs, pixel_at(gl_FragCoord.xy), is_met, looked_at);
#if COUNT
    number.r = looked_at;
#else
    if (!is_met) discard;
#endif
#endif
}
