// The transfer function integrated along a slab on which the value goes linearly from one end to the other.

#include "classify.glsl"

// Abscissae and weights of Gauss and Legendre for three points on [0, 1].
const vec3 GAUSS_AT = vec3(0.11270166537925831, 0.5, 0.8872983346207417);
const vec3 GAUSS_WEIGHT = vec3(0.2777777777777778, 0.4444444444444444, 0.2777777777777778);

const vec3 LAGUERRE_AT = vec3(0.41577455678347908, 2.2942803602790417, 6.2899450829374792);
const vec3 LAGUERRE_WEIGHT = vec3(0.71109300992917302, 0.27851773356924085, 0.010389256501586136);

// How far along a stretch matter is seen on average, in shares of the stretch, weighted with what is seen: the mean of
// t(A) over the opacities A from 0 to that of the whole stretch, where t is where the depth in front is -log(1 - A).
// Extinction is linear, so that t solves a quadratic equation.
float mean_place(float extinction_in_front, float extinction_behind, float depth, float opacity) {
    float mean = 0.0;
    float squares = extinction_behind * extinction_behind - extinction_in_front * extinction_in_front;
    for (int i = 0; i < 3; ++i) {
        float in_front = opacity * GAUSS_AT[i];
        float share = depth_from_opacity(in_front) / depth;
        float root = sqrt(max(extinction_in_front * extinction_in_front + squares * share, 0.0));
        mean += GAUSS_WEIGHT[i] * min(share * (extinction_in_front + extinction_behind) / (extinction_in_front + root), 1.0);
    }
    return mean;
}

// ∫ E e^-depth over a stretch of length L on which emission and extinction are linear, in parts of depth 1 on average:
// three points leave x^7 / 2016000 of a part of depth x. What lies behind a depth of 24 adds 4e-11.
vec3 emissive_color(vec3 front, vec3 behind, float extinction_in_front, float extinction_behind, float path_length) {
    float depth = 0.5 * (extinction_in_front + extinction_behind) * path_length;
    if (depth > 64.0 && extinction_in_front > 0.1 * extinction_behind) {
        // Dense from the start: ∫ E/τ e^-u du over the depth u, by three points of Gauss and Laguerre.
        vec3 deep = vec3(0.0);
        for (int i = 0; i < 3; ++i) {
            float share = LAGUERRE_AT[i] / depth;
            float root = sqrt(mix(extinction_in_front * extinction_in_front, extinction_behind * extinction_behind, share));
            float t = share * (extinction_in_front + extinction_behind) / (extinction_in_front + root);
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

float way_depth;                  // optical depth of all stretches since it was last set to 0

// Colour and opacity of a stretch within one segment, from value `front` to value `behind`.
vec4 stretch_color(Segment segment, float front, float behind, float path_length) {
    float share_front = share_of(segment, front);
    float share_behind = share_of(segment, behind);
    float tau_front = extinction_at(segment, share_front);
    float tau_behind = extinction_at(segment, share_behind);
    vec3 color_front = color_at(segment, share_front);
    vec3 color_behind = color_at(segment, share_behind);
    float depth = 0.5 * (tau_front + tau_behind) * path_length;
    float opacity = opacity_from_depth(depth);
    way_depth += depth;
#if EMISSIVE
    return vec4(emissive_color(color_front, color_behind, tau_front, tau_behind, path_length), opacity);
#else
    if (depth <= 0.0) return vec4(0.0);
    return vec4(mix(color_front, color_behind, mean_place(tau_front, tau_behind, depth, opacity)) * opacity, opacity);
#endif
}

// Colour and opacity of a slab along which the value goes linearly from `front` to `behind`: its stretches between
// control points, composited. NaN on either side is nothing.
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
        float share = behind == front ? 1.0 : clamp((next - value) / (behind - front), 0.0, 1.0);
        if (share > 0.0) {
            if (is_opaque(segment, max(value, next))) {
                way_depth += OPAQUE;
                return over(color, opaque_color(color_at(segment, share_of(segment, value))));
            }
            color = over(color, stretch_color(segment, value, next, path_length * share));
        }
        if (index == last) return color;
        value = next;
    }
}
