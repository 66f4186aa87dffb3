// Empty-space skipping: the box is divided into cells, and each knows how far on all cells are as empty, or as full,
// as itself.
//
// Switches: BRICKS: see brick.glsl.

#include "ray.glsl"

// Per cell: 2 r + (1 where there may be a medium); all cells less than r away are alike, among those that a ray may
// come to. The first half along an axis is for rays that go up along it, the second half for those that go down.
uniform usampler3D skips;
flat uniform vec3 cells_per_box;
#if BRICKS
flat uniform vec3 first_cell;     // where the cells begin, counted from the box: those of a brick may be its own
#else
const vec3 first_cell = vec3(0.0);
#endif

// A ray through the cells, in coordinates that grow along it: where it goes downwards they are mirrored at 0.
struct CellWalk {
    vec3 start;                   // position at depth 0
    vec3 direction;               // change of position per unit of depth, not negative
    vec3 depth_per_cell;
    vec3 depth_at_zero;           // where each coordinate is 0
    vec3 sign;                    // cell c of the mirrored coordinates is texel sign * c + first
    vec3 first;
    vec3 lowest;                  // texels of the ray's half
    vec3 highest;
};

// The ray that is at `start` at depth 0, in the box, and goes on by `step` per slab.
CellWalk cell_walk(vec3 start, vec3 step) {
    vec3 sign = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(step, vec3(0.0)));
    CellWalk walk;
    walk.start = sign * (start * cells_per_box - first_cell);
    walk.direction = sign * step * cells_per_box;
    walk.depth_per_cell = 1.0 / max(walk.direction, vec3(1e-30));
    walk.depth_at_zero = -walk.start * walk.depth_per_cell;
    walk.sign = sign;
    vec3 cells = vec3(textureSize(skips, 0) / 2);
    walk.lowest = mix(cells, vec3(0.0), greaterThan(sign, vec3(0.0)));
    walk.highest = walk.lowest + cells - 1.0;
    walk.first = walk.lowest + min(sign, vec3(0.0));
    return walk;
}

// Entry of a cell in `skips`; rounding may put the cell beside the box.
uint entry_of(CellWalk walk, vec3 cell) {
    return texelFetch(skips, ivec3(clamp(walk.sign * cell + walk.first, walk.lowest, walk.highest)), 0).r;
}

// True if there may be a medium from `depth` on, which becomes the depth at which that may change, and `cell` the
// cell in which it does.
bool is_full_until(CellWalk walk, inout vec3 cell, inout float depth) {
    uint entry = entry_of(walk, cell);
    vec3 beyond = cell + float(entry >> 1u);
    vec3 depths = beyond * walk.depth_per_cell + walk.depth_at_zero;
    float leaving = max(min(depths.x, min(depths.y, depths.z)), depth);
    // Along the axis that the ray leaves by the next cell is known; along the others no rounding takes it back.
    vec3 next = max(floor(walk.start + leaving * walk.direction), cell);
    cell = mix(next, beyond, lessThanEqual(depths, vec3(leaving)));
    depth = leaving;
    return (entry & 1u) == 1u;
}

// The first slab from `slab` on that touches a cell in which there may be a medium, and the first slab behind it
// that touches no such cell, or the next one: rounding may end a cell where the slab begins. NOWHERE if there is
// none before `end`.
vec2 full_run(CellWalk walk, float slab, float end) {
    float depth = slab;
    vec3 cell = floor(walk.start + depth * walk.direction);
    vec2 run = vec2(NOWHERE);
    float from = depth;
    bool is_full = false;
    while (depth < end && !is_full) {
        from = depth;
        is_full = is_full_until(walk, cell, depth);
        if (depth >= end || is_full) break;  // see compositing.glsl
    }
    if (!is_full) return run;
    bool goes_on = true;
    float until = depth;
    while (until < end && goes_on) {
        depth = until;
        goes_on = is_full_until(walk, cell, depth);
        if (goes_on) until = depth;
        if (until >= end || !goes_on) break;
    }
    float first = max(floor(from), slab);
    return vec2(first, max(min(ceil(until), end), first + 1.0));
}

// Runs of slabs in which there may be a medium, front to back. A run is one number, so that more of them fit beside
// what else a ray has to remember: its first slab and the one after its last, counted from `base`, the ray's first,
// of which a stack has fewer than MOST_SLABS (slicing/slabs.py). A float32 counts to the square of that.
struct Runs {
    float first, second, third, fourth, fifth, sixth;
};
const float MOST_RUNS = 6.0;      // at a time; before the next search pixels of one vector wait for each other
const float MOST_SLABS = 4096.0;
const float NO_RUN = MOST_SLABS * MOST_SLABS - 1.0;  // behind all runs
const float NO_SLAB = MOST_SLABS - 1.0;

// Remove the first run and return it. Where there is none it lies NO_SLAB behind `base`.
vec2 take_run(inout Runs runs, float base) {
    float from = floor(runs.first * (1.0 / MOST_SLABS));
    vec2 run = base + vec2(from, runs.first - from * MOST_SLABS);
    runs = Runs(runs.second, runs.third, runs.fourth, runs.fifth, runs.sixth, NO_RUN);
    return run;
}

// Put a run behind `count` others.
void put_run(inout Runs runs, float count, float run) {
    if (count == 0.0) runs.first = run;
    if (count == 1.0) runs.second = run;
    if (count == 2.0) runs.third = run;
    if (count == 3.0) runs.fourth = run;
    if (count == 4.0) runs.fifth = run;
    if (count == 5.0) runs.sixth = run;
}

// The next runs for samples in the middle of slabs, from `slab` on, of `most` full slabs or some more. Return the
// slab from which on nothing is known yet. The search goes from sample to sample, so that no cell between two of
// them is asked; `sampled` are the depths of the first and the last sample, where the box cuts slabs short.
float find_runs(CellWalk walk, float base, float slab, float end, vec2 sampled, float most, out Runs runs) {
    float full_from = NOWHERE;
    float count = 0.0;
    runs = Runs(NO_RUN, NO_RUN, NO_RUN, NO_RUN, NO_RUN, NO_RUN);
    while (slab < end && count < MOST_RUNS) {
        vec3 cell = floor(walk.start + clamp(slab + 0.5, sampled.x, sampled.y) * walk.direction);
        uint entry = entry_of(walk, cell);
        vec3 depths = (cell + float(entry >> 1u)) * walk.depth_per_cell + walk.depth_at_zero;
        float next = max(ceil(min(depths.x, min(depths.y, depths.z)) - 0.5), slab + 1.0);
        bool is_full = (entry & 1u) == 1u;
        if (is_full) {
            full_from = min(full_from, slab);
            most -= next - slab;
        }
        // A run ends where emptiness begins, at the end of all, or where that is enough for now.
        if (full_from < NOWHERE && (!is_full || next >= end || most <= 0.0)) {
            put_run(runs, count, (full_from - base) * MOST_SLABS + ((is_full ? min(next, end) : slab) - base));
            count = most <= 0.0 ? MOST_RUNS : count + 1.0;
            full_from = NOWHERE;
        }
        slab = next;
        if (slab >= end || count >= MOST_RUNS) break;
    }
    return min(slab, end);
}
