// How matter at a place of the box is seen from the eye: in which light, and how the depth changes its colour.
//
// Switches: LIT 1: light falls on matter; see light.glsl. CUE 1: what is far is mixed with a colour.
//           PERSPECTIVE 1: rays diverge.

#include "held.glsl"
#if LIT
#include "light.glsl"

uniform vec3 to_eye_middle;       // along the middle pixel's ray, and what is added per pixel
#if PERSPECTIVE
uniform vec3 to_eye_per_column;
uniform vec3 to_eye_per_row;
#endif
#if POINT_LIGHTS || SHADOWS
uniform mat3 world_from_box;
uniform vec3 world_corner;        // in the coordinates of lights
#endif

// Towards the eye along the ray of a pixel, counted from the middle of the picture; of length 1.
vec3 to_eye_from(vec2 pixel) {
#if PERSPECTIVE
    return normalize(to_eye_middle + pixel.x * to_eye_per_column + pixel.y * to_eye_per_row);
#else
    return HELD(to_eye_middle);
#endif
}

Shade shade_at(vec3 gradient, vec3 to_eye, vec3 position) {
#if POINT_LIGHTS || SHADOWS
    return shade_of(gradient, to_eye, world_from_box * position + world_corner);
#else
    return shade_of(gradient, to_eye, position);
#endif
}
#endif

#if CUE
uniform vec2 cue_range;           // how far it has grown at depth 0, and how much it grows per depth
uniform vec4 cue;                 // colour, and how strong it becomes
vec2 held_cue_range = HELD(cue_range);
vec4 held_cue = HELD(cue);
#endif

// Premultiplied colour and opacity at some depth, as it is seen from the eye.
vec4 cued(vec4 color, float depth) {
#if CUE
    float fraction = held_cue.a * clamp(held_cue_range.x + depth * held_cue_range.y, 0.0, 1.0);
    color.rgb = mix(color.rgb, held_cue.rgb * color.a, fraction);
#endif
    return color;
}
