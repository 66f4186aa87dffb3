// How much longer a ray is between two planes across the view than these are apart.
//
// Switches: PERSPECTIVE 1: rays diverge, 0: they are parallel.

#if PERSPECTIVE
flat uniform float tangent_per_pixel;
#endif

// `pixel` counts from the middle of the picture.
float obliquity_of(vec2 pixel) {
#if PERSPECTIVE
    vec2 tangent = pixel * tangent_per_pixel;
    return sqrt(1.0 + dot(tangent, tangent));
#else
    return 1.0;
#endif
}
