#version 330
// One pixel's ray through one brick, in which no matter is seen but the values themselves.
//
// Switches: MODE 1: the integral of the value, and the way on which there is one; 2: the largest value, or least;
//                3: the first surface of one value.
//           DEPTH 1: in place of that surface's colour, the slab it is in, and the share of the slab in front of it.
//           MISSING 1: there may be NaN, which is nothing.
//           PERSPECTIVE, BRICKS: see ray.glsl. LEAPS 1: what `leaps` shows to be without the surface is leapt over.
//           GRADIENT, LIT, CUE and those of lights: see volume_texture.glsl and seen.glsl.
//           COUNT 1: red is how many slabs were looked at for the surface.

#include "ray.glsl"
#include "volume_texture.glsl"
#include "seen.glsl"
#if LEAPS
#include "leap.glsl"
#endif

#if MODE == 1
uniform float bias;               // a value in the middle of them: sums of what differs from it keep their digits
#elif MODE == 2
uniform float sign_of_largest;    // -1 where the least is looked for
#else
uniform float isovalue;
#if !DEPTH
uniform vec3 surface_color;
#endif
#endif

flat in vec2 slab_range;
out vec4 number;

const float MOST_AT_ONCE = 64.0;  // slabs summed up before they are added to the others: sums of few keep digits
const float NOTHING_YET = -3e38;
const int REFINEMENTS = 12;       // each halves the interval at least, the most take it to float32's rounding

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
vec3 middle_of(Ray ray, float slab, out float share) {
    float front = slab == ray.first_slab ? ray.first_share : 0.0;
    float back = slab == ray.last_slab ? ray.last_share : 1.0;
    share = back - front;
    return ray.start + (slab + 0.5 * (front + back)) * ray.step;
}

#if MODE == 1
// What a share of a slab adds to the integral, and to the way.
vec2 part(float value, float share) {
    return is_there(value) ? share * vec2(value - bias, 1.0) : vec2(0.0);
}

vec2 integral_along(Ray ray) {
    float share;
    float value = value_at(middle_of(ray, ray.slab, share));
    vec2 sum = part(value, share);
    float last = ray.end - 1.0;
    float slab = ray.slab + 1.0;
    if (last >= slab) {
        value = value_at(middle_of(ray, last, share));
        sum += part(value, share);
    }
    // The whole ones between them, two at a time, since the loop itself takes time; at the end there may be one.
    while (slab < last) {
        vec2 some = vec2(0.0);
        float turns_end = min(slab + MOST_AT_ONCE, last);
        while (slab < turns_end) {
            float next = value_at(ray.start + (slab + 1.5) * ray.step);
            some += part(value_at(ray.start + (slab + 0.5) * ray.step), 1.0);
            some += part(next, slab + 1.0 < last ? 1.0 : 0.0);
            slab += 2.0;
        }
        sum += some;
    }
    return sum;
}
#endif

#if MODE == 2
float larger(float largest, vec3 position) {
    float value = value_at(position) * sign_of_largest;
    return is_there(value) ? max(largest, value) : largest;
}

// Over the middles of all slabs, and the faces where the ray enters and leaves the box.
float largest_along(Ray ray) {
    float share;
    float last = ray.end - 1.0;
    float largest = larger(NOTHING_YET, middle_of(ray, ray.slab, share));
    largest = larger(largest, middle_of(ray, last, share));
    if (ray.slab == ray.first_slab) largest = larger(largest, ray.start + (ray.first_slab + ray.first_share) * ray.step);
    if (last == ray.last_slab) largest = larger(largest, ray.start + (ray.last_slab + ray.last_share) * ray.step);
    for (float slab = ray.slab + 1.0; slab < last; slab += 2.0) {
        largest = larger(largest, ray.start + (slab + 0.5) * ray.step);
        largest = larger(largest, ray.start + (min(slab + 1.0, last - 1.0) + 0.5) * ray.step);
    }
    return largest;
}
#endif

#if MODE == 3
// Where between two shares of a slab the value meets the isovalue; `at_front` and `at_back` are what it has more there.
// False position, in which the end that stays twice is counted half (Dowell, Jarratt 1971).
float root_between(vec3 slab_start, vec3 step, float front, float back, float at_front, float at_back) {
    float share = front;
    for (int i = 0; i < REFINEMENTS && at_front != 0.0; ++i) {
        share = front + (back - front) * clamp(at_front / (at_front - at_back), 0.0, 1.0);
        float at_share = value_at(slab_start + share * step) - isovalue;
        if ((at_share < 0.0) == (at_front < 0.0)) {
            front = share;
            at_front = at_share;
            at_back *= 0.5;
        } else {
            back = share;
            at_back = at_share;
            at_front *= 0.5;
        }
        if (at_share == 0.0) break;
    }
    return share;
}

// Whether the ray meets the surface in a slab; where, as a share of it.
bool meets_surface(Ray ray, float slab, float at_front, float at_back, out float share) {
    share = 0.0;
    // NaN is on neither side.
    if (!(at_front <= 0.0 && at_back >= 0.0) && !(at_front >= 0.0 && at_back <= 0.0)) return false;
    float front = slab == ray.first_slab ? ray.first_share : 0.0;
    float back = slab == ray.last_slab ? ray.last_share : 1.0;
    share = root_between(ray.start + slab * ray.step, ray.step, front, back, at_front, at_back);
    return true;
}

vec4 surface_at(Ray ray, float slab, float share) {
#if DEPTH
    return vec4(slab, share, 0.0, 1.0);
#else
    vec3 position = ray.start + slab * ray.step + share * ray.step;
    vec3 color = surface_color;
#if LIT
    vec3 to_eye = to_eye_from(gl_FragCoord.xy - picture_middle);
    Shade shade = shade_at(gradient_of(texel_at(position)), to_eye, position);
    color = color * shade.diffuse + shade.specular;
#endif
    return cued(vec4(color, 1.0), slab + share);
#endif
}
#endif

void main() {
    Ray ray = ray_through(gl_FragCoord.xy, slab_range);
    if (ray.slab >= ray.end) discard;
#if MODE == 1
    number = vec4(integral_along(ray) * ray.obliquity, 0.0, 1.0);
#elif MODE == 2
    float largest = largest_along(ray);
    number = vec4(largest, 0.0, 0.0, largest > NOTHING_YET ? 1.0 : 0.0);
#else
    number = vec4(0.0);
    bool found = false;
    float samples = 0.0;
    float slab = ray.slab;
#if LEAPS
    CellWalk walk = cell_walk(ray.start, ray.step);
#endif
    while (slab < ray.end && !found) {
        vec2 run = vec2(slab, ray.end);
        float known_until = ray.end;
#if LEAPS
        vec2 second;
        vec2 third;
        leap(walk, slab, ray.end, 0.0, run, second, third);
        known_until = min(run.y, ray.end);  // further runs are found again
        if (run.x == NOWHERE) break;
#endif
        slab = run.x;
        float front = slab == ray.first_slab ? ray.first_share : 0.0;
        float at_front = value_at(ray.start + (slab + front) * ray.step) - isovalue;
        while (slab < known_until && !found) {
            float back = slab == ray.last_slab ? ray.last_share : 1.0;
            float at_back = value_at(ray.start + (slab + back) * ray.step) - isovalue;
            float share;
            found = meets_surface(ray, slab, at_front, at_back, share);
            if (found) number = surface_at(ray, slab, share);
            at_front = at_back;
            slab += 1.0;
            samples += 1.0;
        }
    }
#if COUNT
    number.r = samples;
#else
    if (!found) discard;
#endif
#endif
}
