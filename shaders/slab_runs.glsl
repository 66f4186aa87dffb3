// Runs of consecutive slabs of a ray that are sampled, with empty space skipped between them; and how far the ray
// has come.
//
// Switches: SKIPS 1: slabs that `skips` shows to be empty are skipped.
//           CLASSIFICATION: see medium.glsl. Slabs of 3 are in all cells between their planes, others are in the cells
//           of their middles.

#include "box_walk.glsl"
#if SKIPS
#include "skip.glsl"
#if CLASSIFICATION == 2
flat uniform float slabs_ahead;        // of the medium, that are looked for before they are sampled
#else
const float slabs_ahead = 64.0;
#endif
#endif

struct Progress {
    vec4 color;                   // premultiplied colour and opacity of all slabs so far
    float slab;                   // the next one
    float end;                    // the one after the last
    float samples;                // number of slabs sampled so far
};

struct SlabRuns {
    vec2 run;                     // first slab of the run, and the one after its last; NOWHERE: there is no run
#if SKIPS
    CellWalk cells;
#if CLASSIFICATION != 3
    float base;                   // first slab of the ray
    vec2 sampled;                 // depth of the first and the last sample
    Runs next;                    // runs behind this one
    float known_until;            // the slab from which on nothing is known yet
#endif
#endif
};

// Runs of the slabs of a ray, before the first of them is looked for. `base` is the first slab of the ray, and
// `sampled` the depths of the first and the last sample.
SlabRuns slab_runs(BoxWalk walk, float base, vec2 sampled) {
    SlabRuns runs;
#if SKIPS
    runs.cells = cell_walk(walk.start, walk.step);
#if CLASSIFICATION != 3
    runs.base = base;
    runs.sampled = sampled;
#endif
#endif
    return runs;
}

// Look for the first run from the next slab on.
void find_run(inout SlabRuns runs, Progress progress) {
#if !SKIPS
    runs.run = vec2(progress.slab, progress.end);
#elif CLASSIFICATION == 3
    runs.run = full_run(runs.cells, progress.slab, progress.end);
#else
    runs.known_until = find_runs(
        runs.cells, runs.base, progress.slab, progress.end, runs.sampled, slabs_ahead, runs.next);
    runs.run = take_run(runs.next, runs.base);
#endif
}

// At the end of a run go on with the next one that is known: so neighbours in a vector of pixels do not wait for each
// other's runs.
void continue_run(inout SlabRuns runs, inout Progress progress) {
#if SKIPS && CLASSIFICATION != 3
    if (progress.slab >= runs.run.y) {
        runs.known_until = max(runs.known_until, progress.slab);  // of several slabs at once the last may lie beyond
        runs.run = take_run(runs.next, runs.base);
        progress.slab = max(progress.slab, runs.run.x);
    }
#endif
}

// Behind the last run that is known go on where nothing is known yet.
void leave_run(SlabRuns runs, inout Progress progress) {
#if SKIPS && CLASSIFICATION != 3
    if (progress.slab >= runs.base + NO_SLAB) progress.slab = runs.known_until;
#endif
}
