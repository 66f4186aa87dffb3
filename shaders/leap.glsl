// Empty space: the box is divided into cells, and each knows how far on all is as empty, or as full, as itself.
//
// Loops that end at their condition are left at their end as well: a driver that draws pixels as a vector goes through the
// body once more to find out that none of them has anything left to do.

// Per cell: 2 r + (1 where there is matter); all cells less than r away are alike, among those that a ray may come to.
// The first half along an axis is for rays that go up along it, the second for those that go down.
uniform usampler3D skips;
flat uniform vec3 cells_per_box;

// A ray through the cells, in coordinates that grow along it: where it goes downwards they are mirrored at 0.
struct CellWalk {
    vec3 start;                   // where it is at depth 0
    vec3 direction;                     // per unit of depth, not negative
    vec3 depth_per_cell;
    vec3 depth_at_zero;           // where each coordinate is 0
    vec3 sign;                    // cell c of the mirrored coordinates is texel sign * c + first
    vec3 first;
    vec3 lowest;                  // texel of the ray's half
    vec3 highest;
};

CellWalk cell_walk(vec3 start, vec3 step) {
    vec3 sign = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(step, vec3(0.0)));
    CellWalk walk;
    walk.start = sign * start * cells_per_box;
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

// What `leaps` says of a cell; rounding may put it beside the box.
uint entry_of(CellWalk walk, vec3 cell) {
    return texelFetch(skips, ivec3(clamp(walk.sign * cell + walk.first, walk.lowest, walk.highest)), 0).r;
}

// Cell by cell: whether there is matter from `depth` on, which becomes where that may change, in the cell that it does.
bool is_full_until(CellWalk walk, inout vec3 cell, inout float depth) {
    uint entry = entry_of(walk, cell);
    vec3 beyond = cell + float(entry >> 1u);
    vec3 depths = beyond * walk.depth_per_cell + walk.depth_at_zero;
    float leaving = max(min(depths.x, min(depths.y, depths.z)), depth);
    // Along the axis that it leaves by the next cell is known; along the others no rounding takes it back.
    vec3 next = max(floor(walk.start + leaving * walk.direction), cell);
    cell = mix(next, beyond, lessThanEqual(depths, vec3(leaving)));
    depth = leaving;
    return (entry & 1u) == 1u;
}

const float NOWHERE = 1e9;

// The first slab from `slab` on that touches a cell in which matter may be met, and the first after it that touches none,
// or the one after it: rounding may end a cell where the slab begins.
vec2 full_run(CellWalk walk, float slab, float end) {
    float depth = slab;
    vec3 cell = floor(walk.start + depth * walk.direction);
    vec2 run = vec2(NOWHERE);
    float from = depth;
    bool is_full = false;
    while (depth < end && !is_full) {
        from = depth;
        is_full = is_full_until(walk, cell, depth);
        if (depth >= end || is_full) break;
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

// Runs of slabs in which matter may be met, front to back. A run is one number, so that more of them fit beside what else
// a ray has to remember: its first slab and the one after its last, counted from `base`, the ray's first, of which a stack
// has fewer than MOST_SLABS (slicing.py). A float32 counts to the square of that.
struct Runs {
    float first, second, third, fourth, fifth, sixth;
};
const float MOST_RUNS = 6.0;      // at a time: neighbours in a vector of pixels wait for each other before they look for more
const float MOST_SLABS = 4096.0;
const float NO_RUN = MOST_SLABS * MOST_SLABS - 1.0;  // behind all that there are

// The first run, which is taken away from the others. Where there is none it lies NO_SLAB behind `base`.
const float NO_SLAB = MOST_SLABS - 1.0;
vec2 take_run(inout Runs runs, float base) {
    float from = floor(runs.first * (1.0 / MOST_SLABS));
    vec2 run = base + vec2(from, runs.first - from * MOST_SLABS);
    runs = Runs(runs.second, runs.third, runs.fourth, runs.fifth, runs.sixth, NO_RUN);
    return run;
}

// Where matter may be met next by samples in the middle of slabs, from `slab` on, in `most` slabs or some more. The slab
// from which on nothing is known yet is returned. It goes from sample to sample, so that no cell between two of them is
// asked; `sampled` are the first and the last that there are, where the box cuts slabs short.
float skip(CellWalk walk, float base, float slab, float end, vec2 sampled, float most, out Runs runs) {
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
            float run = (full_from - base) * MOST_SLABS + ((is_full ? min(next, end) : slab) - base);
            if (count == 0.0) runs.first = run;
            if (count == 1.0) runs.second = run;
            if (count == 2.0) runs.third = run;
            if (count == 3.0) runs.fourth = run;
            if (count == 4.0) runs.fifth = run;
            if (count == 5.0) runs.sixth = run;
            count = most <= 0.0 ? MOST_RUNS : count + 1.0;
            full_from = NOWHERE;
        }
        slab = next;
        if (slab >= end || count >= MOST_RUNS) break;
    }
    return min(slab, end);
}
