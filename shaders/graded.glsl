// Matter that depends on the gradient; the formulas are in transfer/graded.py. `magnitude` is that of the gradient.
//
// Switches: MODULATIONS n: ramps of what the points are multiplied with.
//           GRADED n: ramps by value, each times one by magnitude. CONTOURS n: Levoy's isovalue contours.

#if MODULATIONS
uniform float modulation_base;
uniform vec3 modulations[MODULATIONS];   // how much a ramp adds, where it starts, and 1 / its width
#endif
#if GRADED
uniform vec4 graded_rises[GRADED];       // emission and extinction
uniform vec4 graded_places[GRADED];      // by value: start and 1 / width; by magnitude: likewise
#endif
#if CONTOURS
uniform vec4 contour_matters[CONTOURS];  // emission and extinction
uniform vec2 contour_places[CONTOURS];   // value, and 1 / thickness in values per magnitude
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
vec4 graded_matter(float value, float magnitude) {
    vec4 matter = vec4(0.0);
#if GRADED
    for (int i = 0; i < GRADED; ++i) {
        vec4 place = graded_places[i];
        matter += graded_rises[i] * (ramp(value, place.x, place.y) * ramp(magnitude, place.z, place.w));
    }
    matter = max(matter, 0.0);
#endif
#if CONTOURS
    for (int i = 0; i < CONTOURS; ++i) {
        float away = abs(value - contour_places[i].x) * contour_places[i].y / max(magnitude, 1e-30);
        matter += contour_matters[i] * max(1.0 - away, 0.0);
    }
#endif
    return matter;
}
#endif
