// Colour and opacity of slabs along which the transfer function is integrated, alone or in runs.
//
// Switches: CLASSIFICATION 3, and those of medium.glsl. SKIPS: see slab_runs.glsl.

#include "medium.glsl"
#include "compositing.glsl"
#include "slab_runs.glsl"

const bool CUT_IN_RUNS = false;   // slabs that the box cuts short are integrated apart from the others

// `color` over a slab from a place to the second of two texels, where the place goes on to: two lines through three
// values have a quarter of the error of one line where the value bends inside a slab. The first texel is in the
// slab's middle, which is at `position` and `depth`; `step` and `depth_step` go from the slab's front to its back.
vec4 over_slab(
    vec4 color, inout Place place, vec4 middle, vec4 behind, float length, vec3 position, vec3 step, float depth,
    float depth_step) {
    color = over_half(color, place, middle, 0.5 * length, position - 0.25 * step, depth - 0.25 * depth_step);
    return over_half(color, place, behind, 0.5 * length, position + 0.25 * step, depth + 0.25 * depth_step);
}

// Colour and opacity of a path as long as through a whole slab, in the medium at a depth.
vec4 color_at(BoxWalk walk, float depth) {
    vec3 position = walk_position(walk, depth);
    vec4 texel = texel_at(position);
    Place place = place_of(texel);
    return over_slab(vec4(0.0), place, texel, texel, walk.path_length, position, vec3(0.0), depth, 0.0);
}

// Colour and opacity of a slab from one fraction of it to another.
vec4 part_of_slab(BoxWalk walk, float slab, vec2 ends) {
    float part = ends.y - ends.x;
    float depth = slab + 0.5 * (ends.x + ends.y);
    vec3 position = walk_position(walk, depth);
    Place place = place_of(texel_at(walk_position(walk, slab + ends.x)));
    vec4 behind = texel_at(walk_position(walk, slab + ends.y));
    return over_slab(
        vec4(0.0), place, texel_at(position), behind, part * walk.path_length, position, part * walk.step, depth, part);
}

// Colour and opacity of a whole slab.
vec4 whole_slab(BoxWalk walk, float slab) {
    return part_of_slab(walk, slab, vec2(0.0, 1.0));
}

// Depths of the first and the last sample of all slabs that `progress` has ahead.
vec2 sampled_depths(BoxWalk walk, Progress progress) {
    return vec2(progress.slab, progress.end);
}

// Colour and opacity of slabs from the start of a run on, some of them or until they are `enough`; `progress` goes
// on behind.
vec4 run_color(BoxWalk walk, inout SlabRuns runs, inout Progress progress, float enough) {
    vec4 color = vec4(0.0);
    float slab = runs.run.x;
    float end = min(min(runs.run.y, progress.end), slab + MOST_AT_ONCE);
    progress.samples += end - slab;
    Place place = place_of(texel_at(walk_position(walk, slab)));
    for (;;) {
        float depth = slab + 0.5;
        vec3 position = walk_position(walk, depth);
        vec4 middle = texel_at(position);
        slab += 1.0;
        vec4 behind = texel_at(walk_position(walk, slab));
        color = over_slab(color, place, middle, behind, walk.path_length, position, walk.step, depth, 1.0);
        if (slab >= end || color.a >= enough) break;
    }
    progress.samples -= end - slab;
    progress.slab = slab;
    return color;
}
