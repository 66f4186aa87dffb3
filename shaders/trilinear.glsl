// The value along a ray: between two planes through sample centres it is a cubic, since it is interpolated trilinearly.

// A ray among planes of samples. Coordinates count samples and grow along the ray, which is mirrored where it goes
// downwards; so the planes are at whole numbers.
struct SampleWalk {
    vec3 start;                   // position at depth 0
    vec3 direction;               // change of position per unit of depth, not negative
    vec3 depth_per_sample;
    vec3 sign;                    // -1 where the ray goes downwards
};

// The ray that is at `start` at depth 0, in the box, and goes on by `step` per slab; the box has so many `samples`
// along its edges.
SampleWalk sample_walk(vec3 start, vec3 step, vec3 samples) {
    vec3 sign = mix(vec3(-1.0), vec3(1.0), greaterThanEqual(step, vec3(0.0)));
    SampleWalk walk;
    walk.start = sign * (start * samples - 0.5);
    walk.direction = sign * step * samples;
    walk.depth_per_sample = 1.0 / max(walk.direction, vec3(1e-30));
    walk.sign = sign;
    return walk;
}

// Depth of the last plane before `depth`, but at least `least`; `planes` become the first planes behind it.
float first_depth(SampleWalk walk, float least, float depth, out vec3 planes) {
    planes = floor(walk.start + depth * walk.direction) + 1.0;
    vec3 depths = (planes - 1.0 - walk.start) * walk.depth_per_sample;
    return clamp(max(depths.x, max(depths.y, depths.z)), least, depth);
}

// Depth at which the ray meets the first of `planes`, but at most `end`; `planes` become those behind it.
float next_depth(SampleWalk walk, float end, inout vec3 planes) {
    vec3 depths = (planes - walk.start) * walk.depth_per_sample;
    float depth = min(min(depths.x, min(depths.y, depths.z)), end);
    planes += mix(vec3(0.0), vec3(1.0), lessThanEqual(depths, vec3(depth)));
    return depth;
}

// The cubic in t that has these values at t = 0, 1, 2 and 3, in Newton's form: sums of it keep the values' digits.
vec4 cubic_through(vec4 values) {
    vec3 rise = values.yzw - values.xyz;
    vec2 bend = rise.yz - rise.xy;
    return vec4(values.x, rise.x, bend.x / 2.0, (bend.y - bend.x) / 6.0);
}

// Value of a cubic in Newton's form at t.
float cubic_at(vec4 cubic, float t) {
    return cubic.x + t * (cubic.y + (t - 1.0) * (cubic.z + (t - 2.0) * cubic.w));
}

// Value at t of the cubic that has these values at t = 0, 1, 2 and 3, from the end that is nearer: beside one end it
// keeps the digits of the value there, however far off the other value is.
float cubic_between(vec4 values, float t) {
    return t < 1.5 ? cubic_at(cubic_through(values), t) : cubic_at(cubic_through(values.wzyx), 3.0 - t);
}

// The t at which a cubic turns down, and the t at which it turns up; any numbers, but not NaN, where it does not turn.
vec2 turns_of(vec4 cubic) {
    // The slope is b + 2 c t + 3 d t². They are divided by the largest, so that no square leaves float32.
    float b = cubic.y - cubic.z + 2.0 * cubic.w;
    float c = cubic.z - 3.0 * cubic.w;
    float d = cubic.w;
    float largest = max(max(abs(b), abs(c)), max(abs(d), 1e-37));
    b /= largest;
    c /= largest;
    d /= largest;
    float root = sqrt(max(c * c - 3.0 * b * d, 0.0));
    // (-c ∓ root) / 3 d is b / (-c ± root): of each the one in which nothing cancels.
    float sum = max(abs(c) + root, 1e-30);
    float near = (c > 0.0 ? -b : b) / sum;
    float far = (c > 0.0 ? -sum : sum) / (abs(d) > 1e-30 ? 3.0 * d : 1e-30);
    return c > 0.0 ? vec2(far, near) : vec2(near, far);
}

// The t from `from` to `to` at which the cubic that has these values at t = 0, 1, 2 and 3 turns down, and turns up.
vec2 turns_between(vec4 values, float from, float to) {
    return clamp(turns_of(cubic_through(values)), from, to);
}

// The largest value from one t to another of the cubic that has these values at t = 0, 1, 2 and 3.
float largest_of(vec4 values, float from, float to) {
    float peak = cubic_between(values, turns_between(values, from, to).x);
    return max(peak, max(cubic_between(values, from), cubic_between(values, to)));
}

// Root of `side` times the cubic that has these values, which falls from `at.x` > 0 to `at.y` < 0 over an interval, by
// false position, in which the end that stays twice is counted half (Dowell, Jarratt 1971).
float root_between(vec4 values, float side, vec2 interval, vec2 at) {
    const int MOST_STEPS = 24;    // each halves the interval at least every other time
    float root = interval.y;
    for (int i = 0; i < MOST_STEPS && at.x > 0.0 && at.y < 0.0 && interval.x < interval.y; ++i) {
        root = mix(interval.x, interval.y, at.x / (at.x - at.y));
        float there = side * cubic_between(values, root);
        if (there > 0.0) {
            interval.x = root;
            at = vec2(there, 0.5 * at.y);
        } else {
            interval.y = root;
            at = vec2(0.5 * at.x, there);
        }
    }
    return root;
}

// True if the cubic that has these values at t = 0, 1, 2 and 3 comes within `margin` of 0, or passes it, from one t
// to another; `root` is where it does so first.
bool first_root(vec4 values, float from, float to, float margin, out float root) {
    vec2 turns = turns_between(values, from, to);
    // Of the three intervals on which the cubic only rises or only falls, the first that ends on the other side.
    float side = cubic_between(values, from) < 0.0 ? -1.0 : 1.0;
    vec4 ends = vec4(from, min(turns.x, turns.y), max(turns.x, turns.y), to);
    vec4 above = side * vec4(
        cubic_between(values, ends.x), cubic_between(values, ends.y),
        cubic_between(values, ends.z), cubic_between(values, ends.w)
    );
    bvec4 met = lessThanEqual(above, vec4(margin));
    root = from;
    if (met.x || !any(met)) return met.x;
    vec2 interval = met.y ? ends.xy : met.z ? ends.yz : ends.zw;
    vec2 at = met.y ? above.xy : met.z ? above.yz : above.zw;
    root = root_between(values, side, interval, at);
    return true;
}
