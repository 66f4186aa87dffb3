// The medium at a position in the box as it is seen: classified, lit, and mixed with the colour of the depth cue.
//
// Switches: CLASSIFICATION 0: texels hold slab-integrated colour and opacity, 1: emission and extinction, 2: the value,
//                          classified in the middle of each slab, 3: the value, integrated over halves of slabs.
//           MISSING, EMISSIVE, RAMPS, SPREAD: see classify.glsl. GRADIENT, WEIGHTS: see volume_texture.glsl.
//           LIT 1: light falls on the medium; HEAD_LIGHT and the like: see light.glsl. CUE: see seen.glsl.
//           MODULATIONS, GRADED, CONTOURS: see graded.glsl.

#include "volume_texture.glsl"
#include "optics.glsl"
#include "held.glsl"
#include "seen.glsl"

#if CLASSIFICATION <= 1
flat uniform vec4 texel_scale;         // texels are stored relative to this
vec4 held_scale = HELD(texel_scale);
#endif
flat uniform float slab_length;        // slab thickness, in the unit of length of texels or transfer function
#if CLASSIFICATION >= 2
#include "classify.glsl"
#include "graded.glsl"
#endif
#if CLASSIFICATION == 3
#include "integrate.glsl"
#endif
#if SPREAD
uniform sampler3D rows;           // of distributions of values; lie as the texels do
#endif

#if LIT
vec3 to_eye;                      // along the ray, of length 1
#endif

// Prepare all that follows for the ray of `pixel`, which is counted from the middle of the picture.
void prepare_medium(vec2 pixel) {
#if LIT
    to_eye = to_eye_from(pixel);
#endif
#if CLASSIFICATION >= 2
    load_ramps();
#endif
}

#if CLASSIFICATION == 2
// True if r, g, b of a medium are its emission, and false if they are its straight colour.
const bool GLOWS = EMISSIVE != 0 || GRADED != 0 || CONTOURS != 0;

// Medium of the control points times the factor of its modulation; straight colour stays.
vec4 modulated(vec4 medium, float factor) {
    return medium * vec4(EMISSIVE != 0 ? vec3(factor) : vec3(1.0), factor);
}

// Medium of the control points with its emission in place of a straight colour.
vec4 with_emission(vec4 medium) {
    if (EMISSIVE == 0) medium.rgb *= medium.a;
    return medium;
}

#if LIT
// Medium in its light.
vec4 lit_medium(vec4 medium, Shade shade) {
    return vec4(medium.rgb * shade.diffuse + (GLOWS ? medium.a : 1.0) * shade.specular, medium.a);
}
#endif

// Medium of a texel in its light: colour or emission, and extinction.
vec4 medium_of(vec4 texel, vec3 position) {
    float value = value_of(texel);
#if SPREAD
    vec4 medium = medium_of_spread(value, interpolated(rows, texture_position(position)).r);
#else
    vec4 medium = medium_of_value(value);
#endif
    vec3 gradient = gradient_of(texel);
    float magnitude = magnitude_of(gradient);
    medium = modulated(medium, modulation_of(magnitude));
    if (GRADED != 0 || CONTOURS != 0) {
        medium = with_emission(medium);
        medium += value == value ? graded_medium(value, magnitude) : vec4(0.0);
    }
#if LIT
    medium = lit_medium(medium, shade_at(gradient, to_eye, position));
#endif
    return medium;
}
#endif

#if CLASSIFICATION == 3
// Where a path through the medium has come: its value and gradient there.
struct Place {
    Front front;
    vec3 gradient;
};

Place place_of(vec4 texel) {
    return Place(front_at(value_of(texel)), gradient_of(texel));
}

// `color` over half a slab from a place to a texel, where the place goes on to; the gradient of all of it is that in
// its middle.
vec4 over_half(vec4 color, inout Place place, vec4 behind, float length, vec3 position, float depth) {
    vec3 gradient = 0.5 * (place.gradient + gradient_of(behind));
    place.gradient = gradient_of(behind);
    length *= weight_at(position) * modulation_of(magnitude_of(gradient));
#if LIT || CUE
    vec4 its_color = over_path(vec4(0.0), place.front, value_of(behind), length);
#if LIT
    Shade shade = shade_at(gradient, to_eye, position);
    its_color.rgb = its_color.rgb * shade.diffuse + its_color.a * shade.specular;
#endif
    return over(color, cued(its_color, depth));
#else
    return over_path(color, place.front, value_of(behind), length);
#endif
}
#endif
