// The ray through a pixel in the coordinates of a box: an affine function of the pixel.
//
// Switches: PERSPECTIVE 1: rays diverge, 0: they are parallel.

#include "ray.glsl"

flat uniform real3 point;              // position of the middle pixel's ray at depth 0, in the box
flat uniform real3 point_per_column;
flat uniform real3 point_per_row;
flat uniform real3 velocity;           // change of that ray's position per unit of depth
#if PERSPECTIVE
flat uniform real3 velocity_per_column;
flat uniform real3 velocity_per_row;
#endif

// Ray through `pixel`, which is counted from the middle of the picture.
Ray pixel_ray(vec2 pixel) {
    Ray ray;
    ray.position = point + real(pixel.x) * point_per_column + real(pixel.y) * point_per_row;
#if PERSPECTIVE
    ray.direction = velocity + real(pixel.x) * velocity_per_column + real(pixel.y) * velocity_per_row;
#else
    ray.direction = velocity;
#endif
    return ray;
}
