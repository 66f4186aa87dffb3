// Depths of a ray that are seen: behind the eye, in all half spaces, between two positions on the ray.
//
// Switches: HALF_SPACES: see half_spaces.glsl.
//           INTERVAL 1: only what lies between two positions on each ray is seen, see surface.frag.

#include "half_spaces.glsl"
#include "view.glsl"

#if INTERVAL
uniform sampler2D near_positions;    // the second component is a depth, the third the rest that float32 leaves of it
uniform sampler2D far_positions;
#endif

struct Visible {
    real2 interval;               // of depths
    bool is_cut;                  // true if the interval begins at a half space
};

// Visible depths of the ray through the pixel at a position in the window.
Visible visible_depths(Ray ray, vec2 window_position) {
    const real FARTHEST = 1e30;   // slabs
    Visible visible = Visible(real2(max(-FARTHEST, eye_depth), FARTHEST), false);
#if HALF_SPACES
    real uncut = visible.interval.x;
    visible.interval = kept_interval(visible.interval, ray);
    visible.is_cut = visible.interval.x > uncut;
#endif
#if INTERVAL
    vec2 near = texelFetch(near_positions, ivec2(window_position), 0).yz;
    vec2 far = texelFetch(far_positions, ivec2(window_position), 0).yz;
    real from = real(near.x) + real(near.y);
    if (from > visible.interval.x) visible.is_cut = false;
    visible.interval = real2(max(visible.interval.x, from), min(visible.interval.y, real(far.x) + real(far.y)));
#endif
    return visible;
}
