// One of several volumes on a pixel's ray: the slabs of its box that the ray crosses, and the glow of a piece of the
// ray there.
//
// Glow is what a piece of the ray emits as if it absorbed nothing, and its optical depth: where volumes overlap,
// glows add up.
//
// Switches: CLASSIFICATION: see medium.glsl; 0 does not occur, since opacities do not add up.
//           SKIPS 1: slabs that `skips` shows to be empty are skipped.
//           FACES 1: every sample fills a box of its own, and pieces end where the ray leaves one.
//           BRICKS 1: the texture is a part of the volume, and what lies in that part is drawn.

#include "box_walk.glsl"
#include "medium.glsl"
#include "pixel_ray.glsl"
#if SKIPS
#include "skip.glsl"
#endif

#if FACES
uniform vec3 samples_per_edge;    // of the box
const float LEAST_PIECE = 1e-5;   // of a slab: less than float32 knows of where a face is met
#endif

// Slabs of the volume's box that are visible on the ray of `pixel`, which is counted from the middle of the picture.
BoxWalk volume_walk(vec2 pixel, Visible visible, float obliquity) {
    Ray ray = pixel_ray(pixel);
    BoxWalk walk = box_walk(ray, visible, obliquity * slab_length);
#if BRICKS
    real2 own = brick_interval(ray);
    real2 interval = real2(max(walk.interval.x, own.x), min(walk.interval.y, own.y));
    bool is_cut_open = walk.is_cut_open && own.x <= walk.interval.x;
    walk = walk_through(ray, interval, walk.path_length);
    walk.is_cut_open = is_cut_open;
#endif
    return walk;
}

// The first slab from `slab` on that the ray enters or leaves in its middle, or with which the ray begins to be inside.
float next_ragged(BoxWalk walk, float slab) {
#if FACES
    if (slab >= walk.first_slab && slab <= walk.last_slab) return slab;
#endif
    float entered = walk.first_slab + (walk.first_fraction > 0.0 || walk.first_slab > slab ? 0.0 : NOWHERE);
    float left = walk.last_slab + (walk.last_fraction < 1.0 ? 0.0 : 1.0);
    return min(entered >= slab ? entered : NOWHERE, left >= slab ? left : NOWHERE);
}

// The next fraction of a slab behind `fraction` at which the ray enters or leaves; 1 at the most.
float next_end(BoxWalk walk, float slab, float fraction) {
    float until = 1.0;
    if (slab == walk.first_slab && walk.first_fraction > fraction) until = walk.first_fraction;
    if (slab == walk.last_slab && walk.last_fraction > fraction) until = min(until, walk.last_fraction);
#if FACES
    if (slab < walk.first_slab || slab > walk.last_slab) return until;
    vec3 direction = walk.step * samples_per_edge;
    vec3 position = (walk.start + slab * walk.step) * samples_per_edge;
    vec3 from = position + (fraction + LEAST_PIECE) * direction;
    vec3 faces = mix(ceil(from) - 1.0, floor(from) + 1.0, greaterThan(direction, vec3(0.0)));
    bvec3 is_parallel = lessThan(abs(direction), vec3(1e-30));
    vec3 fractions = (faces - position) / mix(direction, vec3(1e-30), is_parallel);
    fractions = mix(fractions, vec3(1.0), is_parallel);
    until = min(until, max(min(fractions.x, min(fractions.y, fractions.z)), fraction + LEAST_PIECE));
#endif
    return until;
}

#if CLASSIFICATION == 1
// Glow of a path in the medium of a texel.
vec4 glow_of(vec4 texel, vec3 position, float length) {
    return texel * held_scale * length;
}
#elif CLASSIFICATION == 2
vec4 glow_of(vec4 texel, vec3 position, float length) {
    vec4 medium = medium_of(texel, position);
    if (!GLOWS) medium.rgb *= medium.a;
    length *= weight_at(position);
    // Of several media that are opaque at one position none is more opaque than another.
    if (medium.a >= OPAQUE && length > 0.0) length = 1.0;
    return medium * length;
}
#else
// Glow of a path between two texels.
vec4 glow_between(vec4 front, vec4 behind, float length, vec3 position, float depth) {
    crossed_depth = 0.0;
    Place place = place_of(front);
    vec4 color = over_half(vec4(0.0), place, behind, length, position, depth);
    // As if nothing of it were absorbed on the piece itself.
    float seen = crossed_depth > 0.0 ? color.a / crossed_depth : 1.0;
    return vec4(color.rgb / max(seen, 1e-30), crossed_depth);
}
#endif

// Texel at a fraction of a slab where it is needed for the pieces on both sides of it; 0 for the other classifications.
vec4 texel_between(BoxWalk walk, float slab, float fraction) {
#if CLASSIFICATION == 3
    return texel_at(walk_position(walk, slab + fraction));
#else
    return vec4(0.0);
#endif
}

// Glow of the piece of a slab from one fraction to another. `front` is `texel_between` at the first, and becomes
// that at the second.
vec4 glow_of_piece(BoxWalk walk, float slab, float from, float to, inout vec4 front) {
    float length = (to - from) * walk.path_length;
    float middle = slab + 0.5 * (from + to);
    vec3 position = walk_position(walk, middle);
#if CLASSIFICATION == 3
    vec4 behind = texel_between(walk, slab, to);
    vec4 glow = glow_between(front, behind, length, position, middle);
    front = behind;
    return glow;
#else
    return cued(glow_of(texel_at(position), position, length), middle);
#endif
}

// Glow of a path as long as through a whole slab, in the medium at a depth.
vec4 glow_at(BoxWalk walk, float depth) {
    vec3 position = walk_position(walk, depth);
    vec4 texel = texel_at(position);
#if CLASSIFICATION == 3
    return glow_between(texel, texel, walk.path_length, position, depth);
#else
    return cued(glow_of(texel, position, walk.path_length), depth);
#endif
}

// The slabs from `slab` on in which a medium may show, up to the next empty one: the first and the one after the last.
vec2 next_run(BoxWalk walk, float slab) {
    float end = walk.last_slab + 1.0;
    slab = max(slab, walk.first_slab);
    if (slab >= end) return vec2(NOWHERE);
#if SKIPS
    return full_run(cell_walk(walk.start, walk.step), slab, end);
#else
    return vec2(slab, end);
#endif
}
