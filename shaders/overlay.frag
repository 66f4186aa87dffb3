#version 330
// A picture in the window, or a part of the annotation over it, composited with the picture in linear light.
//
//     patch              p + M - K p                       M: premultiplied colour, K: opacity of the patch
//     line               p + c (m - p)                     c: covered fraction of the pixel, m: colour of the line
//     line behind        p + (1 - a) c (m - b)             a: opacity of the picture, b: background
//
// as annotation/marks.py composites them. What is drawn is the difference to p, weighted for blending: where another
// part lies over p already, the parts are blended. PART is that of overlay.vert.
//
// With LAYER the parts are drawn without a picture, as premultiplied linear colours, one over the other. PART 3 turns
// these into sRGB with straight opacity.

#if PART == 3
uniform sampler2D parts;     // linear, premultiplied
#elif !LAYER
uniform sampler2D picture;   // sRGB, with the opacity of the medium
#endif
in vec2 place;

out vec4 texel;

#if PART == 1
uniform sampler2D atlas;     // linear, premultiplied
in vec2 texel_of_atlas;
#elif PART == 2
#if !LAYER
uniform vec3 background;     // linear
#endif
in vec4 on_line;
flat in vec4 kind;
flat in vec4 look;
#endif

#if PART != 0
#include "srgb.glsl"
#endif

const float LEAST = 1e-4;    // a divisor, of which squares are still told from rounding

#if PART == 2
// A pixel projected on a unit vector (a, b) has half the length (a + b) / 2, which is at most the root of a half.
const float BEYOND = 0.75;

float ramp(float t) {
    t = max(t, 0.0);
    return 0.5 * t * t;
}

// Area of a unit pixel beyond an edge, `away` before its centre along the unit vector `direction`.
float beyond(float away, vec2 direction) {
    float a = max(abs(direction.x), LEAST), b = max(abs(direction.y), LEAST);
    away = clamp(away, -BEYOND, BEYOND);
    float wide = 0.5 * (a + b), narrow = 0.5 * (a - b);
    return clamp((ramp(away + wide) - ramp(away + narrow) - ramp(away - narrow) + ramp(away - wide)) / (a * b),
                 0.0, 1.0);
}

// Part of the pixel that lies on the line.
float part_on_line() {
    float half_width = 0.5 * look.w;
    return (beyond(on_line.x + half_width, kind.yx) - beyond(on_line.x - half_width, kind.yx))
        * (beyond(on_line.y, kind.xy) - beyond(on_line.y - on_line.z, kind.xy));
}
#endif

void main() {
#if PART == 3
    vec4 over = texelFetch(parts, ivec2(gl_FragCoord.xy), 0);
    texel = vec4(srgb_from_linear(over.rgb / max(over.a, LEAST)), over.a);
#else
#if !LAYER
    vec4 behind = texture(picture, place);
#endif
#if PART == 0
    texel = vec4(behind.rgb, 1.0);
#elif PART == 1
    vec4 over = texelFetch(atlas, ivec2(floor(texel_of_atlas)), 0);
    if (over.a <= 0.0) discard;
#if LAYER
    texel = over;
#else
    vec3 shown = linear_from_srgb(behind.rgb) * (1.0 - over.a) + over.rgb;
    texel = vec4(srgb_from_linear(shown) - (1.0 - over.a) * behind.rgb, over.a);
#endif
#else
    float part = part_on_line();
    if (part <= 0.0) discard;
    float covered = 1.0 - (1.0 - on_line.w * part) * (1.0 - kind.w * part);
#if LAYER
    texel = covered * vec4(look.rgb, 1.0);
#else
    vec3 light = linear_from_srgb(behind.rgb);
    vec3 shown = light + covered * (look.rgb - light);
    if (kind.z > 0.5) {
        covered = (1.0 - behind.a) * min((on_line.w + kind.w) * part, 1.0);
        shown = light + covered * (look.rgb - background);
    }
    texel = vec4(srgb_from_linear(shown) - (1.0 - covered) * behind.rgb, covered);
#endif
#endif
#endif
}
