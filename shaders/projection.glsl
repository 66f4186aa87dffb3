// A projection of a volume's values on a pixel's ray through one brick, without a medium.
//
// Switches: MODE 1: the integral of the value, see line_integral.glsl; 2: the largest value, or the least one, see
//                extreme_value.glsl; 3: the first surface of one value, see isosurface.glsl; 4: the surfaces of
//                several values, see isosurfaces.glsl.
//           DEPTH, SKIPS, COUNT, LIT, CUE and those of lights: see isosurface.glsl. MISSING: see value_pieces.glsl.
//           KNOWN: see extreme_value.glsl.
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

// Number of the slabs of a polygon at a position in the window; false if there is none.
bool draw_stack(vec2 window_position, vec2 slab_range, out vec4 number) {
    vec2 slabs;
    BoxWalk walk = stack_walk(window_position, slab_range, 1.0, slabs);
    number = vec4(0.0);
    if (slabs.x >= slabs.y) return false;
#if MODE == 1
    number = integral_along(walk, slabs) * walk.path_length;
    return true;
#elif MODE == 2
    number = extreme_along(walk, slabs, known_largest(window_position));
    return KNOWN == 0 || number.a > 0.0;
#else
    float looked_at;
#if MODE == 4
    vec2 depths = drawn_depths(walk, window_position, slabs);
    number = all_surfaces(walk, slabs, depths, pixel_at(window_position), looked_at);
    bool is_met = number.a > 0.0;
#else
    bool is_met;
    number = first_surface(walk, slabs, pixel_at(window_position), is_met, looked_at);
#endif
#if COUNT
    number.r = looked_at;
    return true;
#else
    return is_met;
#endif
#endif
}
