// The largest value along a ray, or the least one.
//
// Switches: SKIPS 1: cells whose bound is no larger than what has been met are skipped.
//           MISSING: see value_pieces.glsl.

#include "value_pieces.glsl"

uniform vec3 samples;             // of the volume, along x, y and z
uniform float sign_of_largest;    // -1 where the least value is looked for: then all values are times this
uniform float largest_of_all;     // a ray that has met it is finished
#if SKIPS
uniform sampler3D bounds;         // no value in a cell is larger, see slicing/bounds.py
uniform float largest_bound;
uniform float cell_side;          // samples
#endif
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

#if SKIPS
// Bound of the cell whose last planes along the ray are these.
float bound_of(SampleWalk walk, vec3 planes) {
    vec3 cell = walk.sign * ((planes + walk.sign) * (1.0 / cell_side) - 0.5) - 0.5;
    return texelFetch(bounds, clamp(ivec3(floor(cell + 0.5)), ivec3(0), textureSize(bounds, 0) - 1), 0).r;
}

// The first planes between cells behind `depth`.
vec3 cell_planes(SampleWalk walk, float depth) {
    return planes_behind(walk, cell_side, 1.0, depth);
}

// The depths between which the ray is in the first cell of the largest bound.
vec2 most_promising(SampleWalk walk, float depth, float end) {
    vec3 planes = cell_planes(walk, depth);
    vec2 found = vec2(depth);
    float largest = NOTHING_YET;
    while (depth < end && largest < largest_bound) {
        float bound = bound_of(walk, planes);
        float next = max(next_depth(walk, cell_side, end, planes), depth);
        if (bound > largest) found = vec2(depth, next);
        largest = max(bound, largest);
        depth = next;
        if (depth >= end || largest >= largest_bound) break;  // see compositing.glsl
    }
    return found;
}

// The depths between which the ray is in the first cell, from `depth` to `end`, whose bound is larger than `largest`;
// `end` twice where there is none. `planes` become those behind that cell.
vec2 next_cell(SampleWalk walk, float depth, float end, float largest, inout vec3 planes) {
    bool is_found = false;
    float leaving = depth;
    while (depth < end && !is_found) {
        is_found = bound_of(walk, planes) > largest;
        leaving = max(next_depth(walk, cell_side, end, planes), depth);
        if (!is_found) depth = leaving;
        if (depth >= end || is_found) break;
    }
    return vec2(depth, leaving);
}
#endif

// The largest value of the pieces of a ray that begin between two depths, or `largest`; the box ends at `leaving`.
float largest_between(
    BoxWalk walk, SampleWalk planes_walk, vec2 depths, float leaving, float largest, inout float vague
) {
    float depth = depths.x;
    vec3 planes = planes_behind(planes_walk, 1.0, 0.0, depth);
    vec4 values = vec4(sign_of_largest * value_at(walk_position(walk, depth)));
    while (depth < depths.y && largest < largest_of_all) {
        float next = max(next_depth(planes_walk, 1.0, leaving, planes), depth);
        values = sign_of_largest * values_between(walk, depth, next, sign_of_largest * values.w);
        float found = largest_of_piece(values, vague);
        if (is_there(found)) largest = max(largest, found);
        depth = next;
        if (depth >= depths.y || largest >= largest_of_all) break;
    }
    return largest;
}

// Red is the largest value of the slabs that are drawn, times the sign; alpha is 1 where there is one.
vec4 extreme_along(BoxWalk walk, vec2 slabs) {
    SampleWalk planes_walk = sample_walk(walk.start, walk.step, samples);
    vec3 planes;
    vec2 box = box_depths(walk);
    float begin = first_depth(planes_walk, box.x, max(slabs.x, box.x), planes);
    float end = min(slabs.y, box.y);
    float largest = NOTHING_YET;
    float vague = NOTHING_YET;
#if SKIPS
    // What the most promising cell holds excludes most of the others.
    vec2 cell = most_promising(planes_walk, begin, end);
    float next = begin;
    planes = cell_planes(planes_walk, begin);
    while (cell.x < end && largest < largest_of_all) {
        largest = largest_between(walk, planes_walk, cell, box.y, largest, vague);
        cell = next_cell(planes_walk, next, end, largest, planes);
        next = cell.y;
        if (cell.x >= end || largest >= largest_of_all) break;
    }
#else
    largest = largest_between(walk, planes_walk, vec2(begin, end), box.y, largest, vague);
#endif
    largest = largest_known(largest, vague);
    return vec4(largest, 0.0, 0.0, largest > NOTHING_YET ? 1.0 : 0.0);
}
