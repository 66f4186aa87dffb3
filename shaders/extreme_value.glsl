// The largest value along a ray, or the least one.
//
// Switches: SKIPS 1: cells whose bound is no larger than what has been met are skipped.
//           KNOWN 1: the rays have met values in other parts of the volume; what is no larger does not matter.
//           MISSING: see value_pieces.glsl.

#include "corner_values.glsl"
#if SKIPS
#include "best_cells.glsl"
#else
const float NOTHING_YET = -3e38;
#endif

flat uniform vec3 samples;        // in the box, along x, y and z
flat uniform vec3 first_corner;   // of the box of the first sample, in the box: not 0 for some levels of a pyramid
flat uniform float sign_of_largest;    // -1 where the least value is looked for: then all values are times this
flat uniform float largest_of_all;     // a ray that has met it is finished
#if KNOWN
uniform sampler2D known;          // the largest value that each ray has met before
#endif
#if MISSING
uniform float far_from;           // magnitude of values beside which float32 loses those that most samples have
#endif

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
    float peak = cubic_between(values, turns_between(values, FROM, TO).x);
    return max(peak, max(values.x, values.w));
}

float largest_known(float largest, float vague) {
    return largest;
}
#endif

// A ray on its way through pieces.
struct PieceWalk {
    SampleWalk samples;           // among planes of samples
    vec3 planes;                  // the first ones behind `depth`
    float depth;
    float leaving;                // where the box ends
    float largest;                // value so far
    float vague;                  // see largest_of_piece
};

// Look at the piece from `depth` on, and go to its end.
void look_at_piece(BoxWalk walk, inout PieceWalk ray) {
    float next = max(next_depth(ray.samples, ray.leaving, ray.planes), ray.depth);
    float found = largest_of_piece(sign_of_largest * values_in_cell(walk, ray.depth, next), ray.vague);
    if (is_there(found)) ray.largest = max(ray.largest, found);
    ray.depth = next;
}

#if SKIPS
// Look at the pieces in some cells that begin between two depths.
void look_into(BoxWalk walk, BestCells best, vec2 depths, inout PieceWalk ray) {
    float until = ray.depth;
    bool is_better = best.bounds.x > ray.largest;
    // One loop for all cells: pixels of one vector need not wait for each other's at the end of each.
    while (is_better) {
        if (ray.depth >= until) {
            vec2 cell = cell_depths(ray.samples, take_cell(best), depths.x, ray.planes);
            ray.depth = cell.x;
            until = min(cell.y, depths.y);
        }
        look_at_piece(walk, ray);
        is_better = ray.largest < largest_of_all && (ray.depth < until || best.bounds.x > ray.largest);
        if (!is_better) break;
    }
}

// Look at the pieces that begin between two depths: in the eight cells of the largest bounds first, which mostly
// exclude all others, and then in those that are left, eight after eight as the ray meets them.
void look_between(BoxWalk walk, vec2 depths, inout PieceWalk ray) {
    ray.samples = walk_through_cells(ray.samples);
    float from = depths.x;
    vec2 last = vec2(-NOTHING_YET, from);
    BestCells best = best_cells(ray.samples, from, depths.y, ray.largest, last, false);
    last = vec2(best.more_bounds.w, best.more_depths.w);
    look_into(walk, best, depths, ray);
    from = depths.x;
    bool goes_on = last.x > ray.largest && ray.largest < largest_of_all;
    while (goes_on) {
        best = best_cells(ray.samples, from, depths.y, ray.largest, last, true);
        look_into(walk, best, depths, ray);
        goes_on = from < depths.y && ray.largest < largest_of_all;
        if (!goes_on) break;
    }
}
#else
// Look at the pieces that begin between two depths.
void look_between(BoxWalk walk, vec2 depths, inout PieceWalk ray) {
    while (ray.depth < depths.y && ray.largest < largest_of_all) {
        look_at_piece(walk, ray);
        if (ray.depth >= depths.y || ray.largest >= largest_of_all) break;  // see compositing.glsl
    }
}
#endif

// The largest value that the ray of a pixel has met before.
float known_largest(vec2 window_position) {
#if KNOWN
    return texelFetch(known, ivec2(window_position), 0).r;
#else
    return NOTHING_YET;
#endif
}

// Red is the largest value of the slabs that are drawn, times the sign; alpha is 1 where it is larger than what is known.
vec4 extreme_along(BoxWalk walk, vec2 slabs, float known_before) {
    vec2 box = box_depths(walk);
    PieceWalk ray;
    ray.samples = sample_walk(walk.start - first_corner, walk.step, samples);
    ray.depth = first_depth(ray.samples, box.x, max(slabs.x, box.x), ray.planes);
    ray.leaving = box.y;
    ray.largest = known_before;
    ray.vague = NOTHING_YET;
    if (known_before < largest_of_all) look_between(walk, vec2(ray.depth, min(slabs.y, box.y)), ray);
    float largest = largest_known(ray.largest, ray.vague);
    return vec4(largest, 0.0, 0.0, largest > known_before ? 1.0 : 0.0);
}
