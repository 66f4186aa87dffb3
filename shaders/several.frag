#version 330
// One pixel's ray through several volumes at once: slab by slab, and piece by piece where it enters or leaves one of them,
// what they emit and how deep they are adds up, and the pieces are composited in registers, front to back.
//
// Depths are those of depths.glsl, counted from the middle of the first volume's box.
//
// Switches: VOLUMES: how many there are; those of matter.glsl and LEAPS are each one's own.
//           PERSPECTIVE, HALF_SPACES, STRETCH: see ray.glsl. CAPS 1: where half spaces cut matter open it is opaque.
//           HALVES 1: pieces are halves of slabs, on which values are taken to go linearly.
//           COUNT 1: red is how many slabs were sampled.

#include "depths.glsl"
#include "obliquity.glsl"
#include "optics.glsl"

#each VOLUMES
#include "box_walk.glsl"
#end

uniform float color_scale;        // brings the brightest emission near 1, for targets of few digits
uniform float least_transmittance;  // a ray that lets no more through is done; 0: none ever is

flat in vec2 slab_range;
out vec4 stack_color;             // premultiplied

const float BEYOND = 1e9;         // slabs
const float MOST_AT_ONCE = 64.0;  // slabs composited before they are put behind the others: sums of few keep digits

// Premultiplied colour and opacity of a piece of the ray.
vec4 color_of(vec4 glow) {
    float opacity = opacity_from_depth(glow.a);
    return vec4(glow.rgb * mean_transmittance(glow.a, opacity), opacity);
}

void main() {
    vec2 pixel = gl_FragCoord.xy - picture_middle;
    float obliquity = obliquity_of(pixel);
    bool is_cut;
    real2 seen = depths_seen(real2(-BEYOND, BEYOND), position_of_0(pixel), direction_of_0(pixel), gl_FragCoord.xy, is_cut);
    float first = BEYOND;
    float end = -BEYOND;
#each VOLUMES
    look_along(pixel);
    BoxWalk walk_@ = box_walk(pixel, obliquity, seen, is_cut);
    if (walk_@.last_slab >= walk_@.first_slab) {
        first = min(first, walk_@.first_slab);
        end = max(end, walk_@.last_slab + 1.0);
    }
#end
    float slab = max(first, slab_range.x);
    end = min(end, slab_range.y);
    if (slab >= end) discard;

    stack_color = vec4(0.0);
#if CAPS
    vec4 cap = vec4(0.0);
#each VOLUMES
    if (walk_@.is_cut_open && walk_@.first_slab == slab) cap += glow_at(walk_@, slab, walk_@.first_fraction);
#end
    if (cap.a > 0.0) {
        stack_color = vec4(cap.rgb / cap.a, 1.0);
        end = slab;
    }
#endif
#each VOLUMES
    vec2 run_@ = next_run(walk_@, slab);
#end
    float samples = 0.0;
    while (slab < end) {
        // Where something of any of them may show; how long nothing changes but what they are.
        float soonest = BEYOND;
        float calm_until = min(end, slab + MOST_AT_ONCE);
#each VOLUMES
        if (slab >= run_@.y) run_@ = next_run(walk_@, slab);
        soonest = min(soonest, max(run_@.x, slab));
#end
        if (soonest > slab) {
            slab = soonest;
            calm_until = slab;
        }
#each VOLUMES
        calm_until = min(calm_until, min(next_ragged(walk_@, slab), slab < run_@.x ? run_@.x : run_@.y));
#end
        float enough = 2.0;
        if (least_transmittance > 0.0) enough = max(1.0 - least_transmittance / (1.0 - stack_color.a), 1e-7);
        vec4 run_color = vec4(0.0);
        // A slab that a ray enters or leaves somewhere: piece by piece.
        bool is_ragged = calm_until == slab && soonest <= slab;
        float fraction = is_ragged && slab < end ? 0.0 : 1.0;
        if (is_ragged) samples += 1.0;
        while (fraction < 1.0) {
            float until = 1.0;
#if HALVES
            if (fraction < 0.5) until = 0.5;
#endif
            vec4 glow = vec4(0.0);
#each VOLUMES
            until = min(until, next_end(walk_@, slab, fraction));
#end
#each VOLUMES
            if (slab >= run_@.x && is_inside(walk_@, slab, fraction)) {
                vec4 front = texel_between(walk_@, slab, fraction);
                glow += glow_of_piece(walk_@, slab, fraction, until, front);
            }
#end
            run_color = over(run_color, color_of(glow));
            fraction = until;
            if (fraction >= 1.0) break;
        }
        if (is_ragged) slab += 1.0;
        // Whole slabs.
#each VOLUMES
        bool shows_@ = slab >= run_@.x && is_inside(walk_@, slab, 0.0);
        vec4 front_@ = texel_between(walk_@, slab, 0.0);
#end
        while (slab < calm_until && run_color.a < enough) {
#if HALVES
            vec4 front_half = vec4(0.0);
#each VOLUMES
            if (shows_@) front_half += glow_of_piece(walk_@, slab, 0.0, 0.5, front_@);
#end
            run_color = over(run_color, color_of(front_half));
#endif
            vec4 glow = vec4(0.0);
#each VOLUMES
            if (shows_@) glow += glow_of_piece(walk_@, slab, HALVES != 0 ? 0.5 : 0.0, 1.0, front_@);
#end
            run_color = over(run_color, color_of(glow));
            slab += 1.0;
            samples += 1.0;
            if (slab >= calm_until || run_color.a >= enough) break;  // see leap.glsl
        }
        stack_color = over(stack_color, run_color);
        if (slab >= end || (least_transmittance > 0.0 && 1.0 - stack_color.a <= least_transmittance)) break;
    }
    stack_color.rgb *= color_scale;
#if COUNT
    stack_color.r = samples;
#endif
}
