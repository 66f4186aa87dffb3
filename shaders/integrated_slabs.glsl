// Colour and opacity of slabs along which the transfer function is integrated, alone or in runs.
//
// Switches: CLASSIFICATION 3, and those of medium.glsl. SKIPS: see slab_runs.glsl.

#include "medium.glsl"
#include "compositing.glsl"
#include "slab_runs.glsl"

const bool CUT_IN_RUNS = false;   // slabs that the box cuts short are integrated apart from the others

// Colour and opacity of a slab between three texels: two lines through three values have a quarter of the error of
// one line where the value bends inside a slab. The slab's middle is at `position` and `depth`, and `step` and
// `depth_step` go from its front to its back.
vec4 color_through(
    vec4 front, vec4 middle, vec4 behind, float length, vec3 position, vec3 step, float depth, float depth_step) {
    vec4 first = color_between(front, middle, 0.5 * length, position - 0.25 * step, depth - 0.25 * depth_step);
    vec4 second = color_between(middle, behind, 0.5 * length, position + 0.25 * step, depth + 0.25 * depth_step);
    return over(first, second);
}

// Colour and opacity of a path as long as through a whole slab, in the medium at a depth.
vec4 color_at(BoxWalk walk, float depth) {
    vec3 position = walk_position(walk, depth);
    vec4 texel = texel_at(position);
    return color_between(texel, texel, walk.path_length, position, depth);
}

// Colour and opacity of a slab from one fraction of it to another.
vec4 part_of_slab(BoxWalk walk, float slab, vec2 ends) {
    float part = ends.y - ends.x;
    float depth = slab + 0.5 * (ends.x + ends.y);
    vec3 position = walk_position(walk, depth);
    vec4 front = texel_at(walk_position(walk, slab + ends.x));
    vec4 behind = texel_at(walk_position(walk, slab + ends.y));
    return color_through(
        front, texel_at(position), behind, part * walk.path_length, position, part * walk.step, depth, part);
}

// Colour and opacity of a whole slab.
vec4 whole_slab(BoxWalk walk, float slab) {
    float depth = slab + 0.5;
    vec3 position = walk_position(walk, depth);
    vec4 front = texel_at(walk_position(walk, slab));
    vec4 behind = texel_at(walk_position(walk, slab + 1.0));
    return color_through(front, texel_at(position), behind, walk.path_length, position, walk.step, depth, 1.0);
}

// Depths of the first and the last sample of all slabs that `progress` has ahead.
vec2 sampled_depths(BoxWalk walk, Progress progress) {
    return vec2(progress.slab, progress.end);
}

// Colour and opacity of slabs from the start of a run on, some of them or until they are `enough`; `progress` goes
// on behind.
vec4 run_color(BoxWalk walk, inout SlabRuns runs, inout Progress progress, float enough) {
    vec4 color = vec4(0.0);
    float most = progress.samples + MOST_AT_ONCE;
    progress.slab = runs.run.x;
    vec4 front = texel_at(walk_position(walk, progress.slab));
    while (progress.slab < progress.end && progress.samples < most && color.a < enough) {
        float depth = progress.slab + 0.5;
        vec3 middle = walk_position(walk, depth);
        vec4 behind = texel_at(walk_position(walk, progress.slab + 1.0));
        color = over(color, color_through(
            front, texel_at(middle), behind, walk.path_length, middle, walk.step, depth, 1.0));
        front = behind;
        progress.slab += 1.0;
        progress.samples += 1.0;
        if (progress.slab >= runs.run.y) break;
        if (progress.slab >= progress.end || progress.samples >= most || color.a >= enough) break;
    }
    return color;
}
