#version 330
// One pixel's ray through one brick: each slab contributes over the ray's own way through slab ∩ box, and the slabs are
// composited in registers, front to back.
//
// Depth along the view is counted in slab thicknesses from the middle of the box, so that slab k lies between the
// planes k and k + 1 and a whole slab is exactly 1 deep. Positions are in the box's own coordinates, in which it is
// [0, 1]³, and in texture coordinates, which are a brick's.
//
// Switches: CLASSIFICATION 0: texels hold slab-integrated colour and opacity, 1: emission and extinction, 2: the value,
//                          classified in the middle of each slab, 3: the value, integrated from plane to middle to plane.
//           PERSPECTIVE 1: rays diverge, 0: they are parallel.
//           MISSING, EMISSIVE: see classify.glsl.
//           RAMPS n: the transfer function is a sum of n ramps; 0: it is looked up, or classified already.
//           WHOLE_SLABS 1: the texels of CLASSIFICATION 0 stand for the ray's way through a slab as they are.
//           BRICKS 1: the texture is a part of the volume, and the slabs whose middle lies in it are drawn.
//           LEAPS 1: what `leaps` shows to be empty is leapt over.
//           COUNT 1: red is how many slabs were sampled.

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
uniform float least_transmittance;  // a ray that lets no more through is done; 0: none ever is
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
#if BRICKS
uniform real3 brick_low;          // the brick's own part of the box; infinite where the box ends
uniform real3 brick_high;
// A place in the texture: the driver's own product with the number of samples, less whole samples, times a power of two.
// So it is exactly where it would be in the texture of the whole.
uniform vec3 samples_per_box;
uniform vec3 first_sample;
uniform vec3 textures_per_sample;
#endif
#if CLASSIFICATION <= 1
uniform vec4 texel_scale;         // texels are stored relative to this
#endif
uniform float slab_length;        // slab thickness, in the unit of length of the texels or of the transfer function
#if CLASSIFICATION >= 2
#include "classify.glsl"
#endif
#if CLASSIFICATION == 3
#include "integrate.glsl"
#endif
#if LEAPS
#include "leap.glsl"
#endif

flat in vec2 slab_range;
out vec4 stack_color;             // premultiplied

#if CLASSIFICATION == 3
const float SAMPLE_AT = 0.0;
#else
const float SAMPLE_AT = 0.5;
#endif
const float MOST_AT_ONCE = 64.0;  // slabs composited before they are put behind the others: sums of few keep digits

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

vec4 texel_at(vec3 position) {
#if BRICKS
    position = (position * samples_per_box - first_sample) * textures_per_sample;
#endif
    return textureLod(texels, position, 0.0);
}

#if CLASSIFICATION == 0
// Premultiplied colour and opacity of the matter in `texel`, over `length` times what it stands for.
vec4 slab_color(vec4 texel, float length) {
    texel *= texel_scale;
    float opacity = opacity_from_depth(length * depth_from_opacity(texel.a));
    return vec4(texel.rgb * (texel.a > 0.0 ? opacity / texel.a : length), opacity);
}
#elif CLASSIFICATION == 1
vec4 slab_color(vec4 texel, float length) {
    texel *= texel_scale;
    float depth = texel.a * length;
    float opacity = opacity_from_depth(depth);
    return vec4(texel.rgb * (length * mean_transmittance(depth, opacity)), opacity);
}
#elif CLASSIFICATION == 2
vec4 slab_color(vec4 texel, float length) {
    return color_of_value(texel.r, length);
}
#endif

#if CLASSIFICATION != 3
// The same for a slab that the box does not cut short; of no length where `is_there` is 0.
vec4 whole_slab_color(vec4 texel, float length, float is_there) {
#if CLASSIFICATION == 0 && WHOLE_SLABS
    return texel * (texel_scale * is_there);
#else
    return slab_color(texel, length * is_there);
#endif
}
#endif

#if CLASSIFICATION == 3
// Two lines through three values: a quarter of one line's error where the value bends inside a slab.
vec4 color_through_values(float front, float middle, float behind, float length) {
    return over(color_between_values(front, middle, 0.5 * length), color_between_values(middle, behind, 0.5 * length));
}
#endif

// Colour and opacity of a slab from the share `front` of it to the share `back`.
vec4 part_of_slab(vec3 start, vec3 step, float slab, float front, float back, float whole_length) {
    float length = (back - front) * whole_length;
    float middle = slab + 0.5 * (front + back);
#if CLASSIFICATION == 3
    return color_through_values(texel_at(start + (slab + front) * step).r, texel_at(start + middle * step).r,
                                texel_at(start + (slab + back) * step).r, length);
#else
    return slab_color(texel_at(start + middle * step), length);
#endif
}

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
    float whole_length = obliquity * slab_length;

    // A depth is a slab and a share of it, so that the share keeps float32's digits at any depth.
    real2 inside = depths_between(real3(0.0), real3(1.0), position, way);
    inside.x = max(inside.x, eye_depth);
    if (inside.x >= inside.y) discard;
    float first_slab = float(floor(inside.x));
    float first_share = float(inside.x - floor(inside.x));
    float last_slab = float(ceil(inside.y)) - 1.0;
    float last_share = float(inside.y - (ceil(inside.y) - 1.0));
    float slab = max(first_slab, slab_range.x);
    float end = min(last_slab + 1.0, slab_range.y);
#if BRICKS
    // Neighbours work out the same depth for the face that they share, and a slab's middle lies on one side of it.
    real2 own = depths_between(brick_low, brick_high, position, way);
    if (own.x > own.y) discard;
    float own_slab = float(ceil(own.x - 0.5));
    float own_end = float(ceil(own.y - 0.5));
    // Of the first only a part may be seen, and the middle of the whole may lie behind the eye.
    real first_middle = 0.5 * (inside.x + min(floor(inside.x) + 1.0, inside.y));
    if (own.x <= first_middle && first_middle < own.y) {
        own_slab = first_slab;
        own_end = max(own_end, first_slab + 1.0);
    } else {
        own_slab = max(own_slab, first_slab + 1.0);
    }
    slab = max(slab, own_slab);
    end = min(end, own_end);
#endif
    vec3 start = vec3(position);
    vec3 step = vec3(way);

#if CLASSIFICATION >= 2 && RAMPS
    load_ramps();
#endif
    float samples = 0.0;
    // The slabs that the box cuts short: the first, and the last where that is another.
    vec4 last_color = vec4(0.0);
    if (end > last_slab && slab <= last_slab && last_slab > first_slab) {
        last_color = part_of_slab(start, step, last_slab, 0.0, last_share, whole_length);
        samples += 1.0;
    }
    stack_color = vec4(0.0);
    if (slab == first_slab && slab < end) {
        float back = first_slab == last_slab ? last_share : 1.0;
        stack_color = part_of_slab(start, step, first_slab, first_share, back, whole_length);
        samples += 1.0;
        slab += 1.0;
    }
    // The whole ones between them, in runs, until nothing behind them shows.
    end = min(end, last_slab);
#if LEAPS
    CellWalk walk = cell_walk(vec3(position), vec3(way));
#endif
    while (slab < end) {
        vec2 run = vec2(slab, end);
        float known_until = end;
#if LEAPS
        vec2 second;
        vec2 third;
        known_until = leap(walk, slab, end, SAMPLE_AT, run, second, third);
#endif
        // Opacity at which a run may end; a slab at least is drawn.
        float enough = 2.0;
        if (least_transmittance > 0.0) enough = max(1.0 - least_transmittance / (1.0 - stack_color.a), 1e-7);
        vec4 run_color = vec4(0.0);
        float turns_end = samples + MOST_AT_ONCE;
        slab = run.x;
#if CLASSIFICATION == 3
        float value = texel_at(start + slab * step).r;
#endif
        while (slab < end && samples < turns_end && run_color.a < enough) {
#if CLASSIFICATION == 3
            float middle = texel_at(start + (slab + 0.5) * step).r;
            float behind = texel_at(start + (slab + 1.0) * step).r;
            run_color = over(run_color, color_through_values(value, middle, behind, whole_length));
            value = behind;
            slab += 1.0;
            samples += 1.0;
            if (slab >= run.y) break;
#else
            // Two at a time, since the loop itself takes time; at the very end there may be one.
            vec4 texel = texel_at(start + (slab + 0.5) * step);
            vec4 next_texel = texel_at(start + (slab + 1.5) * step);
            float both = slab + 1.0 < end ? 1.0 : 0.0;
            run_color = over(run_color, whole_slab_color(texel, whole_length, 1.0));
            run_color = over(run_color, whole_slab_color(next_texel, whole_length, both));
            slab += 2.0;
            samples += 1.0 + both;
#if LEAPS
            // Neighbours in a vector of pixels don't wait for each other's runs.
            if (slab >= run.y) {
                known_until = max(known_until, slab);  // of two slabs at once the second may lie beyond
                slab = max(slab, second.x);
                run = second;
                second = third;
                third = vec2(NOWHERE);
            }
#endif
#endif
        }
        stack_color = over(stack_color, run_color);
        if (least_transmittance > 0.0 && 1.0 - stack_color.a <= least_transmittance) break;
#if LEAPS
        if (slab >= NOWHERE) slab = known_until;
#endif
    }
    stack_color = over(stack_color, last_color);
    stack_color.rgb *= color_scale;
#if COUNT
    stack_color.r = samples;
#endif
}
