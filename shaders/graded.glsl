// Matter that depends on the gradient; the formulas are in transfer/graded.py. `magnitude` is that of the gradient.
//
// Switches: MODULATIONS n: ramps of what the points are multiplied with.
//           GRADED n: pieces that are linear in the value, each times a ramp by magnitude.
//           CONTOURS n: Levoy's isovalue contours.

#if MODULATIONS
uniform float modulation_base;
uniform vec3 modulations[MODULATIONS];   // how much a ramp adds, where it starts, and 1 / its width
#endif
#if GRADED
uniform vec4 graded_starts[GRADED];      // emission and extinction at the start of a piece, and at its end
uniform vec4 graded_ends[GRADED];
uniform vec3 graded_positions[GRADED];      // from which value on it holds, up to which, and where its line starts
uniform vec3 graded_slopes[GRADED];      // 1 / width of that; start and 1 / width of the ramp by magnitude
#endif
#if CONTOURS
uniform vec4 contour_media[CONTOURS];  // emission and extinction
uniform vec3 contour_positions[CONTOURS];   // value, what is no distance to it, and 1 / thickness in values per magnitude
#endif

float ramp(float at, float start, float per_width) {
    return clamp((at - start) * per_width, 0.0, 1.0);
}

float magnitude_of(vec3 gradient) {
    return length(gradient);
}

#if MODULATIONS
float modulation_of(float magnitude) {
    float factor = modulation_base;
    for (int i = 0; i < MODULATIONS; ++i) {
        factor += modulations[i].x * ramp(magnitude, modulations[i].y, modulations[i].z);
    }
    return max(factor, 0.0);
}
#endif

#if GRADED || CONTOURS
// Emission and extinction of all that depends on value and gradient together.
vec4 graded_medium(float value, float magnitude) {
    vec4 medium = vec4(0.0);
#if GRADED
    // Pieces, not a sum of ramps: where there is nothing, a sum's rounding would leave 1e-7 of the densest.
    for (int i = 0; i < GRADED; ++i) {
        vec3 position = graded_positions[i];
        vec3 slope = graded_slopes[i];
        float weight = value >= position.x && value < position.y ? ramp(magnitude, slope.y, slope.z) : 0.0;
        medium += weight * mix(graded_starts[i], graded_ends[i], ramp(value, position.z, slope.x));
    }
#endif
#if CONTOURS
    for (int i = 0; i < CONTOURS; ++i) {
        vec3 position = contour_positions[i];
        float away = max(abs(value - position.x) - position.y, 0.0) * position.z / max(magnitude, 1e-30);
        medium += contour_media[i] * max(1.0 - away, 0.0);
    }
#endif
    return medium;
}
#endif
