// Media that depend on the magnitude of the gradient; the formulas are in scene/transfer/graded.py.
//
// Switches: MODULATIONS n: number of ramps whose sum multiplies the medium of the control points.
//           GRADED n: number of pieces that are linear in the value, each times a ramp by magnitude.
//           CONTOURS n: number of isovalue contours (Levoy 1988).

#if MODULATIONS
uniform float modulation_base;
uniform vec3 modulations[MODULATIONS];   // what a ramp adds, where it starts, and 1 / its width
#endif
#if GRADED
uniform vec4 graded_starts[GRADED];      // emission and extinction at the start of a piece, and at its end
uniform vec4 graded_ends[GRADED];
uniform vec3 graded_positions[GRADED];   // values from and up to which a piece holds, and where its line starts
uniform vec3 graded_slopes[GRADED];      // 1 / width of the line; start and 1 / width of the ramp by magnitude
#endif
#if CONTOURS
uniform vec4 contour_media[CONTOURS];  // emission and extinction
// Value, distance to it that counts as none, and 1 / thickness in values per magnitude.
uniform vec3 contour_positions[CONTOURS];
#endif

// 0 up to `start`, 1 from the end of the ramp on, linear between them.
float ramp(float at, float start, float per_width) {
    return clamp((at - start) * per_width, 0.0, 1.0);
}

float magnitude_of(vec3 gradient) {
    return length(gradient);
}

// Factor of the medium of the control points at a magnitude of the gradient.
float modulation_of(float magnitude) {
    float factor = 1.0;
#if MODULATIONS
    factor = modulation_base;
    for (int i = 0; i < MODULATIONS; ++i) {
        factor += modulations[i].x * ramp(magnitude, modulations[i].y, modulations[i].z);
    }
    factor = max(factor, 0.0);
#endif
    return factor;
}

// Weight of a piece at a value: 0 beyond its ends, between them the ramp by magnitude.
float piece_weight(float value, float magnitude, vec3 position, vec3 slope) {
    return value >= position.x && value < position.y ? ramp(magnitude, slope.y, slope.z) : 0.0;
}

// Distance of a value from a contour, 1 where the contour ends.
float contour_distance(float value, float magnitude, vec3 position) {
    return max(abs(value - position.x) - position.y, 0.0) * position.z / max(magnitude, 1e-30);
}

// Emission and extinction of all that depends on value and gradient together.
vec4 graded_medium(float value, float magnitude) {
    vec4 medium = vec4(0.0);
#if GRADED
    // Pieces, not a sum of ramps: where there is nothing, a sum's rounding would leave 1e-7 of the densest.
    for (int i = 0; i < GRADED; ++i) {
        vec3 position = graded_positions[i];
        vec3 slope = graded_slopes[i];
        float weight = piece_weight(value, magnitude, position, slope);
        medium += weight * mix(graded_starts[i], graded_ends[i], ramp(value, position.z, slope.x));
    }
#endif
#if CONTOURS
    for (int i = 0; i < CONTOURS; ++i) {
        vec3 position = contour_positions[i];
        float away = contour_distance(value, magnitude, position);
        medium += contour_media[i] * max(1.0 - away, 0.0);
    }
#endif
    return medium;
}
