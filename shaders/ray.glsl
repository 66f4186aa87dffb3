// A ray in the coordinates of a box, which is [0, 1]³ in them, and the depths at which the ray is inside of a box.
//
// Depth is counted along the view in slab thicknesses from the middle of the (first) box: slab k lies between the
// planes at depth k and k + 1. An interval of depths is (front, back), and is empty where front > back.

// Double precision: in a medium of optical depth 400 across the box, float32's error of 1e-7 of the box would change a
// picture by 4e-5 at the silhouettes.
#include "precision.glsl"

const float NOWHERE = 1e9;        // a slab behind all that any ray crosses

struct Ray {
    real3 position;               // at depth 0
    real3 direction;              // change of position per unit of depth
};

// Position on a ray at some depth.
real3 position_at(Ray ray, real depth) {
    return ray.position + depth * ray.direction;
}

// Part of an interval in which a coordinate that is `position` at depth 0 and changes by `direction` per unit of
// depth is from `low` to `high`.
real2 interval_between(real2 interval, real low, real high, real position, real direction) {
    if (abs(direction) < 1e-30) return position < low || position > high ? real2(1.0, -1.0) : interval;
    real a = (low - position) / direction;
    real b = (high - position) / direction;
    return real2(max(interval.x, min(a, b)), min(interval.y, max(a, b)));
}

// Interval of depths at which a ray is in the box from `low` to `high`. Axis by axis without a loop: drivers keep in
// memory what a loop has an index into.
real2 box_interval(Ray ray, real3 low, real3 high) {
    real2 interval = real2(-1e30, 1e30);
    interval = interval_between(interval, low.x, high.x, ray.position.x, ray.direction.x);
    interval = interval_between(interval, low.y, high.y, ray.position.y, ray.direction.y);
    return interval_between(interval, low.z, high.z, ray.position.z, ray.direction.z);
}
