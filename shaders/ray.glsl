// A pixel's ray: which slabs of the box it crosses, and how far it goes in the first and the last of them.
//
// Depths and positions are those of depths.glsl.
//
// Switches: BRICKS 1: the slabs whose middle lies in the brick are the ray's.
//           PERSPECTIVE: see way.glsl. HALF_SPACES, STRETCH: see depths.glsl.

#include "depths.glsl"
#include "way.glsl"
#include "obliquity.glsl"

#if BRICKS
uniform real3 brick_low;          // the brick's own part of the box; infinite where the box ends
uniform real3 brick_high;
#endif

struct Ray {
    vec3 start;                   // where it is at depth 0, in the box
    vec3 step;                    // its way through a slab
    float obliquity;              // length of the ray between two planes at distance 1
    float slab;                   // the first of its slabs, and the one after the last; none where it misses
    float end;
    // The first and the last slab that it crosses in the whole box, and the shares from which and up to which.
    float first_slab;
    float first_fraction;
    float last_slab;
    float last_fraction;
    bool is_cut_open;             // whether a half space, and neither box nor eye, is where it begins
};

// The ray through the middle of the pixel at `place`, in window coordinates, and its slabs among those of `slab_range`.
Ray ray_through(vec2 fragment, vec2 slab_range) {
    vec2 pixel = fragment - picture_middle;
    real3 position = position_of(pixel);
    real3 direction = direction_of(pixel);
    Ray ray;
    ray.obliquity = obliquity_of(pixel);
    ray.start = vec3(position);
    ray.step = vec3(direction);
    // A depth is a slab and a share of it, so that the share keeps float32's digits at any depth.
    real2 inside = depths_between(real3(0.0), real3(1.0), position, direction);
    inside = depths_seen(inside, position, direction, fragment, ray.is_cut_open);
    ray.first_slab = float(floor(inside.x));
    ray.first_fraction = float(inside.x - floor(inside.x));
    ray.last_slab = float(ceil(inside.y)) - 1.0;
    ray.last_fraction = float(inside.y - (ceil(inside.y) - 1.0));
    ray.slab = max(ray.first_slab, slab_range.x);
    ray.end = min(ray.last_slab + 1.0, slab_range.y);
#if BRICKS
    // Neighbours work out the same depth for the face that they share, and a slab's middle lies on one side of it.
    real2 own = depths_between(brick_low, brick_high, position, direction);
    float own_slab = float(ceil(own.x - 0.5));
    float own_end = float(ceil(own.y - 0.5));
    // Of the first only a part may be seen, and the middle of the whole may lie behind the eye.
    real first_middle = 0.5 * (inside.x + min(floor(inside.x) + 1.0, inside.y));
    if (own.x <= first_middle && first_middle < own.y) {
        own_slab = ray.first_slab;
        own_end = max(own_end, ray.first_slab + 1.0);
    } else {
        own_slab = max(own_slab, ray.first_slab + 1.0);
    }
    ray.slab = max(ray.slab, own_slab);
    ray.end = own.x > own.y ? ray.slab : min(ray.end, own_end);
#endif
    if (inside.x >= inside.y) ray.end = ray.slab;
    return ray;
}
