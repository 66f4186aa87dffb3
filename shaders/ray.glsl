// A pixel's ray: which slabs of the box it crosses, and how far it goes in the first and the last of them.
//
// Depth along the view is counted in slab thicknesses from the middle of the box, so that slab k lies between the
// planes k and k + 1 and a whole slab is exactly 1 deep. Positions are in the box's own coordinates, in which it is
// [0, 1]³.
//
// Switches: PERSPECTIVE 1: rays diverge, 0: they are parallel.
//           BRICKS 1: the slabs whose middle lies in the brick are the ray's.
//           HALF_SPACES: how many there are outside of which nothing is seen.
//           STRETCH 1: only what lies between two places of each ray is seen, see surface.frag.

#extension GL_ARB_gpu_shader_fp64 : enable

// Where a ray enters and leaves the box is worked out in double precision where the driver has it: in a medium of
// optical depth 400 across the box, float32's 1e-7 of the box would be 4e-5 of the picture at the silhouettes.
#ifdef GL_ARB_gpu_shader_fp64
#define real double
#define real2 dvec2
#define real3 dvec3
#define real4 dvec4
#else
#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
#endif

uniform real eye_depth;           // nothing in front of the eye is seen
uniform vec2 picture_middle;      // pixels
uniform real3 point;              // where the ray of the middle pixel meets depth 0, in the box
uniform real3 point_per_column;
uniform real3 point_per_row;
uniform real3 velocity;           // way of that ray per unit of depth
#if PERSPECTIVE
uniform real3 velocity_per_column;
uniform real3 velocity_per_row;
uniform float tangent_per_pixel;
#endif
#if HALF_SPACES
uniform real4 half_spaces[HALF_SPACES];  // what is kept has dot(xyz, position) + w >= 0, in the box
#endif
#if STRETCH
uniform sampler2D near_places;    // a depth, and what float32 leaves of it, in the middle components
uniform sampler2D far_places;
#endif
#if BRICKS
uniform real3 brick_low;          // the brick's own part of the box; infinite where the box ends
uniform real3 brick_high;
#endif

struct Ray {
    vec3 start;                   // where it is at depth 0, in the box
    vec3 step;                    // its way through a slab
    float obliquity;              // length of the ray between two planes at distance 1
    float slab;                   // the first of its slabs, and the one after the last; none where it misses
    float end;
    // The first and the last slab that it crosses in the whole box, and the shares from which and up to which.
    float first_slab;
    float first_share;
    float last_slab;
    float last_share;
#if HALF_SPACES
    bool is_cut_open;             // whether a half space, and neither box nor eye, is where it begins
#endif
};

// What of the depths `inside` is between two planes along one axis.
real2 depths_between_planes(real2 inside, real low, real high, real position, real way) {
    if (abs(way) < 1e-30) return position < low || position > high ? real2(1.0, -1.0) : inside;
    real a = (low - position) / way;
    real b = (high - position) / way;
    return real2(max(inside.x, min(a, b)), min(inside.y, max(a, b)));
}

// Depths at which the line position + depth * way enters and leaves the box from low to high; enters > leaves if it
// misses. Axis by axis in so many words: drivers keep what a loop has an index into in memory.
real2 depths_between(real3 low, real3 high, real3 position, real3 way) {
    real2 inside = real2(-1e30, 1e30);
    inside = depths_between_planes(inside, low.x, high.x, position.x, way.x);
    inside = depths_between_planes(inside, low.y, high.y, position.y, way.y);
    return depths_between_planes(inside, low.z, high.z, position.z, way.z);
}

#if HALF_SPACES
// What of the depths `inside` is in all half spaces.
real2 depths_kept(real2 inside, real3 position, real3 way) {
    for (int i = 0; i < HALF_SPACES; ++i) {
        real height = dot(half_spaces[i].xyz, position) + half_spaces[i].w;
        real rise = dot(half_spaces[i].xyz, way);
        real meets = -height / (abs(rise) < 1e-30 ? 1e-30 : rise);
        if (rise >= 1e-30) inside.x = max(inside.x, meets);
        else if (rise <= -1e-30) inside.y = min(inside.y, meets);
        else if (height < 0.0) inside = real2(1.0, -1.0);
    }
    return inside;
}
#endif

// The ray through the middle of the pixel at `place`, in window coordinates, and its slabs among those of `slab_range`.
Ray ray_through(vec2 place, vec2 slab_range) {
    vec2 pixel = place - picture_middle;
    real3 position = point + real(pixel.x) * point_per_column + real(pixel.y) * point_per_row;
    real3 way = velocity;
    Ray ray;
    ray.obliquity = 1.0;
#if PERSPECTIVE
    way += real(pixel.x) * velocity_per_column + real(pixel.y) * velocity_per_row;
    vec2 tangent = pixel * tangent_per_pixel;
    ray.obliquity = sqrt(1.0 + dot(tangent, tangent));
#endif
    ray.start = vec3(position);
    ray.step = vec3(way);
    // A depth is a slab and a share of it, so that the share keeps float32's digits at any depth.
    real2 inside = depths_between(real3(0.0), real3(1.0), position, way);
    inside.x = max(inside.x, eye_depth);
#if HALF_SPACES
    real uncut = inside.x;
    inside = depths_kept(inside, position, way);
    ray.is_cut_open = inside.x > uncut;
#endif
#if STRETCH
    vec2 near = texelFetch(near_places, ivec2(place), 0).yz;
    vec2 far = texelFetch(far_places, ivec2(place), 0).yz;
    real from = real(near.x) + real(near.y);
#if HALF_SPACES
    if (from > inside.x) ray.is_cut_open = false;
#endif
    inside = real2(max(inside.x, from), min(inside.y, real(far.x) + real(far.y)));
#endif
    ray.first_slab = float(floor(inside.x));
    ray.first_share = float(inside.x - floor(inside.x));
    ray.last_slab = float(ceil(inside.y)) - 1.0;
    ray.last_share = float(inside.y - (ceil(inside.y) - 1.0));
    ray.slab = max(ray.first_slab, slab_range.x);
    ray.end = min(ray.last_slab + 1.0, slab_range.y);
#if BRICKS
    // Neighbours work out the same depth for the face that they share, and a slab's middle lies on one side of it.
    real2 own = depths_between(brick_low, brick_high, position, way);
    float own_slab = float(ceil(own.x - 0.5));
    float own_end = float(ceil(own.y - 0.5));
    // Of the first only a part may be seen, and the middle of the whole may lie behind the eye.
    real first_middle = 0.5 * (inside.x + min(floor(inside.x) + 1.0, inside.y));
    if (own.x <= first_middle && first_middle < own.y) {
        own_slab = ray.first_slab;
        own_end = max(own_end, ray.first_slab + 1.0);
    } else {
        own_slab = max(own_slab, ray.first_slab + 1.0);
    }
    ray.slab = max(ray.slab, own_slab);
    ray.end = own.x > own.y ? ray.slab : min(ray.end, own_end);
#endif
    if (inside.x >= inside.y) ray.end = ray.slab;
    return ray;
}
