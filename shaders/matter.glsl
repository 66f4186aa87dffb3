// What is at a place of the box, as it is seen: matter that is classified there, in its light, and slabs of it.
//
// Switches: CLASSIFICATION 0: texels hold slab-integrated colour and opacity, 1: emission and extinction, 2: the value,
//                          classified in the middle of each slab, 3: the value, integrated from plane to middle to plane.
//           MISSING, EMISSIVE, RAMPS: see classify.glsl. GRADIENT, WEIGHTS: see volume_texture.glsl.
//           LIT 1: light falls on matter. MODULATIONS, GRADED, CONTOURS: see graded.glsl; HEAD_LIGHT and the like: see
//           light.glsl. CUE: see seen.glsl.

#include "optics.glsl"
#include "held.glsl"
#include "volume_texture.glsl"
#include "seen.glsl"

#if CLASSIFICATION <= 1
flat uniform vec4 texel_scale;         // texels are stored relative to this
vec4 held_scale = HELD(texel_scale);
#endif
flat uniform float slab_length;        // slab thickness, in the unit of length of the texels or of the transfer function
#if CLASSIFICATION >= 2
#include "classify.glsl"
#endif
#if CLASSIFICATION == 3
#include "integrate.glsl"
#endif
#if MODULATIONS || GRADED || CONTOURS
#include "graded.glsl"
#endif

#if LIT
vec3 to_eye;                      // along the ray, of length 1
#endif

// Before anything is asked of the matter on the ray of a pixel, counted from the middle of the picture.
void look_along(vec2 pixel) {
#if LIT
    to_eye = to_eye_from(pixel);
#endif
#if CLASSIFICATION >= 2 && RAMPS
    load_ramps();
#endif
}

#if CLASSIFICATION >= 2
// Whether r, g, b of matter is its emission, and not its colour.
const bool GLOWS = EMISSIVE != 0 || GRADED != 0 || CONTOURS != 0;
#endif

#if CLASSIFICATION == 2
// Matter of a texel, in its light.
vec4 medium_of(vec4 texel, vec3 position) {
    float value = value_of(texel);
    vec4 medium = medium_of_value(value);
#if GRADIENT
    vec3 gradient = gradient_of(texel);
#if MODULATIONS
    float factor = modulation_of(magnitude_of(gradient));
    medium *= vec4(EMISSIVE != 0 ? vec3(factor) : vec3(1.0), factor);
#endif
#if GRADED || CONTOURS
    if (EMISSIVE == 0) medium.rgb *= medium.a;
    medium += value == value ? graded_medium(value, magnitude_of(gradient)) : vec4(0.0);
#endif
#if LIT
    Shade shade = shade_at(gradient, to_eye, position);
    medium.rgb = medium.rgb * shade.diffuse + (GLOWS ? medium.a : 1.0) * shade.specular;
#endif
#endif
    return medium;
}
#endif

#if CLASSIFICATION == 3
// Colour and opacity of half a slab; what depends on the gradient is that of its middle.
vec4 color_between(vec4 front, vec4 behind, float length, vec3 position, float depth) {
#if WEIGHTS
    float weight = weight_at(position);
    if (weight == 0.0) return vec4(0.0);  // opaque matter is so at any length
    length *= weight;
#endif
#if MODULATIONS
    float factor = modulation_of(magnitude_of(0.5 * (gradient_of(front) + gradient_of(behind))));
    if (factor == 0.0) return vec4(0.0);
    length *= factor;
#endif
    vec4 color = color_between_values(value_of(front), value_of(behind), length);
#if LIT
    Shade shade = shade_at(0.5 * (gradient_of(front) + gradient_of(behind)), to_eye, position);
    color.rgb = color.rgb * shade.diffuse + color.a * shade.specular;
#endif
    return cued(color, depth);
}
#endif
