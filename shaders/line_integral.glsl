// The integral of the value along a ray, for X-rays and averages.
//
// Switches: MISSING: see value_pieces.glsl.

#include "value_pieces.glsl"

uniform float bias;               // a typical value, or that of air: sums of the differences from it keep their digits
uniform float least;              // lower values count as this one
#if MISSING == 2
uniform vec3 samples;             // in the box, along x, y and z
uniform vec3 first_corner;        // see extreme_value.glsl
#endif

const float MOST_AT_ONCE = 64.0;  // pieces summed up before they are added to the others: sums of few keep digits

// Integral over a fraction of a slab: of the value less the bias; the path length on which there is a value; and the
// path lengths on which the value is infinite, and minus infinite.
vec4 part_of_integral(float value, float fraction) {
    if (!is_there(value)) return vec4(0.0);
    if (is_infinite(value)) return vec4(0.0, fraction, value > 0.0 ? fraction : 0.0, value > 0.0 ? 0.0 : fraction);
    return vec4(fraction * (max(value, least) - bias), fraction, 0.0, 0.0);
}

// The same over the part of a slab that lies in the box.
vec4 end_of_integral(BoxWalk walk, float slab) {
    vec2 ends = slab_ends(walk, slab);
    float value = value_at(walk_position(walk, slab + 0.5 * (ends.x + ends.y)));
    return part_of_integral(value, ends.y - ends.x);
}

#if MISSING != 2
// The same over the slabs that are drawn, by the value in the middle of each.
vec4 integral_along(BoxWalk walk, vec2 slabs) {
    vec4 sum = end_of_integral(walk, slabs.x);
    float last = slabs.y - 1.0;
    float slab = slabs.x + 1.0;
    if (last >= slab) sum += end_of_integral(walk, last);
    // The whole slabs between them, two at a time, since the loop itself takes time; at the end there may be one.
    while (slab < last) {
        vec4 some = vec4(0.0);
        float most = min(slab + MOST_AT_ONCE, last);
        while (slab < most) {
            float next = value_at(walk_position(walk, slab + 1.5));
            some += part_of_integral(value_at(walk_position(walk, slab + 0.5)), 1.0);
            some += part_of_integral(next, slab + 1.0 < last ? 1.0 : 0.0);
            slab += 2.0;
            if (slab >= most) break;  // see compositing.glsl
        }
        sum += some;
        if (slab >= last) break;
    }
    return sum;
}
#else
// `sum`, and the same over a piece between two planes of samples, by four values.
vec4 with_piece(vec4 sum, BoxWalk walk, float front, float back) {
    const vec4 FRACTIONS = vec4(13.0, 11.0, 11.0, 13.0) / 48.0;  // of the values in the mean of the cubic
    vec4 values = values_between(walk, front, back, 0.0);
    vec4 fractions = (back - front) * FRACTIONS;
    sum += part_of_integral(values.x, fractions.x) + part_of_integral(values.y, fractions.y);
    sum += part_of_integral(values.z, fractions.z) + part_of_integral(values.w, fractions.w);
    return sum;
}

// The same over the slabs that are drawn, from one plane of samples to the next: all of such a piece is infinite, or
// nothing of it. Where there may be air within the values a piece ends with the slab, too: what is above air is no
// cubic.
vec4 integral_along(BoxWalk walk, vec2 slabs) {
    SampleWalk planes_walk = sample_walk(walk.start - first_corner, walk.step, samples);
    vec3 planes;
    vec2 box = box_depths(walk);
    float depth = max(slabs.x, box.x);
    float last = min(slabs.y, box.y);
    first_depth(planes_walk, depth, depth, planes);
    vec4 sum = vec4(0.0);
    vec4 some = vec4(0.0);
    float pieces = 0.0;
    while (depth < last) {
        float end = least < -largest_finite ? last : min(floor(depth) + 1.0, last);
        float next = max(next_depth(planes_walk, end, planes), depth);
        some = with_piece(some, walk, depth, next);
        depth = next;
        pieces += 1.0;
        if (pieces == MOST_AT_ONCE) {
            sum += some;
            some = vec4(0.0);
            pieces = 0.0;
        }
        if (depth >= last) break;
    }
    return sum + some;
}
#endif
