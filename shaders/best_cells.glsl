// The cells on a ray that have the largest bounds.
//
// Cells are of two sizes, see slicing/bounds.py: where a large one has no bound that matters, none of the small ones in
// it is looked at. The texture may hold those of a brick alone, from a place on.

#include "trilinear.glsl"

flat uniform vec3 first_place;    // at which the texture begins, along x, y and z, where a large cell does
flat uniform vec3 last_place;     // of the last sample in it, counted from there
uniform sampler3D bounds;         // no value in a cell is larger; behind the small cells along z are the large ones
flat uniform float largest_bound;
flat uniform float cell_side;     // of a small cell, samples
flat uniform float first_large;   // where the large ones begin along z

const float LARGE = 4.0;          // small cells along the side of a large one
const float NOTHING_YET = -3e38;  // less than any bound or value

// Up to eight small cells, in the order of their bounds. A cell is known by a depth at which the ray is in it.
struct BestCells {
    vec4 bounds;
    vec4 depths;
    vec4 more_bounds;
    vec4 more_depths;
};

// Put a cell in its place among some others, from which on each moves on by one place.
void put_before(inout float bound, inout float depth, inout vec2 cell, inout bool is_placed) {
    vec2 other = vec2(bound, depth);
    is_placed = is_placed || cell.x > bound;
    bound = is_placed ? cell.x : bound;
    depth = is_placed ? cell.y : depth;
    cell = is_placed ? other : cell;
}

// Put a cell, bound and depth, in its place; the last one of nine is lost.
void put_cell(inout BestCells best, vec2 cell) {
    bool is_placed = false;
    put_before(best.bounds.x, best.depths.x, cell, is_placed);
    put_before(best.bounds.y, best.depths.y, cell, is_placed);
    put_before(best.bounds.z, best.depths.z, cell, is_placed);
    put_before(best.bounds.w, best.depths.w, cell, is_placed);
    put_before(best.more_bounds.x, best.more_depths.x, cell, is_placed);
    put_before(best.more_bounds.y, best.more_depths.y, cell, is_placed);
    put_before(best.more_bounds.z, best.more_depths.z, cell, is_placed);
    put_before(best.more_bounds.w, best.more_depths.w, cell, is_placed);
}

// Remove the first cell and return the depth of it.
float take_cell(inout BestCells best) {
    float depth = best.depths.x;
    best.bounds = vec4(best.bounds.yzw, best.more_bounds.x);
    best.depths = vec4(best.depths.yzw, best.more_depths.x);
    best.more_bounds = vec4(best.more_bounds.yzw, NOTHING_YET);
    best.more_depths.xyz = best.more_depths.yzw;
    return depth;
}

// A ray among samples that are counted from the plane on which cells begin, one in front of the first sample.
SampleWalk walk_through_cells(SampleWalk walk) {
    walk.start += walk.sign;
    return walk;
}

// The cell of a size, counted along each axis, with a place between samples of which the lowest is `low`.
vec3 cell_at(vec3 low, float side) {
    return floor((low + 0.5) * (1.0 / side));
}

// Bound of the cell of a size with a place between samples of which the lowest is `low`.
float bound_of(SampleWalk walk, vec3 low, float side) {
    vec3 place = clamp(walk.sign * low + min(walk.sign, 0.0) - first_place, vec3(0.0), last_place);
    vec3 cell = cell_at(place, side);
    if (side > cell_side) cell.z += first_large;
    return texelFetch(bounds, ivec3(cell), 0).r;
}

// Small cells that a ray enters from `from` to `end`, whose bounds are larger than `known`: those of the largest bounds,
// or only the first ones, of those behind `last`, bound and depth, in the order of bounds and depths. `from` becomes
// the depth at which the search ends.
BestCells best_cells(SampleWalk walk, inout float from, float end, float known, vec2 last, bool only_first) {
    const vec4 NONE = vec4(NOTHING_YET);
    BestCells best = BestCells(NONE, NONE, NONE, NONE);
    vec3 low = floor(walk.start + from * walk.direction);
    float large = LARGE * cell_side;
    float side = large;
    bool goes_on = from < end;
    while (goes_on) {
        float bound = bound_of(walk, low, side);
        bool is_better = bound > max(known, best.more_bounds.w);
        if (is_better && side > cell_side) {
            side = cell_side;
        } else {
            vec3 ends = side * (cell_at(low, side) + 1.0);
            vec3 end_depths = (ends - walk.start) * walk.depth_per_sample;
            float leaving = max(min(end_depths.x, min(end_depths.y, end_depths.z)), from);
            float middle = 0.5 * (from + leaving);
            bool is_behind = bound < last.x || (bound == last.x && middle > last.y);
            put_cell(best, vec2(is_better && is_behind && leaving > from ? bound : NOTHING_YET, middle));
            // Along the axis that the ray leaves by the next place is known; along others rounding takes none back.
            vec3 next = max(floor(walk.start + leaving * walk.direction), low);
            next = mix(next, ends, lessThanEqual(end_depths, vec3(leaving)));
            if (any(notEqual(cell_at(next, large), cell_at(low, large)))) side = large;
            low = next;
            from = leaving;
        }
        goes_on = from < end && (only_first ? best.more_bounds.w <= NOTHING_YET : best.more_bounds.w < largest_bound);
        if (!goes_on) break;  // see compositing.glsl
    }
    return best;
}

// The depth at which a ray enters the small cell that it is in at some depth, and at which it leaves; `planes` become
// the first planes of samples behind the first of these, or `earliest`.
vec2 cell_depths(SampleWalk walk, float depth, float earliest, out vec3 planes) {
    vec3 low = cell_side * cell_at(floor(walk.start + depth * walk.direction), cell_side);
    vec3 begin = (low - walk.start) * walk.depth_per_sample;
    begin = mix(begin, vec3(NOTHING_YET), lessThan(walk.direction, vec3(1e-30)));  // not 0 for a ray in a plane
    vec3 end = (low + cell_side - walk.start) * walk.depth_per_sample;
    float entering = max(max(begin.x, earliest), max(begin.y, begin.z));
    planes = clamp(floor(walk.start + entering * walk.direction), low, low + cell_side - 1.0) + 1.0;
    return vec2(entering, min(end.x, min(end.y, end.z)));
}
