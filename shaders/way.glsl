// Where the ray through a pixel runs in a box; worked out in float64, and affine in the pixel.
//
// Switches: PERSPECTIVE 1: rays diverge, 0: they are parallel.

#include "depths.glsl"

flat uniform real3 point;              // where the ray of the middle pixel meets depth 0, in the box
flat uniform real3 point_per_column;
flat uniform real3 point_per_row;
flat uniform real3 velocity;           // way of that ray per unit of depth
#if PERSPECTIVE
flat uniform real3 velocity_per_column;
flat uniform real3 velocity_per_row;
#endif

// `pixel` counts from the middle of the picture.
real3 position_of(vec2 pixel) {
    return point + real(pixel.x) * point_per_column + real(pixel.y) * point_per_row;
}

real3 direction_of(vec2 pixel) {
#if PERSPECTIVE
    return velocity + real(pixel.x) * velocity_per_column + real(pixel.y) * velocity_per_row;
#else
    return velocity;
#endif
}
