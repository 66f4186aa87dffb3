// What matter of some gradient sends to the eye of the light that falls on it; the formulas are in lighting.py.
//
// Switches: HEAD_LIGHT 1: a light at the eye. DIRECTIONAL_LIGHTS n, POINT_LIGHTS n: how many others there are.
//           SPECULAR 1: matter has highlights.
//           SHADOWS 1: of a light only what is left of it at a place falls on matter there, but for the head light.
//           TWO_SIDED 1: the side of a surface that faces the eye is lit.

#include "held.glsl"

uniform float ambient;
uniform float diffuse;
uniform float fade;                // |gradient| from which on it is fully believed
float held_ambient = HELD(ambient);
float held_diffuse = HELD(diffuse);
float held_fade = HELD(fade);
#if SPECULAR
uniform float specular;
uniform float shininess;
float held_specular = HELD(specular);
float held_shininess = HELD(shininess);
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
#endif
#if SHADOWS
uniform sampler3D light_transmittance;       // what is left of each light, the directional ones first
uniform mat3 box_from_position;      // box coordinates, from those of the point lights
uniform float shadow_distance;    // how far towards the light it is looked up
#endif

// What emission and extinction are multiplied with: q becomes q diffuse + extinction specular.
struct Shade {
    vec3 diffuse;
    vec3 specular;
};

// Cosine under which two directions are square to each other but for rounding: a surface then has no side to turn.
const float SQUARE = 1e-6;

// At length 1; 0 stays 0.
vec3 unit(vec3 vector) {
    return vector / max(length(vector), 1e-30);
}

// `believed` is how much the normal counts, from 0 to 1.
Shade with_light(Shade shade, vec3 color, vec3 normal, vec3 to_light, vec3 to_eye, float confidence) {
    float facing = dot(normal, to_light);
    shade.diffuse += held_diffuse * color * mix(1.0, max(facing, 0.0), confidence);
#if SPECULAR
    // Of a gradient whose square float32 does not hold the normal may be of any length.
    float halfway = clamp(dot(normal, unit(to_light + to_eye)), 1e-30, 1.0);
    shade.specular += (facing > SQUARE ? held_specular * confidence * pow(halfway, held_shininess) : 0.0) * color;
#endif
    return shade;
}

// What is left of the light of that number at a place.
float left_of_light(int number, vec3 position, vec3 to_light) {
#if SHADOWS
    return textureLod(light_transmittance, 0.5 + box_from_position * (position + shadow_distance * to_light), 0.0)[number];
#else
    return 1.0;
#endif
}

// Shade of matter at `place`, in the coordinates of the point lights, seen from `to_eye`, of length 1.
Shade shade_of(vec3 gradient, vec3 to_eye, vec3 position) {
    float magnitude = length(gradient);
    float fraction = clamp(magnitude / held_fade, 0.0, 1.0);
    float confidence = fraction * fraction * (3.0 - 2.0 * fraction);
    vec3 normal = gradient / -max(magnitude, 1e-30);
#if TWO_SIDED
    if (dot(normal, to_eye) < -SQUARE) normal = -normal;
#endif
    Shade shade = Shade(vec3(held_ambient), vec3(0.0));
#if HEAD_LIGHT
    shade = with_light(shade, held_head_color, normal, to_eye, to_eye, confidence);
#endif
#if DIRECTIONAL_LIGHTS
    for (int i = 0; i < DIRECTIONAL_LIGHTS; ++i) {
        vec3 color = direction_colors[i] * left_of_light(i, position, directions[i]);
        shade = with_light(shade, color, normal, directions[i], to_eye, confidence);
    }
#endif
#if POINT_LIGHTS
    for (int i = 0; i < POINT_LIGHTS; ++i) {
        vec3 to_light = unit(positions[i] - position);
        vec3 color = position_colors[i] * left_of_light(DIRECTIONAL_LIGHTS + i, position, to_light);
        shade = with_light(shade, color, normal, to_light, to_eye, confidence);
    }
#endif
    return shade;
}
