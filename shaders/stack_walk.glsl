// The slabs of a volume that a pixel's ray crosses, and which of them a polygon draws.
//
// Switches: BRICKS 1: slabs are drawn whose middle lies in the brick's own part of the box.
//           PERSPECTIVE: see pixel_ray.glsl. HALF_SPACES, INTERVAL: see visible.glsl.

#include "pixel_ray.glsl"
#include "box_walk.glsl"
#include "obliquity.glsl"
#include "brick.glsl"

#if BRICKS
// First slab on a ray whose middle lies in the brick's own part, and the slab behind the last one. The first is not
// before the second where there is none.
vec2 slabs_of_brick(BoxWalk walk, Ray ray) {
    // The middle of a slab lies on one side of a face that neighbours share.
    real2 own = brick_interval(ray);
    vec2 slabs = vec2(float(ceil(own.x - 0.5)), float(ceil(own.y - 0.5)));
    // Only a part of the first slab may be seen, and the middle of the whole slab may lie behind the eye.
    real2 seen = walk.interval;
    real first_middle = 0.5 * (seen.x + min(floor(seen.x) + 1.0, seen.y));
    if (own.x <= first_middle && first_middle < own.y) {
        slabs = vec2(walk.first_slab, max(slabs.y, walk.first_slab + 1.0));
    } else {
        slabs.x = max(slabs.x, walk.first_slab + 1.0);
    }
    if (own.x > own.y) slabs.y = slabs.x;
    return slabs;
}
#endif

// First slab that is drawn on a ray by a polygon and brick, and the slab behind the last one: `stack` are the slabs
// of the polygon. The first is not before the second where there is none.
vec2 drawn_slabs(BoxWalk walk, Ray ray, vec2 stack) {
    vec2 slabs = vec2(max(walk.first_slab, stack.x), min(walk.last_slab + 1.0, stack.y));
#if BRICKS
    vec2 own_slabs = slabs_of_brick(walk, ray);
    slabs = vec2(max(slabs.x, own_slabs.x), min(slabs.y, own_slabs.y));
#endif
    return slabs;
}

// Slabs of the box on the ray through the pixel at a position in the window, and in `drawn` the slabs of those that
// are drawn. Path lengths are in the unit of the slab's thickness.
BoxWalk stack_walk(vec2 window_position, vec2 stack, float thickness, out vec2 drawn) {
    vec2 pixel = pixel_at(window_position);
    Ray ray = pixel_ray(pixel);
    BoxWalk walk = box_walk(ray, visible_depths(ray, window_position), obliquity_of(pixel) * thickness);
    drawn = drawn_slabs(walk, ray, stack);
    return walk;
}

// Depths at which the slabs that are drawn begin and end, for what lies anywhere in a slab: next to the slabs of another
// brick they do so a little behind the plane between slabs. Samples lie there in regular grids, and so may surfaces
// between two values; the textures of two bricks, rounded in different ways, could put such a surface on either side.
vec2 drawn_depths(BoxWalk walk, vec2 window_position, vec2 drawn) {
#if BRICKS
    const float BEHIND = 0.0041;
    vec2 own = slabs_of_brick(walk, pixel_ray(pixel_at(window_position)));
    if (drawn.x == own.x && own.x > walk.first_slab) drawn.x += BEHIND;
    if (drawn.y == own.y && own.y <= walk.last_slab) drawn.y += BEHIND;
#endif
    return drawn;
}
