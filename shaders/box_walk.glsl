// One of several volumes on a pixel's ray: where the ray is in its box, and what a piece of the ray meets there.
//
// Depths are those of depths.glsl, the same for all volumes: their slabs have one phase.
//
// Switches: CLASSIFICATION: see matter.glsl; 0 does not occur, since opacities don't add up.
//           LEAPS 1: what `leaps` shows to be empty is leapt over.
//           FACES 1: every sample fills a box of its own, and pieces end where the ray leaves one.
//           BRICKS 1: the texture is a part of the volume, and what lies in that is drawn.

#include "depths.glsl"
#include "matter.glsl"
#include "way.glsl"
#if SKIPS
#include "leap.glsl"
#else
const float NOWHERE = 1e9;
#endif

#if BRICKS
uniform real3 brick_low;          // the brick's own part of the box; infinite where the box ends
uniform real3 brick_high;
#endif
#if FACES
uniform vec3 samples_per_edge;    // of the box
const float LEAST_PIECE = 1e-5;   // of a slab: less than float32 knows of where a face is met
#endif

// Each depth is a slab and a share of it, so that the share keeps float32's digits at any depth.
struct BoxWalk {
    vec3 start;                   // where the ray is at depth 0, in the box
    vec3 step;                    // its way through a slab
    float whole_length;           // of a slab on the ray, in the unit of `slab_length`
    float first_slab;             // where it enters what is seen of the box
    float first_fraction;
    float last_slab;              // where it leaves that; far before it enters where it misses it
    float last_fraction;
    bool is_cut_open;             // whether a half space, and neither box nor eye, is where it begins
};

// The ray of a pixel, counted from the middle of the picture, of which the depths `seen` are seen; `is_cut` says whether
// a half space is where these begin.
BoxWalk box_walk(vec2 pixel, float obliquity, real2 seen, bool is_cut) {
    real3 position = position_of(pixel);
    real3 direction = direction_of(pixel);
    real2 inside = depths_between(real3(0.0), real3(1.0), position, direction);
    BoxWalk walk;
    walk.is_cut_open = is_cut && seen.x > inside.x;
    inside = real2(max(inside.x, seen.x), min(inside.y, seen.y));
#if BRICKS
    // Neighbours work out the same depth for the face that they share.
    real2 own = depths_between(brick_low, brick_high, position, direction);
    walk.is_cut_open = walk.is_cut_open && own.x <= inside.x;
    inside = real2(max(inside.x, own.x), min(inside.y, own.y));
#endif
    walk.start = vec3(position);
    walk.step = vec3(direction);
    walk.whole_length = obliquity * slab_length;
    walk.first_slab = float(floor(inside.x));
    walk.first_fraction = float(inside.x - floor(inside.x));
    walk.last_slab = float(ceil(inside.y)) - 1.0;
    walk.last_fraction = float(inside.y - (ceil(inside.y) - 1.0));
    if (inside.x >= inside.y) {
        walk.first_slab = 1e9;
        walk.last_slab = -1e9;
    }
    return walk;
}

// Whether the ray is inside from the share of a slab on.
bool is_inside(BoxWalk walk, float slab, float fraction) {
    bool has_entered = slab > walk.first_slab || (slab == walk.first_slab && fraction >= walk.first_fraction);
    return has_entered && (slab < walk.last_slab || (slab == walk.last_slab && fraction < walk.last_fraction));
}

// The first slab from this one on that the ray enters or leaves in the middle, or with which it begins to be inside.
float next_ragged(BoxWalk walk, float slab) {
#if FACES
    if (slab >= walk.first_slab && slab <= walk.last_slab) return slab;
#endif
    float entered = walk.first_slab + (walk.first_fraction > 0.0 || walk.first_slab > slab ? 0.0 : 1e9);
    float left = walk.last_slab + (walk.last_fraction < 1.0 ? 0.0 : 1.0);
    return min(entered >= slab ? entered : 1e9, left >= slab ? left : 1e9);
}

// The next share of a slab behind `share` at which the ray enters or leaves; 1 at the most.
float next_end(BoxWalk walk, float slab, float fraction) {
    float until = 1.0;
    if (slab == walk.first_slab && walk.first_fraction > fraction) until = walk.first_fraction;
    if (slab == walk.last_slab && walk.last_fraction > fraction) until = min(until, walk.last_fraction);
#if FACES
    vec3 direction = walk.step * samples_per_edge;
    vec3 position = (walk.start + slab * walk.step) * samples_per_edge;
    vec3 from = position + (fraction + LEAST_PIECE) * direction;
    vec3 faces = mix(ceil(from) - 1.0, floor(from) + 1.0, greaterThan(direction, vec3(0.0)));
    vec3 fractions = (faces - position) / mix(direction, vec3(1e-30), lessThan(abs(direction), vec3(1e-30)));
    fractions = mix(fractions, vec3(1.0), lessThan(abs(direction), vec3(1e-30)));
    until = min(until, max(min(fractions.x, min(fractions.y, fractions.z)), fraction + LEAST_PIECE));
#endif
    return until;
}

#if CLASSIFICATION == 1
vec4 glow_there(vec4 texel, vec3 position, float length) {
    return texel * held_scale * length;
}
#elif CLASSIFICATION == 2
vec4 glow_there(vec4 texel, vec3 position, float length) {
    vec4 medium = medium_of(texel, position);
    if (!GLOWS) medium.rgb *= medium.a;
#if WEIGHTS
    length *= weight_at(position);
#endif
    // Of several that are opaque in one place none is more so than another.
    if (medium.a >= OPAQUE && length > 0.0) length = 1.0;
    return medium * length;
}
#else
vec4 glow_between(vec4 front, vec4 behind, float length, vec3 position, float depth) {
    path_depth = 0.0;
    vec4 color = color_between(front, behind, length, position, depth);
    // As if nothing of it were absorbed on the piece itself.
    float seen = path_depth > 0.0 ? color.a / path_depth : 1.0;
    return vec4(color.rgb / max(seen, 1e-30), path_depth);
}
#endif

// What is at a share of a slab, where that is asked for once for the piece behind it as well as for the one in front.
vec4 texel_between(BoxWalk walk, float slab, float fraction) {
#if CLASSIFICATION == 3
    return texel_at(walk.start + (slab + fraction) * walk.step);
#else
    return vec4(0.0);
#endif
}

// What matter emits on the piece of a slab from share to share, as if it absorbed nothing, and how deep it is: where
// volumes overlap, these add up. `front` is `texel_between` at the first, and becomes that at the second.
vec4 glow_of_piece(BoxWalk walk, float slab, float from, float to, inout vec4 front) {
    float length = (to - from) * walk.whole_length;
    float middle = slab + 0.5 * (from + to);
    vec3 position = walk.start + middle * walk.step;
#if CLASSIFICATION == 3
    vec4 behind = texel_between(walk, slab, to);
    vec4 glow = glow_between(front, behind, length, position, middle);
    front = behind;
    return glow;
#else
    return cued(glow_there(texel_at(position), position, length), middle);
#endif
}

// The same for the matter at one place, over the length of a slab.
vec4 glow_at(BoxWalk walk, float slab, float fraction) {
    vec3 position = walk.start + (slab + fraction) * walk.step;
    vec4 texel = texel_at(position);
#if CLASSIFICATION == 3
    return glow_between(texel, texel, walk.whole_length, position, slab + fraction);
#else
    return cued(glow_there(texel, position, walk.whole_length), slab + fraction);
#endif
}

// The slabs from `slab` on in which something may show, up to the next empty one: the first and the one after the last.
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
