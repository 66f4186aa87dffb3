#version 330
// Colour and opacity of a stack of slabs of one volume on a pixel's ray: each slab contributes over the ray's own
// path through the slab and the box, and the slabs are composited in registers, front to back. See several.frag for the
// reason why that is another program.
//
// Switches: CLASSIFICATION, and those of medium.glsl. AT_ONCE, WHOLE_SLABS: see sampled_slabs.glsl.
//           PERSPECTIVE, BRICKS, HALF_SPACES, INTERVAL: see stack_walk.glsl. SKIPS: see slab_runs.glsl.
//           CAPS: see end_slabs.glsl. COUNT: see compositing.glsl.

#include "stack_walk.glsl"
#include "end_slabs.glsl"

flat in vec2 slab_range;
out vec4 stack_color;

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
    draw_cap(walk, progress);
    if (!CUT_IN_RUNS) draw_first_slab(walk, progress);
    draw_runs(walk, slabs.x, progress);
    if (!CUT_IN_RUNS) progress.color = over(progress.color, behind);
    stack_color = target_color(progress.color, progress.samples);
}
