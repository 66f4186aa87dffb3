#version 330
// Colour and opacity of a stack of slabs of one volume on a pixel's ray: each slab contributes over the ray's own
// path through the slab and the box, and the slabs are composited in registers, front to back. See several.frag for the
// reason why that is another program.
//
// Switches: CLASSIFICATION, and those of medium.glsl. AT_ONCE, WHOLE_SLABS: see sampled_slabs.glsl.
//           PERSPECTIVE, BRICKS, HALF_SPACES, INTERVAL: see stack_walk.glsl. SKIPS: see slab_runs.glsl.
//           CAPS 1: where half spaces cut the medium open it is opaque. COUNT: see compositing.glsl.

#include "stack_walk.glsl"
#include "medium.glsl"
#include "compositing.glsl"
#include "slab_runs.glsl"
#if CLASSIFICATION == 3
#include "integrated_slabs.glsl"
#else
#include "sampled_slabs.glsl"
#endif

flat in vec2 slab_range;
out vec4 stack_color;

// Where a half space cuts the medium open: its colour, opaque, and the end of the ray.
void draw_cap(BoxWalk walk, inout Progress progress) {
    if (walk.is_cut_open && progress.slab == walk.first_slab) {
        vec4 color = color_at(walk, walk.first_slab + walk.first_fraction);
        progress.color = color.a > 0.0 ? vec4(color.rgb / color.a, 1.0) : vec4(0.0);
        if (progress.color.a > 0.0) progress.end = progress.slab;
    }
}

// Colour and opacity of the last slab, where the box cuts it short and it is not the first one.
vec4 last_color(BoxWalk walk, inout Progress progress) {
    vec4 color = vec4(0.0);
    if (progress.end > walk.last_slab && progress.slab <= walk.last_slab && walk.last_slab > walk.first_slab) {
        color = part_of_slab(walk, walk.last_slab, vec2(0.0, walk.last_fraction));
        progress.samples += 1.0;
    }
    return color;
}

// The first slab, where the box cuts it short.
void draw_first_slab(BoxWalk walk, inout Progress progress) {
    if (progress.slab == walk.first_slab && progress.slab < progress.end) {
        float back = walk.first_slab == walk.last_slab ? walk.last_fraction : 1.0;
        progress.color = part_of_slab(walk, progress.slab, vec2(walk.first_fraction, back));
        progress.samples += 1.0;
        progress.slab += 1.0;
    }
    progress.end = min(progress.end, walk.last_slab);
}

// All other slabs, in runs, until nothing behind them shows. `base` is the first slab of the ray.
void draw_runs(BoxWalk walk, float base, inout Progress progress) {
    SlabRuns runs = slab_runs(walk, base, sampled_depths(walk, progress));
    while (progress.slab < progress.end) {
        find_run(runs, progress);
        if (CLASSIFICATION == 3 && runs.run.x == NOWHERE) break;
        vec4 color = run_color(walk, runs, progress, sufficient_opacity(progress.color.a));
        progress.color = over(progress.color, color);
        if (is_finished(progress.color.a)) break;
        leave_run(runs, progress);
        if (progress.slab >= progress.end) break;
    }
}

void main() {
    vec2 slabs;
    BoxWalk walk = stack_walk(gl_FragCoord.xy, slab_range, slab_length, slabs);
    if (slabs.x >= slabs.y) discard;
    prepare_medium(pixel_at(gl_FragCoord.xy));
    Progress progress = Progress(vec4(0.0), slabs.x, slabs.y, 0.0);
    vec4 behind = vec4(0.0);
    if (!CUT_IN_RUNS) behind = last_color(walk, progress);
    if (CAPS != 0) draw_cap(walk, progress);
    if (!CUT_IN_RUNS) draw_first_slab(walk, progress);
    draw_runs(walk, slabs.x, progress);
    if (!CUT_IN_RUNS) progress.color = over(progress.color, behind);
    stack_color = target_color(progress.color, progress.samples);
}
