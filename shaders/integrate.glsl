// The transfer function integrated along a slab on which the value is linear: the slab is cut into intervals on
// which the medium is linear, too.
//
// Switches: RAMPS, MISSING, EMISSIVE: see classify.glsl. With ramps, intervals end where a ramp does.
//           LIT: see medium.glsl.

#include "classify.glsl"

// Abscissae and weights of Gauss-Legendre quadrature for three points on [0, 1], and of Gauss-Laguerre quadrature.
const vec3 GAUSS_AT = vec3(0.11270166537925831, 0.5, 0.8872983346207417);
const vec3 GAUSS_WEIGHT = vec3(0.2777777777777778, 0.4444444444444444, 0.2777777777777778);

const vec3 LAGUERRE_AT = vec3(0.41577455678347908, 2.2942803602790417, 6.2899450829374792);
const vec3 LAGUERRE_WEIGHT = vec3(0.71109300992917302, 0.27851773356924085, 0.010389256501586136);

#if RAMPS && !LIT
// -log(1 - x) / x for the opacity x at each of the three points, where the opacity of the whole interval is at most
// 1. The smaller x is, the simpler a rational minimax function is near enough: errors are 2e-8, 4e-8 and 5e-7 of the
// result.
vec3 depths_per_opacity(vec3 x) {
    float first = (0.99999998 - x.x * (0.25891331 + 0.04635436 * x.x)) / (1.0 - 0.75891874 * x.x);
    float second = (0.99999997 + x.y * (-0.93621589 + x.y * (0.09517549 + 0.01166111 * x.y)))
        / (1.0 + x.y * (-1.43621948 + 0.48001545 * x.y));
    return vec3(first, second, depth_per_opacity(x.z));
}
#endif

// Mean position of the light from an interval of constant emission per extinction, as a fraction of the interval:
// the mean of t(A) over the opacities A from 0 to that of the whole interval, where -log(1 - A) is the optical depth
// in front of t. Extinction is linear, so that t solves a quadratic equation.
float mean_fraction(float extinction_in_front, float extinction_behind, float depth, float opacity) {
    float square = extinction_in_front * extinction_in_front;
    float squares = extinction_behind * extinction_behind - square;
#if RAMPS && !LIT
    vec3 fractions = (opacity / depth) * GAUSS_AT * depths_per_opacity(opacity * GAUSS_AT);
    vec3 roots = sqrt(max(square + squares * fractions, 0.0));
    vec3 means = fractions * (extinction_in_front + extinction_behind) / (extinction_in_front + roots);
    return dot(GAUSS_WEIGHT, min(means, 1.0));
#else
    // A loop, and logarithms: with light or segments beside it, Mesa's compiler takes minutes for more in one piece.
    float mean = 0.0;
    for (int i = 0; i < 3; ++i) {
        float fraction = depth_from_opacity(opacity * GAUSS_AT[i]) / depth;
        float root = sqrt(max(square + squares * fraction, 0.0));
        float t = fraction * (extinction_in_front + extinction_behind) / (extinction_in_front + root);
        mean += GAUSS_WEIGHT[i] * min(t, 1.0);
    }
    return mean;
#endif
}

// ∫ E e^-depth over an interval on which emission E and extinction are linear, in parts of optical depth 1 on
// average: the error of three points is x^7 / 2016000 of a part of depth x. What lies behind a depth of 24 adds
// 4e-11.
vec3 emissive_color(vec3 front, vec3 behind, float extinction_in_front, float extinction_behind, float path_length) {
    float depth = 0.5 * (extinction_in_front + extinction_behind) * path_length;
    if (depth > 64.0 && extinction_in_front > 0.1 * extinction_behind) {
        // Dense from the start: ∫ E/τ e^-u du over the optical depth u, by Gauss-Laguerre quadrature.
        vec3 deep = vec3(0.0);
        for (int i = 0; i < 3; ++i) {
            float fraction = LAGUERRE_AT[i] / depth;
            float square = extinction_in_front * extinction_in_front;
            float root = sqrt(mix(square, extinction_behind * extinction_behind, fraction));
            float t = fraction * (extinction_in_front + extinction_behind) / (extinction_in_front + root);
            deep += LAGUERRE_WEIGHT[i] * mix(front, behind, t) / root;
        }
        return deep;
    }
    float parts = clamp(ceil(depth), 1.0, 4096.0);
    vec3 color = vec3(0.0);
    float before = 0.0;
    for (float part = 0.0; part < parts && before < 24.0; part += 1.0) {
        for (int i = 0; i < 3; ++i) {
            float t = (part + GAUSS_AT[i]) / parts;
            before = path_length * t * mix(extinction_in_front, mix(extinction_in_front, extinction_behind, t), 0.5);
            color += GAUSS_WEIGHT[i] * exp(-before) * mix(front, behind, t);
        }
    }
    return color * (path_length / parts);
}

float crossed_depth;              // optical depth of all intervals since it was last set to 0

// Premultiplied colour and opacity of an interval on which the medium is linear from `front` to `behind`.
vec4 interval_color(vec4 front, vec4 behind, float path_length) {
    float depth = 0.5 * (front.a + behind.a) * path_length;
    float opacity = opacity_from_depth(depth);
    crossed_depth += depth;
#if EMISSIVE
    return vec4(emissive_color(front.rgb, behind.rgb, front.a, behind.a, path_length), opacity);
#else
    if (depth <= 0.0) return vec4(0.0);
    return vec4(mix(front.rgb, behind.rgb, mean_fraction(front.a, behind.a, depth, opacity)) * opacity, opacity);
#endif
}

#if RAMPS

// `bend` if it lies behind `value` and before `next`, or else `next`.
float bend_behind(float bend, float value, float next) {
    return bend > value && bend < next ? bend : next;
}

// The next value behind `value` at which a ramp starts or ends, all times `sign`; at most `end`.
float next_bend(float sign, float value, float end) {
    float next = end;
#define BEND(rise, position, i) \
    next = bend_behind(sign * position.x, value, bend_behind(sign * position.z, value, next));
    EACH_RAMP(BEND)
    return next;
}

// Colour and opacity of a slab along which the value is linear from `front` to `behind`: its intervals between the
// bends, composited. 0 if either value is NaN.
vec4 color_between_values(float front, float behind, float path_length) {
    if (!(front == front) || !(behind == behind)) return vec4(0.0);
    // Where values fall, their negatives are counted.
    float sign = behind < front ? -1.0 : 1.0;
    float end = sign * behind;
    float value = sign * front;
    float rise = end - value;
    vec4 medium = medium_of_value(front);
    vec4 color = vec4(0.0);
    for (;;) {
        float next = next_bend(sign, value, end);
        vec4 next_medium = medium_of_value(sign * next);
        float length = rise > 1e-37 ? path_length * ((next - value) / rise) : path_length;
        color = over(color, interval_color(medium, next_medium, length));
        if (next >= end) return color;
        value = next;
        medium = next_medium;
    }
}

#else

// Medium at a value in a segment.
vec4 medium_in(Segment segment, float value) {
    float fraction = fraction_of(segment, value);
    return vec4(color_at(segment, fraction), extinction_at(segment, fraction));
}

// Colour and opacity of a slab along which the value is linear from `front` to `behind`: its intervals between
// control points, composited. 0 if either value is NaN.
vec4 color_between_values(float front, float behind, float path_length) {
    if (!(front == front) || !(behind == behind)) return vec4(0.0);
    int index = segment_of(front);
    int last = segment_of(behind);
    int step = last < index ? -1 : 1;
    vec4 color = vec4(0.0);
    float value = front;
    for (;; index += step) {
        Segment segment = segment_at(index);
        float next = index == last ? behind : (step > 0 ? segment.end : segment.start);
        float fraction = behind == front ? 1.0 : clamp((next - value) / (behind - front), 0.0, 1.0);
        if (fraction > 0.0) {
            if (is_opaque(segment, max(value, next))) {
                crossed_depth += OPAQUE;
                return over(color, opaque_color(color_at(segment, fraction_of(segment, value))));
            }
            vec4 front_medium = medium_in(segment, value);
            color = over(color, interval_color(front_medium, medium_in(segment, next), path_length * fraction));
        }
        if (index == last) return color;
        value = next;
    }
}

#endif
