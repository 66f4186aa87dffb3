// Appearance of a medium from the eye: the light on it, and the colour that a depth cue mixes in.
//
// Switches: LIT 1: light falls on the medium; see light.glsl. PERSPECTIVE 1: rays diverge.
//           CUE 1: colours are mixed with another one, the more the deeper they are.

#include "held.glsl"
#if LIT
#include "light.glsl"

uniform vec3 to_eye_middle;       // direction to the eye on the middle pixel's ray, and its change per pixel
#if PERSPECTIVE
uniform vec3 to_eye_per_column;
uniform vec3 to_eye_per_row;
#endif
#if POINT_LIGHTS || SHADOWS
uniform mat3 world_from_box;
uniform vec3 world_corner;        // of the box, in the coordinates of lights
#endif

// Direction to the eye, of length 1, on the ray of `pixel`, which is counted from the middle of the picture.
vec3 to_eye_from(vec2 pixel) {
#if PERSPECTIVE
    return normalize(to_eye_middle + pixel.x * to_eye_per_column + pixel.y * to_eye_per_row);
#else
    return HELD(to_eye_middle);
#endif
}

// Shade of a gradient at a position in the box.
Shade shade_at(vec3 gradient, vec3 to_eye, vec3 position) {
#if POINT_LIGHTS || SHADOWS
    position = world_from_box * position + world_corner;
#endif
    return shade_of(gradient, to_eye, position);
}
#endif

#if CUE
uniform vec2 cue_range;           // fraction of the cue at depth 0, and what is added per unit of depth
uniform vec4 cue;                 // colour, and its largest fraction
vec2 held_cue_range = HELD(cue_range);
vec4 held_cue = HELD(cue);
#endif

// Premultiplied colour and opacity as seen from the eye at a depth.
vec4 cued(vec4 color, float depth) {
#if CUE
    float fraction = held_cue.a * clamp(held_cue_range.x + depth * held_cue_range.y, 0.0, 1.0);
    color.rgb = mix(color.rgb, held_cue.rgb * color.a, fraction);
#endif
    return color;
}
