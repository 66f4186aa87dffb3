// Colour and opacity of a stack of slabs of one volume on a pixel's ray: each slab contributes over the ray's own
// path through the slab and the box, and the slabs are composited in registers, front to back. See several.glsl for the
// reason why that is another program.
//
// Switches: CLASSIFICATION, and those of medium.glsl. AT_ONCE, WHOLE_SLABS: see sampled_slabs.glsl.
//           PERSPECTIVE, BRICKS, HALF_SPACES, INTERVAL: see stack_walk.glsl. SKIPS: see slab_runs.glsl.
//           CAPS: see end_slabs.glsl. COUNT: see compositing.glsl.

#include "stack_walk.glsl"
#include "end_slabs.glsl"

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

// Colour and opacity of the slabs of a polygon at a position in the window; false if there are none.
bool draw_stack(vec2 window_position, vec2 slab_range, out vec4 color) {
    vec2 slabs;
    BoxWalk walk = stack_walk(window_position, slab_range, slab_length, slabs);
    color = vec4(0.0);
    if (slabs.x >= slabs.y) return false;
    prepare_medium(pixel_at(window_position));
    Progress progress = Progress(vec4(0.0), slabs.x, slabs.y, 0.0);
    vec4 behind = vec4(0.0);
    if (!CUT_IN_RUNS) behind = last_color(walk, progress);
    draw_cap(walk, progress);
    if (!CUT_IN_RUNS) draw_first_slab(walk, progress);
    draw_runs(walk, slabs.x, progress);
    if (!CUT_IN_RUNS) progress.color = over(progress.color, behind);
    color = target_color(progress.color, progress.samples);
    return true;
}
