// Empty space: the box is divided into cells, and each knows how far all around it is as empty, or as full, as itself.

uniform usampler3D leaps;         // per cell: 2 r + (1 where there is matter); all cells less than r away are alike
uniform vec3 cells_per_box;

// A ray through the cells, in coordinates that grow along it: where it goes downwards they are mirrored at 0.
struct CellWalk {
    vec3 start;                   // where it is at depth 0
    vec3 way;                     // per unit of depth, not negative
    vec3 depth_per_cell;
    vec3 depth_at_zero;           // where each coordinate is 0
    vec3 sign;                    // cell c of the mirrored coordinates is cell sign * c + first
    vec3 first;
};

CellWalk cell_walk(vec3 start, vec3 step) {
    vec3 sign = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(step, vec3(0.0)));
    CellWalk walk;
    walk.start = sign * start * cells_per_box;
    walk.way = sign * step * cells_per_box;
    walk.depth_per_cell = 1.0 / max(walk.way, vec3(1e-30));
    walk.depth_at_zero = -walk.start * walk.depth_per_cell;
    walk.sign = sign;
    walk.first = min(sign, vec3(0.0));
    return walk;
}

// Cell by cell: whether there is matter from `depth` on, which becomes where that may change, in the cell that it does.
bool is_full_until(CellWalk walk, inout vec3 cell, inout float depth) {
    vec3 last = vec3(textureSize(leaps, 0) - 1);
    uint entry = texelFetch(leaps, ivec3(clamp(walk.sign * cell + walk.first, vec3(0.0), last)), 0).r;
    vec3 beyond = cell + float(entry >> 1u);
    vec3 depths = beyond * walk.depth_per_cell + walk.depth_at_zero;
    float leaving = max(min(depths.x, min(depths.y, depths.z)), depth);
    // Along the axis that it leaves by the next cell is known; along the others no rounding takes it back.
    vec3 next = max(floor(walk.start + leaving * walk.way), cell);
    cell = mix(next, beyond, lessThanEqual(depths, vec3(leaving)));
    depth = leaving;
    return (entry & 1u) == 1u;
}

const float NOWHERE = 1e9;

// The first slab from `slab` on in which matter may be met, and the first after it in which there is none.
vec2 full_run(CellWalk walk, float slab, float end) {
    float depth = slab;
    vec3 cell = floor(walk.start + depth * walk.way);
    vec2 run = vec2(NOWHERE);
    float from = depth;
    bool is_full = false;
    while (depth < end && !is_full) {
        from = depth;
        is_full = is_full_until(walk, cell, depth);
    }
    if (!is_full) return run;
    bool goes_on = true;
    float until = depth;
    while (until < end && goes_on) {
        depth = until;
        goes_on = is_full_until(walk, cell, depth);
        if (goes_on) until = depth;
    }
    return vec2(max(floor(from), slab), min(ceil(until), end));
}

// Where matter may be met next: the first slab of a run and the one after its last, of up to three runs from `slab` on,
// NOWHERE where there are fewer. A slab belongs to the cell in which it is sampled, at the share `sample_at` of it, or if
// that is 0 to all that it touches. The slab from which on nothing is known yet is returned.
float leap(CellWalk walk, float slab, float end, float sample_at, out vec2 run, out vec2 second, out vec2 third) {
    float depth = slab + sample_at;
    vec3 cell = floor(walk.start + depth * walk.way);
    float full_from = NOWHERE;
    run = second = third = vec2(NOWHERE);
    while (depth < end && third.x == NOWHERE) {
        float leaving = depth;
        bool is_full = is_full_until(walk, cell, leaving);
        if (is_full) full_from = min(full_from, depth);
        // A run ends where emptiness begins, or at the end of all.
        float until = is_full ? leaving : depth;
        if (full_from < NOWHERE && (!is_full || leaving >= end)) {
            vec2 found = vec2(sample_at > 0.0 ? ceil(full_from - sample_at) : floor(full_from), min(ceil(until - sample_at), end));
            if (found.x < found.y) {
                if (run.x == NOWHERE) run = found;
                else if (second.x == NOWHERE) second = found;
                else third = found;
            }
            full_from = NOWHERE;
        }
        depth = leaving;
    }
    return depth < end ? third.y : end;
}
