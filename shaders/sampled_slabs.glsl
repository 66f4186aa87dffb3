// Colour and opacity of slabs whose medium is sampled in their middles, alone or in runs.
//
// Switches: CLASSIFICATION 0, 1 or 2, and those of medium.glsl.
//           AT_ONCE: slabs of a run that are sampled at a time, 2 or 4.
//           WHOLE_SLABS: texels of CLASSIFICATION 0 stand for the path through a whole slab as they are, 1; or for a
//           little less of the path, and nothing is opaque, 2.
//           DIVIDES 1: slabs that are not nearly transparent are divided, see divided_slabs.glsl.
//           SKIPS: see slab_runs.glsl.

#include "medium.glsl"
#include "compositing.glsl"
#include "slab_runs.glsl"

// True if the slabs that the box cuts short are sampled in runs with the others, and not apart from them. Where
// empty space is skipped, what is done once for each ray costs most; texels that stand for whole slabs make no
// shorter ones in a run. Slabs that may be divided are all alike.
const bool CUT_IN_RUNS = DIVIDES != 0 || (SKIPS != 0 && !(CLASSIFICATION == 0 && WHOLE_SLABS == 1));

#if AT_ONCE == 4
#define Slabs vec4
const vec4 NUMBERS = vec4(0.0, 1.0, 2.0, 3.0);
#else
#define Slabs vec2
const vec2 NUMBERS = vec2(0.0, 1.0);
#endif

// Premultiplied colour and opacity of the medium in a texel over a path; `length` is in slabs where texels stand for
// slabs.
#if CLASSIFICATION == 0
vec4 slab_color(vec4 texel, float length, vec3 position) {
    texel *= held_scale;
    float opacity = opacity_from_depth(length * depth_from_opacity(texel.a));
    return vec4(texel.rgb * (texel.a > 0.0 ? opacity / texel.a : length), opacity);
}
#elif CLASSIFICATION == 1
vec4 slab_color(vec4 texel, float length, vec3 position) {
    texel *= held_scale;
    float depth = texel.a * length;
    float opacity = opacity_from_depth(depth);
    return vec4(texel.rgb * (length * mean_transmittance(depth, opacity)), opacity);
}
#else
vec4 slab_color(vec4 texel, float length, vec3 position) {
    vec4 medium = medium_of(texel, position);
    length *= weight_at(position);
    return GLOWS ? color_of_glowing(medium, length) : color_of_straight(medium, length);
}
#endif

// Colour and opacity over a path in the medium at one position, as seen at its depth.
vec4 seen_color(vec4 texel, float length, vec3 position, float depth) {
    return cued(slab_color(texel, length, position), depth);
}

// The same for a fraction of a slab of a run: all of it or nothing where texels stand for whole slabs.
vec4 slab_color_in_run(vec4 texel, float length, float fraction, vec3 position, float depth) {
#if CLASSIFICATION == 0
    if (WHOLE_SLABS == 1) return cued(texel * (held_scale * fraction), depth);
    if (WHOLE_SLABS == 2 && !CUT_IN_RUNS) {
        // A + (1 - A) (1 - e^-x), where x is the optical depth of the path beyond 1: an error of x counts little.
        texel *= held_scale;
        float more = (length - 1.0) * depth_per_opacity(texel.a);
        more *= (1.0 - texel.a) * mean_transmittance_of_shallow(more * texel.a);
        return cued(texel * (fraction + fraction * more), depth);
    }
#endif
    return seen_color(texel, length * fraction, position, depth);
}

// Colour and opacity of a path as long as through a whole slab, in the medium at a depth.
vec4 color_at(BoxWalk walk, float depth) {
    vec3 position = walk_position(walk, depth);
    return seen_color(texel_at(position), walk.path_length, position, depth);
}

// Colour and opacity of a slab from one fraction of it to another.
vec4 part_of_slab(BoxWalk walk, float slab, vec2 ends) {
    float middle = slab + 0.5 * (ends.x + ends.y);
    vec3 position = walk_position(walk, middle);
    return seen_color(texel_at(position), (ends.y - ends.x) * walk.path_length, position, middle);
}

// Colour and opacity of a whole slab.
vec4 whole_slab(BoxWalk walk, float slab) {
    float middle = slab + 0.5;
    vec3 position = walk_position(walk, middle);
    return slab_color_in_run(texel_at(position), walk.path_length, 1.0, position, middle);
}

// Depths of the first and the last sample of all slabs that `progress` has ahead.
vec2 sampled_depths(BoxWalk walk, Progress progress) {
    if (!CUT_IN_RUNS) return vec2(progress.slab, progress.end);
    float first_back = walk.first_slab == walk.last_slab ? walk.last_fraction : 1.0;
    float first = walk.first_slab + 0.5 * (walk.first_fraction + first_back);
    return vec2(first, max(first, walk.last_slab + 0.5 * walk.last_fraction));
}

// Depths of the middles of the slabs from `slab` on, and the fractions of these that lie in the box and before `end`.
void middles_of(BoxWalk walk, float slab, float end, out Slabs middles, out Slabs fractions) {
    float front = 0.0;
    Slabs backs = Slabs(1.0);
    middles = slab + (NUMBERS + 0.5);
    if (CUT_IN_RUNS) {
        front = slab == walk.first_slab ? walk.first_fraction : 0.0;
        backs = mix(Slabs(1.0), Slabs(walk.last_fraction), equal(NUMBERS, Slabs(walk.last_slab - slab)));
        middles = (slab + NUMBERS) + 0.5 * backs;  // rounded as in `part_of_slab`
        middles.x = slab + 0.5 * (front + backs.x);
    }
    fractions = mix(Slabs(0.0), backs, lessThan(NUMBERS, Slabs(end - slab)));
    fractions.x = backs.x - front;
}

#if !DIVIDES  // else see divided_slabs.glsl
// `color` over the slabs from `slab` on, AT_ONCE of them: the loop itself takes time. At the very end there may be
// fewer.
vec4 over_slabs(vec4 color, BoxWalk walk, float slab, float end) {
    Slabs middles, there;
    middles_of(walk, slab, end, middles, there);
    float length = walk.path_length;
    vec3 first = walk_position(walk, middles.x);
    vec3 second = walk_position(walk, middles.y);
    vec4 first_texel = texel_at(first);
    vec4 second_texel = texel_at(second);
#if AT_ONCE == 4
    vec3 third = walk_position(walk, middles.z);
    vec3 fourth = walk_position(walk, middles.w);
    vec4 third_texel = texel_at(third);
    vec4 fourth_texel = texel_at(fourth);
#endif
    color = over(color, slab_color_in_run(first_texel, length, there.x, first, middles.x));
    color = over(color, slab_color_in_run(second_texel, length, there.y, second, middles.y));
#if AT_ONCE == 4
    color = over(color, slab_color_in_run(third_texel, length, there.z, third, middles.z));
    color = over(color, slab_color_in_run(fourth_texel, length, there.w, fourth, middles.w));
#endif
    return color;
}

// Colour and opacity of slabs from the start of a run on, some of them or until they are `enough`; `progress` goes
// on behind.
vec4 run_color(BoxWalk walk, inout SlabRuns runs, inout Progress progress, float enough) {
    vec4 color = vec4(0.0);
    float most = progress.samples + MOST_AT_ONCE;
    progress.slab = runs.run.x;
    while (progress.slab < progress.end && progress.samples < most && color.a < enough) {
        color = over_slabs(color, walk, progress.slab, progress.end);
        progress.samples += min(progress.end - progress.slab, float(AT_ONCE));
        progress.slab += float(AT_ONCE);
        continue_run(runs, progress);
        if (progress.slab >= progress.end || progress.samples >= most || color.a >= enough) break;
    }
    return color;
}
#endif
