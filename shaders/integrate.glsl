// The transfer function integrated along a path on which the value is linear: the path is cut into intervals on which
// the medium is linear, too, and of an optical depth of at most 1.
//
// A loop goes through its body at least once, whatever its condition: Mesa's software driver has no branch that a
// whole vector of pixels takes or leaves, but for the end of a loop. So each turn crosses an interval, the last one too.
//
// Switches: RAMPS, MISSING, EMISSIVE: see classify.glsl. With ramps, intervals end where a ramp does.
//           SHALLOW 1: no interval is deeper than 1, see optics.glsl.

#include "classify.glsl"

const float ENOUGH = 0.9999999;   // opacity behind which float32 has no digits left

float crossed_depth;              // optical depth of all intervals since it was last set to 0

// The function q of `over_shallow`, a minimax polynomial. Its error is 2e-7 where emission is integrated, and 4e-6
// where it only counts as far as colours differ.
float slope_integral(float square, float rise) {
#if EMISSIVE
    float linear = -0.00833212904 + square * (0.00019277012 + 1.59292237e-5 * rise);
    float rest = (-0.000595024335 - 3.23066647e-5 * rise) - 1.47159489e-6 * (rise * rise);
    return (-0.0833333073 + square * (0.00138833136 - 3.17413515e-5 * square)) + rise * (linear + rise * rest);
#else
    float linear = -0.00833151476 + 0.000191884999 * square;
    return (-0.0833293864 + 0.00135667593 * square) + rise * (linear - rise * (0.000581973913 + 3.27713893e-5 * rise));
#endif
}

// Opacity of a path, given its optical depth and mean transmittance.
float opacity_from_mean(float depth, float mean) {
    return depth * mean;
}

// `color` over an interval on which the medium is linear from `front` to `behind`, of an optical depth x from 0 to 1.
// With y, half of what the depth of as long a path would rise by from the one medium to the other, and
// u(t) = x t + y (t² - t), φ = (1 - e^-x) / x:
//
//     ∫ e^-u dt = φ (1 - 2 y q)     ∫ (t - 1/2) e^-u dt = φ x q     ∫ (t - 1/2) u' e^-u dt = -φ (2 y q + b)
//
// where q(x², y) and b = x/2 coth(x/2) - 1 are smooth and even in x, so that they have few terms. That of b is 2e-6 x
// off at most.
vec4 over_shallow(vec4 color, vec4 front, vec4 behind, float path_length) {
    float half_length = 0.5 * path_length;
    float depth = (behind.a + front.a) * half_length;
    float rise = (behind.a - front.a) * half_length;
    float half_mean = mean_transmittance_of_shallow(0.5 * depth);
    float mean = half_mean * (1.0 - 0.25 * depth * half_mean);
    float opacity = opacity_from_mean(depth, mean);
    float square = depth * depth;
    float q = slope_integral(square, rise);
#if EMISSIVE
    float even = mean * (half_length - path_length * rise * q);
    float odd = mean * path_length * depth * q;
#else
    float b = square * (0.0833233951 - 0.0013486739 * square);
    float even = 0.5 * opacity;
    float odd = -mean * (2.0 * rise * q + b);
#endif
    return over(color, vec4((even - odd) * front.rgb + (even + odd) * behind.rgb, opacity));
}

#if SHALLOW
// `color` over an interval on which the medium is linear from `front` to `behind`, or over its start that is shallow
// enough; return what fraction that is of the interval. `front` becomes the medium at the end.
float cross_interval(inout vec4 color, inout vec4 front, vec4 behind, float path_length) {
    color = over_shallow(color, front, behind, path_length);
    front = behind;
    return 1.0;
}
#else
float cross_interval(inout vec4 color, inout vec4 front, vec4 behind, float path_length) {
    float sum = front.a + behind.a;
    float depth = 0.5 * sum * path_length;
    float shallow = depth > 1.0 ? 1.0 / depth : 1.0;
    // Where extinction is linear, the fraction up to an optical depth solves a quadratic equation.
    float root = sqrt(mix(front.a * front.a, behind.a * behind.a, shallow));
    float fraction = shallow * sum / (front.a + root);
    bool is_last = !(depth > 1.0 && color.a <= ENOUGH);  // also if a number is NaN
    vec4 end = is_last ? behind : mix(front, behind, fraction);
    // Behind an opaque medium no colour counts, but numbers must stay finite.
    color = over_shallow(color, front, end, path_length * (is_last ? shallow : fraction));
    crossed_depth += is_last ? depth : 1.0;
    front = end;
    return is_last ? 1.0 : fraction;
}
#endif

#if RAMPS

// Where a path has come.
struct Front {
    float value;
    vec4 medium;                  // at this value
};

Front front_at(float value) {
    return Front(value, medium_of_value(value));
}

// `bend` if it lies behind `value` and before `next`, or else `next`.
float bend_behind(float bend, float value, float next) {
    return bend > value && bend < next ? bend : next;
}

// The next value behind `value` at which a ramp starts or ends, all times `sign`; at most `end`. Ramps end where the
// next one starts.
float next_bend(float sign, float value, float end) {
    float next = end;
    float last;
#define BEND(rise, position, i) next = bend_behind(sign * position.x, value, next); last = position.z;
    EACH_RAMP(BEND)
    next = bend_behind(sign * last, value, next);
    return next;
}

// `color` over a path along which the value is linear from `front` to `behind`, where `front` goes on to: over its
// intervals between the bends. Nothing is added if either value is NaN.
vec4 over_path(vec4 color, inout Front front, float behind, float path_length) {
    // Where values fall, their negatives are counted.
    float sign = behind < front.value ? -1.0 : 1.0;
    float end = sign * behind;
    float value = sign * front.value;
    float rise = end - value;
#if MISSING
    if (!(front.value == front.value) || !(behind == behind)) path_length = 0.0;
#endif
    float left = 1.0;
    for (;;) {
        float next = next_bend(sign, value, end);
        float part = next - value;
        float length = part < rise ? path_length * (part / rise) : path_length;
        float crossed = cross_interval(color, front.medium, medium_of_value(sign * next), left * length);
        bool is_whole = crossed >= 1.0;
        left = is_whole ? 1.0 : left * (1.0 - crossed);
        value = is_whole ? next : value;
        if (is_whole && !(next < end)) break;
    }
    front.value = behind;
    return color;
}

#else

// Where a path has come.
struct Front {
    float value;
    int segment;
};

Front front_at(float value) {
    return Front(value, segment_of(value));
}

// Medium at a value in a segment.
vec4 medium_in(Segment segment, float value) {
    float fraction = fraction_of(segment, value);
    return vec4(color_at(segment, fraction), extinction_at(segment, fraction));
}

// `color` over a path along which the value is linear from `front` to `behind`, where `front` goes on to: over its
// intervals between control points. Nothing is added if either value is NaN.
vec4 over_path(vec4 color, inout Front front, float behind, float path_length) {
    Front last = front_at(behind);
    if (!(front.value == front.value) || !(behind == behind)) path_length = 0.0;
    int step = last.segment < front.segment ? -1 : 1;
    float rise = behind - front.value;
    float value = front.value;
    float left = 1.0;
    vec4 medium = vec4(0.0);
    for (int index = front.segment;;) {
        Segment segment = segment_at(index);
        float next = index == last.segment ? behind : (step > 0 ? segment.end : segment.start);
        float length = path_length * (rise == 0.0 ? 1.0 : clamp((next - value) / rise, 0.0, 1.0));
        if (left == 1.0) medium = medium_in(segment, value);
        bool is_whole = true;
        if (length > 0.0 && is_opaque(segment, max(value, next))) {
            crossed_depth += OPAQUE;
            color = over(color, opaque_color(medium.rgb));
        } else {
            float crossed = cross_interval(color, medium, medium_in(segment, next), left * length);
            is_whole = crossed >= 1.0;
            left = is_whole ? 1.0 : left * (1.0 - crossed);
        }
        if (is_whole && index == last.segment) break;
        if (is_whole) {
            index += step;
            value = next;
        }
    }
    front = last;
    return color;
}

#endif
