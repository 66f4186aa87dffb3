// The slabs of a box that a ray crosses.

#include "visible.glsl"

// A depth is a slab and a fraction of it, so that the fraction keeps float32's digits at any depth.
struct BoxWalk {
    vec3 start;                   // position of the ray at depth 0, in the box
    vec3 step;                    // change of position per slab
    float path_length;            // of the ray through a whole slab
    real2 interval;               // of depths at which the box is seen
    float first_slab;             // NOWHERE where the ray misses what is seen of the box
    float first_fraction;         // of the first slab, at which the interval begins
    float last_slab;              // -NOWHERE where the ray misses
    float last_fraction;          // of the last slab, at which the interval ends
    bool is_cut_open;             // true if the interval begins at a half space, and not at the box or the eye
};

// Slabs that a ray crosses in an interval of depths; a whole slab is `path_length` long on the ray.
BoxWalk walk_through(Ray ray, real2 interval, float path_length) {
    BoxWalk walk;
    walk.start = vec3(ray.position);
    walk.step = vec3(ray.direction);
    walk.path_length = path_length;
    walk.interval = interval;
    walk.first_slab = float(floor(interval.x));
    walk.first_fraction = float(interval.x - floor(interval.x));
    walk.last_slab = float(ceil(interval.y)) - 1.0;
    walk.last_fraction = float(interval.y - (ceil(interval.y) - 1.0));
    if (interval.x >= interval.y) {
        walk.first_slab = NOWHERE;
        walk.last_slab = -NOWHERE;
    }
    walk.is_cut_open = false;
    return walk;
}

// Slabs of the box that a ray crosses in what is visible of it.
BoxWalk box_walk(Ray ray, Visible visible, float path_length) {
    real2 box = box_interval(ray, real3(0.0), real3(1.0));
    real2 interval = real2(max(box.x, visible.interval.x), min(box.y, visible.interval.y));
    BoxWalk walk = walk_through(ray, interval, path_length);
    walk.is_cut_open = visible.is_cut && visible.interval.x > box.x;
    return walk;
}

// True if the ray is in the walk's interval from a fraction of a slab on.
bool is_inside(BoxWalk walk, float slab, float fraction) {
    bool has_entered = slab > walk.first_slab || (slab == walk.first_slab && fraction >= walk.first_fraction);
    return has_entered && (slab < walk.last_slab || (slab == walk.last_slab && fraction < walk.last_fraction));
}

// Position on the ray at a depth.
vec3 walk_position(BoxWalk walk, float depth) {
    return walk.start + depth * walk.step;
}

// Fraction of a slab at which the ray enters it, and at which the ray leaves it.
vec2 slab_ends(BoxWalk walk, float slab) {
    float front = slab == walk.first_slab ? walk.first_fraction : 0.0;
    float back = slab == walk.last_slab ? walk.last_fraction : 1.0;
    return vec2(front, back);
}
