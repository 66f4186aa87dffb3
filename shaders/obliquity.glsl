// Length of a ray between two planes across the view, relative to their distance.
//
// Switches: PERSPECTIVE 1: rays diverge, 0: they are parallel.

#if PERSPECTIVE
flat uniform float tangent_per_pixel;
#endif

// Obliquity of the ray through `pixel`, which is counted from the middle of the picture: at least 1.
float obliquity_of(vec2 pixel) {
#if PERSPECTIVE
    vec2 tangent = pixel * tangent_per_pixel;
    return sqrt(1.0 + dot(tangent, tangent));
#else
    return 1.0;
#endif
}
