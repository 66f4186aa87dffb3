#version 330
// One pixel's ray through one slab stack: each slab contributes over the ray's own way through slab ∩ box, and the
// slabs are composited in registers, front to back.
//
// Depth along the view is counted in slab thicknesses from the middle of the box, so that slab k lies between the
// planes k and k + 1 and a whole slab is exactly 1 deep. Positions are in texture coordinates: the box is [0, 1]³.
//
// Switches: CLASSIFICATION 0: texels hold slab-integrated colour and opacity, 1: emission and extinction, 2: the value,
//                          classified in the middle of each slab, 3: the value, integrated from plane to middle to plane.
//           PERSPECTIVE 1: rays diverge, 0: they are parallel.

#extension GL_ARB_gpu_shader_fp64 : enable
#include "optics.glsl"

// Where a ray enters and leaves the box is worked out in double precision where the driver has it: in a medium of
// optical depth 400 across the box, float32's 1e-7 of the box would be 4e-5 of the picture at the silhouettes.
#ifdef GL_ARB_gpu_shader_fp64
#define real double
#define real2 dvec2
#define real3 dvec3
#else
#define real float
#define real2 vec2
#define real3 vec3
#endif

uniform sampler3D texels;
uniform float color_scale;        // brings the brightest emission near 1, for targets of few digits
uniform real eye_depth;           // nothing in front of the eye is seen
uniform vec2 picture_middle;      // pixels
uniform real3 point;              // where the ray of the middle pixel meets depth 0
uniform real3 point_per_column;
uniform real3 point_per_row;
uniform real3 velocity;           // way of that ray per unit of depth
#if PERSPECTIVE
uniform real3 velocity_per_column;
uniform real3 velocity_per_row;
uniform float tangent_per_pixel;
#endif
#if CLASSIFICATION <= 1
uniform vec4 texel_scale;         // what a texel is to be multiplied with
#endif
uniform float slab_length;        // slab thickness in what the texels count lengths in
// A file is included once, so that what the next one includes has to be outside of its condition.
#if CLASSIFICATION >= 2
#include "classify.glsl"
#endif
#if CLASSIFICATION == 3
#include "integrate.glsl"
#endif

flat in vec2 slab_range;
out vec4 stack_color;             // premultiplied

// Depths at which the line position + depth * way enters and leaves the unit cube; enters > leaves if it misses.
real2 depths_in_box(real3 position, real3 way) {
    real2 inside = real2(-1e30, 1e30);
    for (int axis = 0; axis < 3; ++axis) {
        if (abs(way[axis]) < 1e-30) {
            if (position[axis] < 0.0 || position[axis] > 1.0) inside = real2(1.0, -1.0);
        } else {
            real a = -position[axis] / way[axis];
            real b = (1.0 - position[axis]) / way[axis];
            inside = real2(max(inside.x, min(a, b)), min(inside.y, max(a, b)));
        }
    }
    return inside;
}

vec4 texel_at(vec3 position) {
    return textureLod(texels, position, 0.0);
}

#if CLASSIFICATION == 0
// Premultiplied colour and opacity of the matter in `texel`, over `path` times the slab thickness.
vec4 slab_color(vec4 texel, float path) {
    texel *= texel_scale;
    float path_length = path * slab_length;
    if (path_length == 1.0) return texel;
    float opacity = opacity_from_depth(path_length * depth_from_opacity(texel.a));
    return vec4(texel.rgb * (texel.a > 0.0 ? opacity / texel.a : path_length), opacity);
}
#elif CLASSIFICATION == 1
vec4 slab_color(vec4 texel, float path) {
    texel *= texel_scale;
    float path_length = path * slab_length;
    float depth = texel.a * path_length;
    float opacity = opacity_from_depth(depth);
    return vec4(texel.rgb * (path_length * mean_transmittance(depth, opacity)), opacity);
}
#elif CLASSIFICATION == 2
vec4 slab_color(vec4 texel, float path) {
    return texel.r == texel.r ? color_of_value(texel.r, path * slab_length) : vec4(0.0);  // NaN is nothing
}
#endif

void main() {
    vec2 pixel = gl_FragCoord.xy - picture_middle;
    real3 position = point + real(pixel.x) * point_per_column + real(pixel.y) * point_per_row;
    real3 way = velocity;
    float obliquity = 1.0;        // length of the ray between two planes at distance 1
#if PERSPECTIVE
    way += real(pixel.x) * velocity_per_column + real(pixel.y) * velocity_per_row;
    vec2 tangent = pixel * tangent_per_pixel;
    obliquity = sqrt(1.0 + dot(tangent, tangent));
#endif

    // A depth is a slab and a share of it, so that the share keeps float32's digits at any depth.
    real2 inside = depths_in_box(position, way);
    inside.x = max(inside.x, eye_depth);
    if (inside.x >= inside.y) discard;
    float first_slab = float(floor(inside.x));
    float first_share = float(inside.x - floor(inside.x));
    float last_slab = float(ceil(inside.y)) - 1.0;
    float last_share = float(inside.y - (ceil(inside.y) - 1.0));

    vec3 start = vec3(position);
    vec3 step = vec3(way);
    stack_color = vec4(0.0);
    float slab = max(first_slab, slab_range.x);
    float end = min(last_slab, slab_range.y - 1.0);
#if CLASSIFICATION == 3
    float value = texel_at(start + (slab + (slab == first_slab ? first_share : 0.0)) * step).r;
#endif
    for (; slab <= end; slab += 1.0) {
        float front = slab == first_slab ? first_share : 0.0;
        float back = slab == last_slab ? last_share : 1.0;
        float path = (back - front) * obliquity;
#if CLASSIFICATION == 3
        // Two lines through three values: a quarter of one line's error where the value bends inside a slab.
        float middle = texel_at(start + (slab + 0.5 * (front + back)) * step).r;
        float behind = texel_at(start + (slab + back) * step).r;
        vec4 color = over(color_between_values(value, middle, 0.5 * path * slab_length),
                          color_between_values(middle, behind, 0.5 * path * slab_length));
        value = behind;
#else
        vec4 color = slab_color(texel_at(start + (slab + 0.5 * (front + back)) * step), path);
#endif
        stack_color = over(stack_color, color);
    }
    stack_color.rgb *= color_scale;
}
