// Composition of a ray's slabs in registers, front to back.
//
// Loops that end at their condition are left at their end as well: a driver that draws pixels as a vector goes
// through the body once more to find out that no pixel has anything left to do.
//
// Switches: COUNT 1: red of the target is the number of slabs that were sampled.

#include "optics.glsl"

flat uniform float color_scale;        // brings the brightest emission near 1, for targets of few digits
flat uniform float least_transmittance;  // a ray that transmits no more than this is finished; 0: no ray ever is

const float MOST_AT_ONCE = 64.0;  // slabs composited before they are put behind the others: sums of few keep digits

// Opacity at which slabs may stop that are put behind an opacity; more than 1 where they may not. One slab is drawn
// at least.
float sufficient_opacity(float in_front) {
    float enough = 2.0;
    if (least_transmittance > 0.0) enough = max(1.0 - least_transmittance / (1.0 - in_front), 1e-7);
    return enough;
}

// True if a ray of an opacity is finished.
bool is_finished(float opacity) {
    return least_transmittance > 0.0 && 1.0 - opacity <= least_transmittance;
}

// Number for the target: premultiplied colour and opacity of a ray, of which so many slabs were sampled.
vec4 target_color(vec4 color, float samples) {
    color.rgb *= color_scale;
#if COUNT
    color.r = samples;
#endif
    return color;
}
