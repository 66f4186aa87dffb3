#version 330
// One pixel's ray through one brick, in which no matter is seen but the values themselves.
//
// Switches: MODE 1: the integral of the value, and the way on which there is one; 2: the largest value, or least;
//                3: the first surface of one value.
//           DEPTH 1: in place of that surface's colour, its depth.
//           MISSING 1: there may be NaN, which is nothing, or infinities, or values far beyond most others; 2: there are
//                infinities, of which none is to be stepped over by the integral.
//           PERSPECTIVE, BRICKS, HALF_SPACES, STRETCH: see ray.glsl. LEAPS 1: what `leaps` shows to be without the surface is leapt over.
//           GRADIENT, LIT, CUE and those of lights: see volume_texture.glsl and seen.glsl.
//           COUNT 1: red is how many slabs were looked at for the surface.

#include "ray.glsl"
#include "volume_texture.glsl"
#include "trilinear.glsl"
#include "seen.glsl"
#if SKIPS
#include "leap.glsl"
#endif

#if MODE == 1
uniform float bias;               // a typical value, or that of air: sums of what differs from it keep their digits
uniform float least;              // of an X-ray of what is above air, the value of that, which lower ones count as
#endif
#define WALKS (MODE != 1 || MISSING == 2)
#if WALKS
uniform vec3 samples;             // of the volume, along x, y and z
#endif
#if MISSING
uniform float largest_finite;     // what is beyond stands for an infinity
#endif
#if MODE == 2
uniform float sign_of_largest;    // -1 where the least is looked for
uniform float largest_of_all;     // times that sign; who has met it is done
#if MISSING
uniform float far_from;           // magnitude of values beside which float32 loses those that most samples have
#endif
#elif MODE == 3
uniform float isovalue;
uniform float same;               // what differs by less may have been the isovalue before it was interpolated
#if MISSING
uniform float far_from;           // distance from the isovalue beside which float32 loses that of most samples
#endif
#if !DEPTH
uniform vec3 surface_color;
#endif
#endif

flat in vec2 slab_range;
out vec4 number;

const float MOST_AT_ONCE = 64.0;  // slabs summed up before they are added to the others: sums of few keep digits
const float NOTHING_YET = -3e38;

bool is_there(float value) {
#if MISSING
    return value == value;
#else
    return true;
#endif
}

float value_at(vec3 position) {
    return value_of(texel_at(position));
}

// The middle of a slab, of which the box may leave a part.
vec3 middle_of(Ray ray, float slab, out float fraction) {
    float front = slab == ray.first_slab ? ray.first_fraction : 0.0;
    float back = slab == ray.last_slab ? ray.last_fraction : 1.0;
    fraction = back - front;
    return ray.start + (slab + 0.5 * (front + back)) * ray.step;
}

#if MODE == 1
// What a share of a slab adds to the integral, to the way, and to the ways along which the value is infinite, and minus that.
vec4 part(float value, float fraction) {
    if (!is_there(value)) return vec4(0.0);
#if MISSING
    if (value > largest_finite) return vec4(0.0, fraction, fraction, 0.0);
    if (value < -largest_finite) return vec4(0.0, fraction, 0.0, fraction);
#endif
    return vec4(fraction * (max(value, least) - bias), fraction, 0.0, 0.0);
}

#if MISSING != 2
vec4 integral_along(Ray ray) {
    float fraction;
    float value = value_at(middle_of(ray, ray.slab, fraction));
    vec4 sum = part(value, fraction);
    float last = ray.end - 1.0;
    float slab = ray.slab + 1.0;
    if (last >= slab) {
        value = value_at(middle_of(ray, last, fraction));
        sum += part(value, fraction);
    }
    // The whole ones between them, two at a time, since the loop itself takes time; at the end there may be one.
    while (slab < last) {
        vec4 some = vec4(0.0);
        float turns_end = min(slab + MOST_AT_ONCE, last);
        while (slab < turns_end) {
            float next = value_at(ray.start + (slab + 1.5) * ray.step);
            some += part(value_at(ray.start + (slab + 0.5) * ray.step), 1.0);
            some += part(next, slab + 1.0 < last ? 1.0 : 0.0);
            slab += 2.0;
            if (slab >= turns_end) break;  // see leap.glsl
        }
        sum += some;
        if (slab >= last) break;
    }
    return sum;
}
#endif
#endif

#if WALKS
// Depth at which the ray enters the box, and at which it leaves.
float front_of(Ray ray) {
    return ray.first_slab + ray.first_fraction;
}

float back_of(Ray ray) {
    return ray.last_slab + ray.last_fraction;
}

// The value from one depth to another with no plane of samples between them, as a cubic in t from FROM to TO.
#if MISSING
// Beside NaN, infinities and far-off values the ends may already be that: looked up in the middles of quarters.
const float FROM = -0.5;
const float TO = 3.5;

bool any_infinite(vec4 values) {
    vec4 size = abs(values);
    return max(max(size.x, size.y), max(size.z, size.w)) > largest_finite;
}
#else
const float FROM = 0.0;
const float TO = 3.0;
#endif

// Values at t = 0, 1, 2 and 3; `at_front` is known where t = 0 is the front.
vec4 values_between(Ray ray, float front, float back, float at_front) {
    vec3 start = ray.start + front * ray.step;
    vec3 direction = ((back - front) / (TO - FROM)) * ray.step;
#if MISSING
    start += 0.5 * direction;
    at_front = value_at(start);
    return vec4(at_front, value_at(start + direction), value_at(start + 2.0 * direction), value_at(start + 3.0 * direction));
#else
    return vec4(at_front, value_at(start + direction), value_at(start + 2.0 * direction), value_at(ray.start + back * ray.step));
#endif
}

#endif

#if MODE == 1 && MISSING == 2
// From one plane between cells to the next: all of such a piece is infinite, or nothing of it. Where air may lie within
// the values it ends with the slab, too, since what is above air is no cubic.
vec4 integral_along(Ray ray) {
    const vec4 FRACTIONS = vec4(13.0, 11.0, 11.0, 13.0) / 48.0;  // of the looks in the mean of the cubic
    SampleWalk walk = sample_walk(ray.start, ray.step, samples);
    vec3 planes;
    float depth = max(ray.slab, front_of(ray));
    float last = min(ray.end, back_of(ray));
    first_depth(walk, depth, depth, planes);
    vec4 sum = vec4(0.0);
    vec4 some = vec4(0.0);
    float pieces = 0.0;
    while (depth < last) {
        float end = least < -largest_finite ? last : min(floor(depth) + 1.0, last);
        float next = max(next_depth(walk, end, planes), depth);
        vec4 values = values_between(ray, depth, next, 0.0);
        vec4 fractions = (next - depth) * FRACTIONS;
        some += part(values.x, fractions.x) + part(values.y, fractions.y);
        some += part(values.z, fractions.z) + part(values.w, fractions.w);
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

#if MODE == 2
#if MISSING
const float ORDINARY = 1.0 / 64.0;       // of `far_from`: most samples are nearer
const float FARTHER = 16.0;              // likewise: before that what is extrapolated is known to a hundredth of most values
const float ROUNDED = 1.0 / 262144.0;    // of the farthest value, 2^-18: more than extrapolation loses
#endif

float largest_along(Ray ray) {
    SampleWalk walk = sample_walk(ray.start, ray.step, samples);
    vec3 planes;
    float depth = first_depth(walk, front_of(ray), max(ray.slab, front_of(ray)), planes);
    vec4 values = vec4(sign_of_largest * value_at(ray.start + depth * ray.step));
    float largest = NOTHING_YET;
#if MISSING
    float vague = NOTHING_YET;
#endif
    while (depth < ray.end && depth < back_of(ray) && largest < largest_of_all) {
        float next = max(next_depth(walk, back_of(ray), planes), depth);
        values = sign_of_largest * values_between(ray, depth, next, sign_of_largest * values.w);
        depth = next;
        float found = largest_of(values, FROM, TO);
#if MISSING
        if (any_infinite(values)) found = max(max(values.x, values.y), max(values.z, values.w));
        // Extrapolated from far below, nothing is left at the ends of what most samples are but float32's rounding.
        float least = min(min(values.x, values.y), min(values.z, values.w));
        if (least < -FARTHER * far_from && found > -max(ORDINARY * far_from, -ROUNDED * least)) {
            vague = max(vague, found);
            found = largest_of(values, 0.0, 3.0);
        }
#endif
        if (is_there(found)) largest = max(largest, found);
    }
#if MISSING
    // Mostly the next cells know better.
    if (largest < -ORDINARY * far_from) largest = max(largest, vague);
#endif
    return largest;
}
#endif

#if MODE == 3
const float POSITIONS = 1.0 / 4194304.0;  // of the box: what float32 leaves of a place in it, 2^-22

// Whether the ray meets the surface in these slabs, or in a cell that they touch; at which depth.
bool meets_surface(Ray ray, vec2 slabs, out float depth) {
    SampleWalk walk = sample_walk(ray.start, ray.step, samples);
    vec3 planes;
    float front = first_depth(walk, front_of(ray), max(slabs.x, front_of(ray)), planes);
    vec4 values = vec4(value_at(ray.start + front * ray.step));
    // How much the depth grows over the longest edge of the box.
    float longest = max(samples.x, max(samples.y, samples.z)) / max(walk.direction.x, max(walk.direction.y, walk.direction.z));
    bool found = false;
#if MISSING
    float before = 0.0;           // how much above the isovalue the ray was, or NaN
#endif
    depth = front;
    while (front < slabs.y && front < back_of(ray) && !found) {
        float next = max(next_depth(walk, back_of(ray), planes), front);
        values = values_between(ray, front, next, values.w);
        vec4 above = values - isovalue;
#if MISSING
        // Beside an infinity everything is: the surface is where that begins or ends.
        if (any_infinite(values)) above = vec4(dot(above, vec4(1.0)));
#endif
        // The end may be a little before the plane at which the value reaches the isovalue and stays there.
        float off = min(POSITIONS * longest / (next - front), 1.0) * (TO - FROM) * abs(above.w - above.z);
        vec2 ends = vec2(FROM, TO);
#if MISSING
        // Beside a far-off sample that would take every value for near, and nothing is left of what is extrapolated.
        vec4 size = abs(above);
        if (max(max(size.x, size.y), max(size.z, size.w)) > far_from) {
            off = 0.0;
            ends = vec2(0.0, 3.0);
        }
#endif
        float t;
        found = first_root(above, ends.x, ends.y, max(same, off), t);
#if MISSING
        // Between two pieces, whose ends are to rounding or of which one is infinite.
        if (before * cubic_between(above, ends.x) < 0.0) {
            found = true;
            t = FROM;
        }
        before = cubic_between(above, ends.y);
#endif
        depth = mix(front, next, (t - FROM) / (TO - FROM));
        front = next;
        if (front >= slabs.y || front >= back_of(ray) || found) break;
    }
    return found;
}

vec4 surface_at(Ray ray, float depth) {
#if DEPTH
    return vec4(depth, 0.0, 0.0, 1.0);
#else
    vec3 position = ray.start + depth * ray.step;
    vec3 color = surface_color;
#if LIT
    vec3 to_eye = to_eye_from(gl_FragCoord.xy - picture_middle);
    Shade shade = shade_at(gradient_of(texel_at(position)), to_eye, position);
    color = color * shade.diffuse + shade.specular;
#endif
    return cued(vec4(color, 1.0), depth);
#endif
}
#endif

void main() {
    Ray ray = ray_through(gl_FragCoord.xy, slab_range);
    if (ray.slab >= ray.end) discard;
#if MODE == 1
    number = integral_along(ray) * ray.obliquity;
#elif MODE == 2
    float largest = largest_along(ray);
    number = vec4(largest, 0.0, 0.0, largest > NOTHING_YET ? 1.0 : 0.0);
#else
    number = vec4(0.0);
    bool found = false;
    float looked_at = 0.0;
    float slab = ray.slab;
#if SKIPS
    CellWalk walk = cell_walk(ray.start, ray.step);
#endif
    while (slab < ray.end && !found) {
        vec2 run = vec2(slab, ray.end);
#if SKIPS
        run = full_run(walk, slab, ray.end);
        if (run.x == NOWHERE) break;
#endif
        float depth;
        found = meets_surface(ray, run, depth);
        if (found) number = surface_at(ray, depth);
        looked_at += (found ? floor(depth) + 1.0 : run.y) - run.x;
        slab = run.y;
        if (slab >= ray.end || found) break;
    }
#if COUNT
    number.r = looked_at;
#else
    if (!found) discard;
#endif
#endif
}
