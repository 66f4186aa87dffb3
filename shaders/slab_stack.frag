#version 330
// One pixel's ray through one brick: each slab contributes over the ray's own way through slab ∩ box, and the slabs are
// composited in registers, front to back.
//
// Depths and positions are those of depths.glsl.
//
// Switches: CLASSIFICATION, and those of matter.glsl. AT_ONCE: slabs of a run that are sampled at a time, 2 or 4.
//           WHOLE_SLABS: the texels of CLASSIFICATION 0 stand for the ray's way through a slab as they are, 1; or for a
//           little less of it, and nothing is opaque, 2.
//           BRICKS 1: the texture is a part of the volume, and the slabs whose middle lies in it are drawn.
//           PERSPECTIVE, HALF_SPACES, STRETCH: see ray.glsl. CAPS 1: where half spaces cut matter open it is opaque.
//           LEAPS 1: what `leaps` shows to be empty is leapt over.
//           COUNT 1: red is how many slabs were sampled.

#include "ray.glsl"
#include "matter.glsl"

flat uniform float color_scale;        // brings the brightest emission near 1, for targets of few digits
flat uniform float least_transmittance;  // a ray that lets no more through is done; 0: none ever is
#if SKIPS
#include "leap.glsl"
#if CLASSIFICATION == 2
flat uniform float slabs_ahead;        // of matter, that are looked for before they are sampled
#else
const float slabs_ahead = 64.0;
#endif
#endif

flat in vec2 slab_range;
out vec4 stack_color;             // premultiplied

// Slabs that the box cuts short are sampled apart from the others, or in runs with them, where they are leapt over: what is
// sampled for each ray costs most where little else is. Texels that stand for whole slabs make no shorter ones in a run.
#define CUT_IN_RUNS (SKIPS && CLASSIFICATION != 3 && !(CLASSIFICATION == 0 && WHOLE_SLABS == 1))
const float MOST_AT_ONCE = 64.0;  // slabs composited before they are put behind the others: sums of few keep digits
#if AT_ONCE == 4
#define Several vec4
#define bSeveral bvec4
const vec4 NUMBERS = vec4(0.0, 1.0, 2.0, 3.0);
#else
#define Several vec2
#define bSeveral bvec2
const vec2 NUMBERS = vec2(0.0, 1.0);
#endif

#if CLASSIFICATION == 0
// Premultiplied colour and opacity of the matter in `texel`, over `length` times what it stands for.
vec4 slab_color(vec4 texel, float length) {
    texel *= held_scale;
    float opacity = opacity_from_depth(length * depth_from_opacity(texel.a));
    return vec4(texel.rgb * (texel.a > 0.0 ? opacity / texel.a : length), opacity);
}
#elif CLASSIFICATION == 1
vec4 slab_color(vec4 texel, float length) {
    texel *= held_scale;
    float depth = texel.a * length;
    float opacity = opacity_from_depth(depth);
    return vec4(texel.rgb * (length * mean_transmittance(depth, opacity)), opacity);
}
#elif CLASSIFICATION == 2
vec4 slab_color(vec4 texel, float length, vec3 position) {
    vec4 medium = medium_of(texel, position);
#if WEIGHTS
    length *= weight_at(position);
#endif
    return GLOWS ? color_of_glowing(medium, length) : color_of_straight(medium, length);
}
#endif

#if CLASSIFICATION != 3
// Colour and opacity of matter like that in the middle, where `texel` is, over `length`.
vec4 color_at_middle(vec4 texel, float length, vec3 position, float depth) {
#if CLASSIFICATION == 2
    return cued(slab_color(texel, length, position), depth);
#else
    return cued(slab_color(texel, length), depth);
#endif
}

// The same for a slab of a run, of which the share `is_there` is: all of it or nothing where texels stand for whole slabs.
vec4 slab_color_in_run(vec4 texel, float length, float is_there, vec3 position, float depth) {
#if CLASSIFICATION == 0 && WHOLE_SLABS == 1
    return cued(texel * (held_scale * is_there), depth);
#elif CLASSIFICATION == 0 && WHOLE_SLABS == 2 && !CUT_IN_RUNS
    // A + (1 - A) (1 - e^-x), where x is the depth of what `length` is more: what is off in that counts little.
    texel *= held_scale;
    float more = (length - 1.0) * depth_per_opacity(texel.a);
    more *= (1.0 - texel.a) * mean_transmittance_of_shallow(more * texel.a);
    return cued(texel * (is_there + is_there * more), depth);
#else
    return color_at_middle(texel, length * is_there, position, depth);
#endif
}
#endif

#if CLASSIFICATION == 3
// Two lines through three values: a quarter of one line's error where the value bends inside a slab. `step` goes from
// front to behind, and by `deep` in depth; the middle is at `position` and `depth`.
vec4 color_through(vec4 front, vec4 middle, vec4 behind, float length, vec3 position, vec3 step, float depth, float deep) {
    return over(color_between(front, middle, 0.5 * length, position - 0.25 * step, depth - 0.25 * deep),
                color_between(middle, behind, 0.5 * length, position + 0.25 * step, depth + 0.25 * deep));
}
#endif

// Colour and opacity of a slab from the share `front` of it to the share `back`.
vec4 part_of_slab(vec3 start, vec3 step, float slab, float front, float back, float whole_length) {
    float length = (back - front) * whole_length;
    float middle = slab + 0.5 * (front + back);
    vec3 position = start + middle * step;
#if CLASSIFICATION == 3
    return color_through(texel_at(start + (slab + front) * step), texel_at(position), texel_at(start + (slab + back) * step),
                         length, position, (back - front) * step, middle, back - front);
#else
    return color_at_middle(texel_at(position), length, position, middle);
#endif
}

#if CAPS
// What a ray meets where a half space cuts matter open: its colour, opaque, or nothing.
vec4 cap_color(vec3 start, vec3 step, float depth, float whole_length) {
    vec3 position = start + depth * step;
    vec4 texel = texel_at(position);
#if CLASSIFICATION == 3
    vec4 color = color_between(texel, texel, whole_length, position, depth);
#else
    vec4 color = color_at_middle(texel, whole_length, position, depth);
#endif
    return color.a > 0.0 ? vec4(color.rgb / color.a, 1.0) : vec4(0.0);
}
#endif

void main() {
    Ray ray = ray_through(gl_FragCoord.xy, slab_range);
    if (ray.slab >= ray.end) discard;
    float whole_length = ray.obliquity * slab_length;
    vec3 start = ray.start;
    vec3 step = ray.step;
    float slab = ray.slab;
    float end = ray.end;
    look_along(gl_FragCoord.xy - picture_middle);
    float samples = 0.0;
    // The slabs that the box cuts short: the first, and the last where that is another.
#if !CUT_IN_RUNS
    vec4 last_color = vec4(0.0);
    if (end > ray.last_slab && slab <= ray.last_slab && ray.last_slab > ray.first_slab) {
        last_color = part_of_slab(start, step, ray.last_slab, 0.0, ray.last_fraction, whole_length);
        samples += 1.0;
    }
#endif
    stack_color = vec4(0.0);
#if CAPS
    if (ray.is_cut_open && slab == ray.first_slab) {
        stack_color = cap_color(start, step, ray.first_slab + ray.first_fraction, whole_length);
        if (stack_color.a > 0.0) end = slab;
    }
#endif
#if !CUT_IN_RUNS
    if (slab == ray.first_slab && slab < end) {
        float back = ray.first_slab == ray.last_slab ? ray.last_fraction : 1.0;
        stack_color = part_of_slab(start, step, slab, ray.first_fraction, back, whole_length);
        samples += 1.0;
        slab += 1.0;
    }
    end = min(end, ray.last_slab);
#endif
    // The whole ones between them, in runs, until nothing behind them shows.
#if SKIPS
    CellWalk walk = cell_walk(start, step);
#if CUT_IN_RUNS
    float first_back = ray.first_slab == ray.last_slab ? ray.last_fraction : 1.0;
    vec2 sampled = vec2(ray.first_slab + 0.5 * (ray.first_fraction + first_back), ray.last_slab + 0.5 * ray.last_fraction);
    sampled.y = max(sampled.x, sampled.y);
#else
    vec2 sampled = vec2(slab, end);
#endif
#endif
    while (slab < end) {
        vec2 run = vec2(slab, end);
#if SKIPS && CLASSIFICATION == 3
        run = full_run(walk, slab, end);
        if (run.x == NOWHERE) break;
#elif SKIPS
        Runs runs;
        float known_until = skip(walk, ray.slab, slab, end, sampled, slabs_ahead, runs);
        run = take_run(runs, ray.slab);
#endif
        // Opacity at which a run may end; a slab at least is drawn.
        float enough = 2.0;
        if (least_transmittance > 0.0) enough = max(1.0 - least_transmittance / (1.0 - stack_color.a), 1e-7);
        vec4 run_color = vec4(0.0);
        float turns_end = samples + MOST_AT_ONCE;
        slab = run.x;
#if CLASSIFICATION == 3
        vec4 front = texel_at(start + slab * step);
#endif
        while (slab < end && samples < turns_end && run_color.a < enough) {
#if CLASSIFICATION == 3
            vec3 middle = start + (slab + 0.5) * step;
            vec4 behind = texel_at(start + (slab + 1.0) * step);
            vec4 color = color_through(front, texel_at(middle), behind, whole_length, middle, step, slab + 0.5, 1.0);
            run_color = over(run_color, color);
            front = behind;
            slab += 1.0;
            samples += 1.0;
            if (slab >= run.y) break;
#else
            // Several at a time, since the loop itself takes time; at the very end there may be fewer.
#if CUT_IN_RUNS
            float front = slab == ray.first_slab ? ray.first_fraction : 0.0;
            bSeveral are_last = equal(NUMBERS, Several(ray.last_slab - slab));
            Several backs = mix(Several(1.0), Several(ray.last_fraction), are_last);
            Several middles = (slab + NUMBERS) + 0.5 * backs;  // rounded as in `part_of_slab`
            middles.x = slab + 0.5 * (front + backs.x);
#else
            const float front = 0.0;
            const Several backs = Several(1.0);
            Several middles = slab + (NUMBERS + 0.5);
#endif
            Several there = mix(Several(0.0), backs, lessThan(NUMBERS, Several(end - slab)));
            there.x = backs.x - front;
            vec3 first_position = start + middles.x * step;
            vec3 second_position = start + middles.y * step;
            vec4 first_texel = texel_at(first_position);
            vec4 second_texel = texel_at(second_position);
#if AT_ONCE == 4
            vec3 third_position = start + middles.z * step;
            vec3 fourth_position = start + middles.w * step;
            vec4 third_texel = texel_at(third_position);
            vec4 fourth_texel = texel_at(fourth_position);
#endif
            run_color = over(run_color, slab_color_in_run(first_texel, whole_length, there.x, first_position, middles.x));
            run_color = over(run_color, slab_color_in_run(second_texel, whole_length, there.y, second_position, middles.y));
#if AT_ONCE == 4
            run_color = over(run_color, slab_color_in_run(third_texel, whole_length, there.z, third_position, middles.z));
            run_color = over(run_color, slab_color_in_run(fourth_texel, whole_length, there.w, fourth_position, middles.w));
#endif
            samples += min(end - slab, float(AT_ONCE));
            slab += float(AT_ONCE);
#if SKIPS
            // Neighbours in a vector of pixels don't wait for each other's runs.
            if (slab >= run.y) {
                known_until = max(known_until, slab);  // of several slabs at once the last may lie beyond
                run = take_run(runs, ray.slab);
                slab = max(slab, run.x);
            }
#endif
#endif
            if (slab >= end || samples >= turns_end || run_color.a >= enough) break;  // see leap.glsl
        }
        stack_color = over(stack_color, run_color);
        if (least_transmittance > 0.0 && 1.0 - stack_color.a <= least_transmittance) break;
#if SKIPS && CLASSIFICATION != 3
        if (slab >= ray.slab + NO_SLAB) slab = known_until;
#endif
        if (slab >= end) break;
    }
#if !CUT_IN_RUNS
    stack_color = over(stack_color, last_color);
#endif
    stack_color.rgb *= color_scale;
#if COUNT
    stack_color.r = samples;
#endif
}
