// The largest value along a ray, or the least one.
//
// Switches: MISSING: see value_pieces.glsl.

#include "value_pieces.glsl"

uniform vec3 samples;             // of the volume, along x, y and z
uniform float sign_of_largest;    // -1 where the least value is looked for: then all values are times this
uniform float largest_of_all;     // a ray that has met it is finished
#if MISSING
uniform float far_from;           // magnitude of values beside which float32 loses those that most samples have
#endif

const float NOTHING_YET = -3e38;

#if MISSING
const float ORDINARY = 1.0 / 64.0;     // of `far_from`: most samples are nearer
const float FARTHER = 16.0;            // likewise: up to that, extrapolated values keep a hundredth of most values
const float ROUNDED = 1.0 / 262144.0;  // of the farthest value, 2^-18: more than extrapolation loses

// The largest value of a piece of a ray, given its cubic at t = 0, 1, 2 and 3. Where the ends of the piece are
// extrapolated from far below, nothing is left there of what most samples are but float32's rounding: then the
// largest value without the ends is returned, and `vague` becomes at least that with them.
float largest_of_piece(vec4 values, inout float vague) {
    float found = largest_of(values, FROM, TO);
    if (largest_size(values) > largest_finite) found = max(max(values.x, values.y), max(values.z, values.w));
    float least = min(min(values.x, values.y), min(values.z, values.w));
    if (least < -FARTHER * far_from && found > -max(ORDINARY * far_from, -ROUNDED * least)) {
        vague = max(vague, found);
        found = largest_of(values, 0.0, 3.0);
    }
    return found;
}

// The largest value of a ray: mostly the next cells know better than a vague value.
float largest_known(float largest, float vague) {
    return largest < -ORDINARY * far_from ? max(largest, vague) : largest;
}
#else
float largest_of_piece(vec4 values, inout float vague) {
    return largest_of(values, FROM, TO);
}

float largest_known(float largest, float vague) {
    return largest;
}
#endif

// Red is the largest value of the slabs that are drawn, times the sign; alpha is 1 where there is one.
vec4 extreme_along(BoxWalk walk, vec2 slabs) {
    SampleWalk planes_walk = sample_walk(walk.start, walk.step, samples);
    vec3 planes;
    vec2 box = box_depths(walk);
    float depth = first_depth(planes_walk, box.x, max(slabs.x, box.x), planes);
    vec4 values = vec4(sign_of_largest * value_at(walk_position(walk, depth)));
    float largest = NOTHING_YET;
    float vague = NOTHING_YET;
    while (depth < slabs.y && depth < box.y && largest < largest_of_all) {
        float next = max(next_depth(planes_walk, box.y, planes), depth);
        values = sign_of_largest * values_between(walk, depth, next, sign_of_largest * values.w);
        depth = next;
        float found = largest_of_piece(values, vague);
        if (is_there(found)) largest = max(largest, found);
    }
    largest = largest_known(largest, vague);
    return vec4(largest, 0.0, 0.0, largest > NOTHING_YET ? 1.0 : 0.0);
}
