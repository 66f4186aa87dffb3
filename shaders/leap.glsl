// Empty space: the box is divided into cells, and each knows how far all around it is as empty, or as full, as itself.

uniform usampler3D leaps;         // per cell: 2 r + (1 where there is matter); all cells less than r away are alike
uniform vec3 cells_per_box;

struct CellWalk {                 // a ray through the cells
    vec3 start;                   // where it is at depth 0, in cells
    vec3 way;                     // per unit of depth
    vec3 depth_per_cell;          // how much depth a cell takes, along each axis
    vec3 ahead;                   // 1 where it goes upwards
};

CellWalk cell_walk(vec3 start, vec3 step) {
    vec3 way = step * cells_per_box;
    vec3 moving = mix(way, vec3(-1e-30), lessThan(abs(way), vec3(1e-30)));
    return CellWalk(start * cells_per_box, way, 1.0 / moving, vec3(greaterThan(moving, vec3(0.0))));
}

// The depth from `depth` on at which matter may begin, no more than `end`; in `full_until` the one until which it may
// go on.
float leap(CellWalk walk, float depth, float end, out float full_until) {
    ivec3 last = textureSize(leaps, 0) - 1;
    ivec3 cell = ivec3(floor(walk.start + depth * walk.way));
    ivec3 direction = ivec3(walk.ahead) * 2 - 1;
    full_until = end;
    while (depth < end) {
        uint entry = texelFetch(leaps, clamp(cell, ivec3(0), last), 0).r;
        int reach = int(entry >> 1u);
        vec3 depths = (vec3(cell + direction * (reach - 1)) + walk.ahead - walk.start) * walk.depth_per_cell;
        float leaving = max(min(depths.x, min(depths.y, depths.z)), depth);
        if ((entry & 1u) == 1u) {
            full_until = leaving;
            break;
        }
        // Along the axis that it leaves by the next cell is known; along the others no rounding takes it back.
        ivec3 next = ivec3(floor(walk.start + leaving * walk.way));
        bvec3 by = lessThanEqual(depths, vec3(leaving));
        next = ivec3(mix(vec3(next), vec3(cell + direction * reach), vec3(by)));
        cell = direction * max(direction * next, direction * cell);
        depth = leaving;
    }
    return min(depth, end);
}
