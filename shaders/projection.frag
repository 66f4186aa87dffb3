#version 330
// A projection of a volume's values on a pixel's ray through one brick, without a medium.
//
// Switches: MODE 1: the integral of the value, see line_integral.glsl; 2: the largest value, or the least one, see
//                extreme_value.glsl; 3: the first surface of one value, see isosurface.glsl; 4: the surfaces of
//                several values, see isosurfaces.glsl.
//           DEPTH, SKIPS, COUNT, LIT, CUE and those of lights: see isosurface.glsl. MISSING: see value_pieces.glsl.
//           PERSPECTIVE, BRICKS, HALF_SPACES, INTERVAL: see stack_walk.glsl. GRADIENT: see volume_texture.glsl.

#include "stack_walk.glsl"
#include "value_pieces.glsl"
// Of both kinds of isosurfaces: an include that is first met in a branch not taken is in no other.
#if MODE >= 3
#include "seen.glsl"
#if SKIPS
#include "skip.glsl"
#endif
#endif
#if MODE == 1
#include "line_integral.glsl"
#elif MODE == 2
#include "extreme_value.glsl"
#elif MODE == 3
#include "isosurface.glsl"
#else
#include "isosurfaces.glsl"
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
#elif MODE == 4
    float looked_at;
    number = all_surfaces(walk, slabs, pixel_at(gl_FragCoord.xy), looked_at);
#if COUNT
    number.r = looked_at;
#else
    if (number.a <= 0.0) discard;
#endif
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
