// Slabs of a run, each as thick as its own medium allows: nearly transparent ones are sampled in their middles, two at a
// time, and others in the middles of their thirds, of which the slab's middle is one. What is between shows both, mixed
// by the extinction in the middle, so that no rounding turns one picture into another.
//
// Whether a slab is divided depends on nothing but its own middle: bricks, blocks and leaps change no picture. It is the
// same at each thickness: so the error is of order 2, and halved slabs tell it.
//
// Switches: those of sampled_slabs.glsl, of CLASSIFICATION 2 and AT_ONCE 2.

#include "sampled_slabs.glsl"

flat uniform float least_divided;  // optical depth of a slab from which on its thirds count; from twice that only they

// A slab that is to be divided.
struct Divided {
    float share;                  // of its thirds, beside the slab as a whole; 0: none is divided
    vec4 medium;                  // in its middle
    float length;                 // of the ray's path through it, times the weight in its middle
};
const Divided NONE = Divided(0.0, vec4(0.0), 0.0);

// Colour and opacity of a path in a medium as `medium_of` returns it, as seen at its depth.
vec4 path_color(vec4 medium, float length, float depth) {
    return cued(GLOWS ? color_of_glowing(medium, length) : color_of_straight(medium, length), depth);
}

// Share of the thirds of a slab in its colour.
float share_of_thirds(vec4 medium, float length) {
    return clamp(medium.a * length / least_divided - 1.0, 0.0, 1.0);
}

// `color` over the thirds of a slab, of which the colours in front of and behind its middle are known.
vec4 over_thirds(vec4 color, Divided slab, float middle, vec4 front, vec4 behind) {
    vec4 whole = path_color(slab.medium, slab.length, middle);
    vec4 thirds = over(over(front, path_color(slab.medium, slab.length / 3.0, middle)), behind);
    return over(color, mix(whole, thirds, slab.share));
}

// `color` over the next slab, of which that colour is known, or that slab kept to be divided.
vec4 over_next(vec4 color, vec4 slab_color, vec4 medium, float length, out Divided divided, inout Progress progress) {
    divided = Divided(share_of_thirds(medium, length), medium, length);
    if (divided.share > 0.0) return color;
    progress.slab += 1.0;
    progress.samples += 1.0;
    return over(color, slab_color);
}

// `color` over the next slab or two, or over a slab that is to be divided: that comes last, as only its middle is known.
vec4 over_slabs(vec4 color, BoxWalk walk, inout Divided divided, inout Progress progress) {
    bool divides = divided.share > 0.0;
    Slabs middles, there;
    middles_of(walk, progress.slab, progress.end, middles, there);
    float third = there.x / 3.0;
    vec2 depths = divides ? middles.x + vec2(-third, third) : middles;
    vec2 lengths = walk.path_length * (divides ? vec2(third) : there);
    vec3 first = walk_position(walk, depths.x);
    vec3 second = walk_position(walk, depths.y);
    vec4 first_texel = texel_at(first);
    vec4 second_texel = texel_at(second);
    lengths *= vec2(weight_at(first), weight_at(second));
    vec4 first_medium = medium_of(first_texel, first);
    vec4 second_medium = medium_of(second_texel, second);
    vec4 first_color = path_color(first_medium, lengths.x, depths.x);
    vec4 second_color = path_color(second_medium, lengths.y, depths.y);
    if (divides) {
        color = over_thirds(color, divided, middles.x, first_color, second_color);
        divided = NONE;
        progress.slab += 1.0;
        progress.samples += 3.0;
    } else {
        color = over_next(color, first_color, first_medium, lengths.x, divided, progress);
        if (divided.share == 0.0 && there.y > 0.0) {
            color = over_next(color, second_color, second_medium, lengths.y, divided, progress);
        }
    }
    return color;
}

// Colour and opacity of slabs from the start of a run on, see sampled_slabs.glsl. A slab whose middle alone is known at
// the end begins the next run anew.
vec4 run_color(BoxWalk walk, inout SlabRuns runs, inout Progress progress, float enough) {
    vec4 color = vec4(0.0);
    float most = progress.samples + MOST_AT_ONCE;
    Divided divided = NONE;
    progress.slab = runs.run.x;
    while (progress.slab < progress.end && progress.samples < most && color.a < enough) {
        color = over_slabs(color, walk, divided, progress);
        if (divided.share == 0.0) continue_run(runs, progress);
        if (progress.slab >= progress.end || progress.samples >= most || color.a >= enough) break;
    }
    return color;
}
