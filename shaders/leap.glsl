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

// The depth from `depth` on at which matter may begin, no more than `end`; in `full_until` the one until which it may
// go on, through neighbouring cells, no farther than `most` from there.
float leap(CellWalk walk, float depth, float end, float most, out float full_until) {
    vec3 last = vec3(textureSize(leaps, 0) - 1);
    vec3 cell = floor(walk.start + depth * walk.way);
    float full_from = 1e30;
    while (depth < min(end, full_from + most)) {
        uint entry = texelFetch(leaps, ivec3(clamp(walk.sign * cell + walk.first, vec3(0.0), last)), 0).r;
        if ((entry & 1u) == 1u) full_from = min(full_from, depth);
        else if (full_from <= depth) break;
        vec3 beyond = cell + float(entry >> 1u);
        vec3 depths = beyond * walk.depth_per_cell + walk.depth_at_zero;
        float leaving = max(min(depths.x, min(depths.y, depths.z)), depth);
        // Along the axis that it leaves by the next cell is known; along the others no rounding takes it back.
        vec3 next = max(floor(walk.start + leaving * walk.way), cell);
        cell = mix(next, beyond, lessThanEqual(depths, vec3(leaving)));
        depth = leaving;
    }
    full_until = depth;
    return min(full_from, end);
}
