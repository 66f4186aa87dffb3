// Colour and opacity of a stack of slabs on a pixel's ray through several volumes: slab by slab, and piece by piece
// where the ray enters or leaves one of them, emissions and optical depths add up, and the pieces are composited in
// registers, front to back. Depth 0 is in the middle of the first volume's box.
//
// A single volume is drawn by this program only where it has labels, which pieces end at. Others are drawn by
// slab_stack.glsl: slab-integrated opacities do not add up, so that this program cannot draw them; and it would take 1.2
// to 1.7 times as long to classify after interpolation, and 1.1 to 1.2 times as long to integrate (Mesa's software driver).
//
// Switches: VOLUMES: how many there are; those of volume_walk.glsl are each one's own.
//           PERSPECTIVE, HALF_SPACES, INTERVAL: see visible.glsl. COUNT: see compositing.glsl.
//           CAPS 1: where half spaces cut a medium open it is opaque.
//           BLOCK 1: slabs are drawn whose middles lie in a block, a part of a frame's box.
//           HALVES 1: pieces are halves of slabs, on which values are taken to be linear.

#include "box_walk.glsl"
#include "obliquity.glsl"
#include "compositing.glsl"

#each VOLUMES
#include "volume_walk.glsl"
#end

// Of each volume: the slabs that the ray crosses; those from the next on in which it may show; and, for the slab
// that is drawn, whether it does and the texel at its front.
#each VOLUMES
BoxWalk walk_@;
vec2 run_@;
bool shows_@;
vec4 front_@;
#end

#if BLOCK
#include "pixel_ray.glsl"
uniform real3 block_low;          // in the box of the frame, whose rays have no number
uniform real3 block_high;

// Those of some slabs whose middles lie in the block: neighbours compute the same depth for a face that they share.
vec2 slabs_in_block(vec2 slabs, vec2 window_position) {
    real2 own = box_interval(pixel_ray(pixel_at(window_position)), block_low, block_high);
    if (own.x > own.y) return vec2(NOWHERE, -NOWHERE);
    return vec2(max(slabs.x, float(ceil(own.x - 0.5))), min(slabs.y, float(ceil(own.y - 0.5))));
}
#else
vec2 slabs_in_block(vec2 slabs, vec2 window_position) {
    return slabs;
}
#endif

// Premultiplied colour and opacity of a piece of the ray that glows.
vec4 color_of(vec4 glow) {
    float opacity = opacity_from_depth(glow.a);
    return vec4(glow.rgb * mean_transmittance(glow.a, opacity), opacity);
}

// Set the walk of each volume; return the first slab that the ray crosses in any of them, and the slab behind the
// last one.
vec2 walk_volumes(vec2 window_position) {
    vec2 pixel = pixel_at(window_position);
    float obliquity = obliquity_of(pixel);
    Visible visible = visible_depths(pixel_ray_0(pixel), window_position);
    vec2 slabs = vec2(NOWHERE, -NOWHERE);
#each VOLUMES
    prepare_medium(pixel);
    walk_@ = volume_walk(pixel, visible, obliquity);
    slabs = vec2(min(slabs.x, walk_@.first_slab), max(slabs.y, walk_@.last_slab + 1.0));
#end
    return slabs;
}

// Where a half space cuts media open with the slab: their colour, opaque; or else 0.
vec4 cap_color(float slab) {
    vec4 glow = vec4(0.0);
#each VOLUMES
    if (walk_@.is_cut_open && walk_@.first_slab == slab) glow += glow_at(walk_@, slab + walk_@.first_fraction);
#end
    return glow.a > 0.0 ? vec4(glow.rgb / glow.a, 1.0) : vec4(0.0);
}

// The first slab from `slab` on in which any volume may show; the run of each is that which ends behind `slab`.
float next_shown(float slab) {
    float next = NOWHERE;
#each VOLUMES
    if (slab >= run_@.y) run_@ = next_run(walk_@, slab);
    next = min(next, max(run_@.x, slab));
#end
    return next;
}

// The first slab from `slab` on, up to `most`, in which a volume begins or ceases to show, or which the ray enters
// or leaves.
float next_change(float slab, float most) {
    float next = most;
#each VOLUMES
    next = min(next, min(next_ragged(walk_@, slab), slab < run_@.x ? run_@.x : run_@.y));
#end
    return next;
}

// The next fraction of a slab behind `fraction` at which a piece ends.
float next_piece(float slab, float fraction) {
    float until = HALVES != 0 && fraction < 0.5 ? 0.5 : 1.0;
#each VOLUMES
    until = min(until, next_end(walk_@, slab, fraction));
#end
    return until;
}

// Glow of all volumes on the piece of a slab from one fraction to another.
vec4 glow_of_pieces(float slab, float from, float to) {
    vec4 glow = vec4(0.0);
#each VOLUMES
    if (slab >= run_@.x && is_inside(walk_@, slab, from)) {
        vec4 front = texel_between(walk_@, slab, from);
        glow += glow_of_piece(walk_@, slab, from, to, front);
    }
#end
    return glow;
}

// Colour and opacity of a slab from a fraction of it on, piece by piece.
vec4 ragged_color(float slab, float fraction) {
    vec4 color = vec4(0.0);
    while (fraction < 1.0) {
        float until = next_piece(slab, fraction);
        color = over(color, color_of(glow_of_pieces(slab, fraction, until)));
        fraction = until;
        if (fraction >= 1.0) break;
    }
    return color;
}

// Set whether each volume shows in the slabs from `slab` on, and its texel at the front of that slab.
void enter_whole_slabs(float slab) {
#each VOLUMES
    shows_@ = slab >= run_@.x && is_inside(walk_@, slab, 0.0);
    front_@ = texel_between(walk_@, slab, 0.0);
#end
}

// Glow of the volumes that show on the part of a whole slab from one fraction to another.
vec4 glow_of_whole(float slab, float from, float to) {
    vec4 glow = vec4(0.0);
#each VOLUMES
    if (shows_@) glow += glow_of_piece(walk_@, slab, from, to, front_@);
#end
    return glow;
}

// `color` over the whole slabs from `slab` on, up to `until` or until they are `enough`; `slab` and `samples` go on
// behind.
vec4 over_whole_slabs(vec4 color, inout float slab, inout float samples, float until, float enough) {
    enter_whole_slabs(slab);
    while (slab < until && color.a < enough) {
        if (HALVES != 0) color = over(color, color_of(glow_of_whole(slab, 0.0, 0.5)));
        color = over(color, color_of(glow_of_whole(slab, HALVES != 0 ? 0.5 : 0.0, 1.0)));
        slab += 1.0;
        samples += 1.0;
        if (slab >= until || color.a >= enough) break;
    }
    return color;
}

// Colour and opacity of the slabs of a polygon at a position in the window; false if there are none.
bool draw_stack(vec2 window_position, vec2 slab_range, out vec4 stack_color) {
    vec2 slabs = slabs_in_block(walk_volumes(window_position), window_position);
    stack_color = vec4(0.0);
    float slab = max(slabs.x, slab_range.x);
    float end = min(slabs.y, slab_range.y);
    if (slab >= end) return false;
    vec4 color = vec4(0.0);
    if (CAPS != 0) {
        color = cap_color(slab);
        if (color.a > 0.0) end = slab;
    }
#each VOLUMES
    run_@ = next_run(walk_@, slab);
#end
    float samples = 0.0;
    while (slab < end) {
        float soonest = next_shown(slab);
        float calm_until = min(end, slab + MOST_AT_ONCE);
        if (soonest > slab) slab = calm_until = soonest;
        calm_until = next_change(slab, calm_until);
        // A slab that a ray enters or leaves somewhere is drawn piece by piece.
        bool is_ragged = calm_until == slab && soonest <= slab;
        vec4 run_color = ragged_color(slab, is_ragged && slab < end ? 0.0 : 1.0);
        float enough = sufficient_opacity(color.a);
        if (is_ragged) {
            samples += 1.0;
            slab += 1.0;
        }
        run_color = over_whole_slabs(run_color, slab, samples, calm_until, enough);
        color = over(color, run_color);
        if (slab >= end || is_finished(color.a)) break;
    }
    stack_color = target_color(color, samples);
    return true;
}
