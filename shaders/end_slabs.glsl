// The slabs that the box cuts short: the first and the last one of a ray.
//
// Switches: CLASSIFICATION, and those of medium.glsl. CAPS 1: where half spaces cut the medium open it is opaque.

#include "medium.glsl"
#include "compositing.glsl"
#include "slab_runs.glsl"
#if CLASSIFICATION == 3
#include "integrated_slabs.glsl"
#else
#include "sampled_slabs.glsl"
#if DIVIDES
#include "divided_slabs.glsl"
#endif
#endif

// Where a half space cuts the medium open: its colour, opaque, and the end of the ray.
void draw_cap(BoxWalk walk, inout Progress progress) {
    if (CAPS != 0 && walk.is_cut_open && progress.slab == walk.first_slab) {
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
