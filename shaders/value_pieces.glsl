// The value along a ray, piece by piece: between two planes of samples it is a cubic.
//
// Switches: MISSING 1: values may be missing, infinite, or far beyond most others; 2: there are infinities, and an
//                integral must not step over any of them.
//           GRADIENT, WEIGHTS, BRICKS: see volume_texture.glsl. HALF_SPACES, INTERVAL: see visible.glsl.

#include "box_walk.glsl"
#include "volume_texture.glsl"
#include "trilinear.glsl"

#if MISSING
uniform float largest_finite;     // larger magnitudes stand for infinities
#endif

// Where a piece begins and ends, in t of the cubic: beside missing, infinite and far-off values its ends may already
// be such values, so that it is looked up in the middles of four quarters.
const float FROM = MISSING != 0 ? -0.5 : 0.0;
const float TO = MISSING != 0 ? 3.5 : 3.0;

// True unless a value is missing.
bool is_there(float value) {
#if MISSING
    return value == value;
#else
    return true;
#endif
}

// True if a value stands for an infinity.
bool is_infinite(float value) {
#if MISSING
    return abs(value) > largest_finite;
#else
    return false;
#endif
}

// The largest magnitude of four values.
float largest_size(vec4 values) {
    vec4 size = abs(values);
    return max(max(size.x, size.y), max(size.z, size.w));
}

// Value at a position in the box; NaN where it is missing.
float value_at(vec3 position) {
    return value_of(texel_at(position));
}

// Depth at which a ray enters the box, and at which it leaves the box.
vec2 box_depths(BoxWalk walk) {
    return vec2(walk.first_slab + walk.first_fraction, walk.last_slab + walk.last_fraction);
}

// Values at t = 0, 1, 2 and 3 of the cubic between two depths with no plane of samples between them. `at_front` is
// the value at t = 0 where that is the front.
vec4 values_between(BoxWalk walk, float front, float back, float at_front) {
    vec3 start = walk_position(walk, front);
    vec3 step = ((back - front) / (TO - FROM)) * walk.step;
#if MISSING
    start += 0.5 * step;
    at_front = value_at(start);
    return vec4(at_front, value_at(start + step), value_at(start + 2.0 * step), value_at(start + 3.0 * step));
#else
    return vec4(at_front, value_at(start + step), value_at(start + 2.0 * step), value_at(walk_position(walk, back)));
#endif
}
