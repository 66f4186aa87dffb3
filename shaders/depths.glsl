// What of a ray is seen at all: in front of the eye, in all half spaces, between two surfaces.
//
// Depth along the view is counted in slab thicknesses from the middle of the (first) box, so that slab k lies between the
// planes k and k + 1 and a whole slab is exactly 1 deep. Positions are in a box's own coordinates, in which it is [0, 1]³.
//
// Switches: HALF_SPACES: how many there are outside of which nothing is seen.
//           STRETCH 1: only what lies between two places of each ray is seen, see surface.frag.

// Where a ray enters and leaves the box is worked out in double precision: in a medium of optical depth 400 across the
// box, float32's 1e-7 of the box would be 4e-5 of the picture at the silhouettes.
#include "precision.glsl"

flat uniform real eye_depth;           // nothing in front of the eye is seen
flat uniform vec2 picture_middle;      // pixels
#if HALF_SPACES
uniform real4 half_spaces[HALF_SPACES];  // what is kept has dot(xyz, position) + w >= 0, in the box
#endif
#if INTERVAL
uniform sampler2D near_positions;    // a depth, and what float32 leaves of it, in the middle components
uniform sampler2D far_positions;
#endif

// What of the depths `inside` is between two planes along one axis.
real2 depths_between_planes(real2 inside, real low, real high, real position, real direction) {
    if (abs(direction) < 1e-30) return position < low || position > high ? real2(1.0, -1.0) : inside;
    real a = (low - position) / direction;
    real b = (high - position) / direction;
    return real2(max(inside.x, min(a, b)), min(inside.y, max(a, b)));
}

// Depths at which the line position + depth * way enters and leaves the box from low to high; enters > leaves if it
// misses. Axis by axis in so many words: drivers keep what a loop has an index into in memory.
real2 depths_between(real3 low, real3 high, real3 position, real3 direction) {
    real2 inside = real2(-1e30, 1e30);
    inside = depths_between_planes(inside, low.x, high.x, position.x, direction.x);
    inside = depths_between_planes(inside, low.y, high.y, position.y, direction.y);
    return depths_between_planes(inside, low.z, high.z, position.z, direction.z);
}

#if HALF_SPACES
// What of the depths `inside` is in all half spaces.
real2 depths_kept(real2 inside, real3 position, real3 direction) {
    for (int i = 0; i < HALF_SPACES; ++i) {
        real height = dot(half_spaces[i].xyz, position) + half_spaces[i].w;
        real rise = dot(half_spaces[i].xyz, direction);
        real meets = -height / (abs(rise) < 1e-30 ? 1e-30 : rise);
        if (rise >= 1e-30) inside.x = max(inside.x, meets);
        else if (rise <= -1e-30) inside.y = min(inside.y, meets);
        else if (height < 0.0) inside = real2(1.0, -1.0);
    }
    return inside;
}
#endif

// What of the depths `inside` a box is seen of the ray through the pixel at `place`, in window coordinates.
real2 depths_seen(real2 inside, real3 position, real3 direction, vec2 fragment, out bool is_cut_open) {
    is_cut_open = false;
    inside.x = max(inside.x, eye_depth);
#if HALF_SPACES
    real uncut = inside.x;
    inside = depths_kept(inside, position, direction);
    is_cut_open = inside.x > uncut;
#endif
#if INTERVAL
    vec2 near = texelFetch(near_positions, ivec2(fragment), 0).yz;
    vec2 far = texelFetch(far_positions, ivec2(fragment), 0).yz;
    real from = real(near.x) + real(near.y);
    if (from > inside.x) is_cut_open = false;
    inside = real2(max(inside.x, from), min(inside.y, real(far.x) + real(far.y)));
#endif
    return inside;
}
