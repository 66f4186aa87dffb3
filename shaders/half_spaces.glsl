// Half spaces: there is a medium only in the intersection of all of them.
//
// Switches: HALF_SPACES n: number of half spaces.

#include "ray.glsl"

#if HALF_SPACES
uniform real4 half_spaces[HALF_SPACES];  // a position in the box is kept where dot(xyz, position) + w >= 0

// Part of an interval in which a ray is in one half space.
real2 half_space_interval(real2 interval, real4 half_space, Ray ray) {
    real height = dot(half_space.xyz, ray.position) + half_space.w;
    real rise = dot(half_space.xyz, ray.direction);
    real crossing = -height / (abs(rise) < 1e-30 ? 1e-30 : rise);
    if (rise >= 1e-30) interval.x = max(interval.x, crossing);
    else if (rise <= -1e-30) interval.y = min(interval.y, crossing);
    else if (height < 0.0) interval = real2(1.0, -1.0);
    return interval;
}
#endif

// Part of an interval in which a ray is in all half spaces.
real2 kept_interval(real2 interval, Ray ray) {
#if HALF_SPACES
    for (int i = 0; i < HALF_SPACES; ++i) interval = half_space_interval(interval, half_spaces[i], ray);
#endif
    return interval;
}

// True if a position is in all half spaces.
bool is_kept(real3 position) {
#if HALF_SPACES
    for (int i = 0; i < HALF_SPACES; ++i) {
        if (dot(half_spaces[i].xyz, position) + half_spaces[i].w < 0.0) return false;
    }
#endif
    return true;
}
