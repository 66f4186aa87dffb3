// Colour of a triangle or a line where a ray meets it.
//
// Switches: LIT, CUE, PERSPECTIVE and those of lights: see seen.glsl; without light shapes show their colours.

#include "seen.glsl"

// Premultiplied colour and opacity; `kind` is that of surface_table.glsl, `normal` faces outward where there is light.
vec4 surface_color(vec4 look, vec4 kind, vec3 normal, vec2 pixel, float depth, vec3 position) {
    vec3 shown = look.rgb;
#if LIT
    if (kind.x > 0.0) {
        Shade shade = shade_at(-normal, to_eye_from(pixel), position);
        shown = shown * shade.diffuse + shade.specular;
    }
#endif
    return cued(vec4(shown * look.a, look.a), depth);
}
