// Light that a medium with a gradient reflects to the eye; the formulas are in scene/lighting.py.
//
// Switches: HEAD_LIGHT 1: there is a light at the eye. DIRECTIONAL_LIGHTS n, POINT_LIGHTS n: number of other lights.
//           FALL_OFF 1: point lights fall off with distance. SPECULAR 1: the medium has highlights,
//           n > 1: their exponent is 2 to the power of n - 1.
//           SHADOWS 1: a light is multiplied with its transmittance to the position; the head light is not.
//           FETCHED: see interpolated.glsl, of the transmittance. TWO_SIDED 1: the side of a surface that faces the eye is lit.

#include "held.glsl"
#if SHADOWS
#include "interpolated.glsl"
#endif

uniform float ambient;
uniform float diffuse;
uniform float fade;                // magnitude of the gradient from which on the gradient confidence is 1
float held_ambient = HELD(ambient);
float held_diffuse = HELD(diffuse);
float held_fade = HELD(fade);
#if SPECULAR
uniform float specular;
float held_specular = HELD(specular);
#if SPECULAR == 1
uniform float shininess;
float held_shininess = HELD(shininess);
#endif
#endif
#if HEAD_LIGHT
uniform vec3 head_color;
vec3 held_head_color = HELD(head_color);
#endif
#if DIRECTIONAL_LIGHTS
uniform vec3 directions[DIRECTIONAL_LIGHTS];  // to the light, of length 1
uniform vec3 direction_colors[DIRECTIONAL_LIGHTS];
#endif
#if POINT_LIGHTS
uniform vec3 positions[POINT_LIGHTS];
uniform vec3 position_colors[POINT_LIGHTS];
#if FALL_OFF
uniform float fall_offs[POINT_LIGHTS];  // distances at which lights have half of their strength
#endif
#endif
#if SHADOWS
uniform sampler3D light_transmittance;  // of the medium between a position and each light, the directional ones first
uniform mat3 box_from_position;   // from the coordinates of the point lights to fractions of the box
uniform float shadow_distance;    // towards the light, at which the transmittance is looked up
#endif

// Factors of emission q and extinction: q becomes q diffuse + extinction specular.
struct Shade {
    vec3 diffuse;
    vec3 specular;
};

// Cosine at which two directions may be at right angles but for rounding: the surface then has no side to turn.
const float SQUARE = 1e-6;

// The vector at length 1; 0 stays 0.
vec3 unit(vec3 vector) {
    return vector / max(length(vector), 1e-30);
}

// Unit normal of a surface, which points to lower values.
vec3 normal_of(vec3 gradient, float magnitude) {
    return gradient * (-1.0 / max(magnitude, 1e-30));
}

// Normal of the side of a surface that is lit.
vec3 lit_normal(vec3 normal, vec3 to_eye) {
#if TWO_SIDED
    if (dot(normal, to_eye) < -SQUARE) normal = -normal;
#endif
    return normal;
}

#if SPECULAR
// Cosine of the angle between a normal and the direction halfway between a light and the eye.
float halfway_cosine(vec3 normal, vec3 to_light, vec3 to_eye) {
    // The normal may be of any length if float32 does not hold the square of the gradient.
    return clamp(dot(normal, unit(to_light + to_eye)), 1e-30, 1.0);
}

// A cosine to the power of the shininess. Few squarings take a third of the time of `pow`, and are more exact.
float shine_of(float cosine) {
#if SPECULAR == 1
    cosine = pow(cosine, held_shininess);
#endif
    for (int i = 0; i < SPECULAR - 1; ++i) cosine *= cosine;
    return cosine;
}

// Highlight of a light of colour 1; `facing` is the cosine of the angle between the normal and the light.
float highlight_of(float facing, float halfway, float confidence) {
    return facing > SQUARE ? held_specular * confidence * shine_of(halfway) : 0.0;
}
#endif

// `shade` with one light added; `confidence` is the gradient confidence, 0 to 1.
Shade with_light(Shade shade, vec3 color, vec3 normal, vec3 to_light, vec3 to_eye, float confidence) {
    float facing = dot(normal, to_light);
    shade.diffuse += held_diffuse * color * mix(1.0, max(facing, 0.0), confidence);
#if SPECULAR
    shade.specular += highlight_of(facing, halfway_cosine(normal, to_light, to_eye), confidence) * color;
#endif
    return shade;
}

// Transmittance between a position and the light of that number.
float transmittance_to_light(int number, vec3 position, vec3 to_light) {
#if SHADOWS
    vec3 in_box = 0.5 + box_from_position * (position + shadow_distance * to_light);
    return interpolated(light_transmittance, in_box)[number];
#else
    return 1.0;
#endif
}

// Shade at a position in the coordinates of the point lights; `to_eye` is the direction to the eye, of length 1.
Shade shade_of(vec3 gradient, vec3 to_eye, vec3 position) {
    float magnitude = length(gradient);
    float fraction = clamp(magnitude / held_fade, 0.0, 1.0);
    float confidence = fraction * fraction * (3.0 - 2.0 * fraction);
    vec3 normal = lit_normal(normal_of(gradient, magnitude), to_eye);
    Shade shade = Shade(vec3(held_ambient), vec3(0.0));
#if HEAD_LIGHT
    shade = with_light(shade, held_head_color, normal, to_eye, to_eye, confidence);
#endif
#if DIRECTIONAL_LIGHTS
    for (int i = 0; i < DIRECTIONAL_LIGHTS; ++i) {
        vec3 color = direction_colors[i] * transmittance_to_light(i, position, directions[i]);
        shade = with_light(shade, color, normal, directions[i], to_eye, confidence);
    }
#endif
#if POINT_LIGHTS
    for (int i = 0; i < POINT_LIGHTS; ++i) {
        vec3 to_light = unit(positions[i] - position);
        vec3 color = position_colors[i] * transmittance_to_light(DIRECTIONAL_LIGHTS + i, position, to_light);
#if FALL_OFF
        color *= fall_offs[i] / (fall_offs[i] + length(positions[i] - position));
#endif
        shade = with_light(shade, color, normal, to_light, to_eye, confidence);
    }
#endif
    return shade;
}
