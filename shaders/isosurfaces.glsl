// The surfaces of several values that a ray meets, composited in order.
//
// Switches: ISOVALUES n: number of the values. DEPTH 1: the depth of the first surface in place of colours.
//           SKIPS 1: slabs that `skips` shows to be without a surface are skipped.
//           LIT, CUE, PERSPECTIVE and those of lights: see seen.glsl. MISSING: see value_pieces.glsl.

#include "value_pieces.glsl"
#include "seen.glsl"
#if SKIPS
#include "skip.glsl"
#endif

uniform vec3 samples;             // of the volume, along x, y and z
uniform vec3 first_corner;        // see extreme_value.glsl
uniform float isovalues[ISOVALUES];
#if !DEPTH
uniform vec4 surface_colors[ISOVALUES];  // straight colour and opacity
#endif

const float ENOUGH = 1.0 / 4194304.0;    // transmittance at which a ray ends, 2^-22
const float NOWHERE_ELSE = 1e30;

// 1 at and above a value, -1 below it, 0 where there is none.
float side_of(float above) {
    return above >= 0.0 ? 1.0 : above < 0.0 ? -1.0 : 0.0;
}

// The piece of a ray between two depths: its cubic, relative to no isovalue.
struct CubicPiece {
    vec4 values;                  // at t = 0, 1, 2 and 3
    vec2 turns;                   // t between FROM and TO, at which it turns, in order
};

CubicPiece cubic_piece(vec4 values) {
#if MISSING
    // Beside an infinity all is infinite: a surface is where that begins or ends.
    if (largest_size(values) > largest_finite) values = vec4(dot(values, vec4(1.0)));
#endif
    vec2 turns = turns_between(values, FROM, TO);
    return CubicPiece(values, vec2(min(turns.x, turns.y), max(turns.x, turns.y)));
}

// How far a piece is above a value where it begins, where it turns, and where it ends.
vec4 above_at_turns(CubicPiece piece, vec4 above) {
    return vec4(
        cubic_between(above, FROM), cubic_between(above, piece.turns.x),
        cubic_between(above, piece.turns.y), cubic_between(above, TO)
    );
}

// True if a ray passes value number `i` at t behind what it passed `last`: t, and number of the value.
bool is_behind(float t, int i, vec2 last) {
    return t > last.x || (t == last.x && float(i) > last.y);
}

// The first t behind `last` at which a piece passes value number `i`; `before` is its side in front of the piece.
float next_pass(CubicPiece piece, int i, float before, vec2 last) {
    float isovalue = isovalues[i];
    vec4 above = piece.values - isovalue;
    vec4 at = above_at_turns(piece, above);
    vec4 sides = vec4(side_of(at.x), side_of(at.y), side_of(at.z), side_of(at.w));
    if (before * sides.x < 0.0 && is_behind(FROM, i, last)) return FROM;
    vec4 ends = vec4(FROM, piece.turns, TO);
    for (int j = 0; j < 3; ++j) {
        if (sides[j] * sides[j + 1] >= 0.0) continue;
        vec2 interval = vec2(ends[j], ends[j + 1]);
        float t = at[j] == 0.0 ? ends[j] : root_between(above, sides[j], interval, sides[j] * vec2(at[j], at[j + 1]));
        if (is_behind(t, i, last)) return t;
    }
    return NOWHERE_ELSE;
}

// Colour and opacity of a surface at a depth on the ray of `pixel`.
vec4 surface_at(BoxWalk walk, int number, float depth, vec2 pixel) {
#if DEPTH
    return vec4(depth, 0.0, 0.0, 1.0);
#else
    vec4 look = surface_colors[number];
    vec3 color = look.rgb;
#if LIT
    vec3 position = walk_position(walk, depth);
    Shade shade = shade_at(gradient_of(texel_at(position)), to_eye_from(pixel), position);
    color = color * shade.diffuse + shade.specular;
#endif
    return cued(vec4(color, 1.0), depth) * look.a;
#endif
}

// A ray on its way: what it has seen so far, and on which side of each value it is, 0 where there is none.
struct Seen {
    vec4 color;
    float sides[ISOVALUES];
};

// True if a ray sees nothing more.
bool is_over(Seen seen) {
    return 1.0 - seen.color.a <= ENOUGH;
}

// Composite the surfaces between two depths, with the values at t = 0, 1, 2 and 3 between them.
void see_piece(BoxWalk walk, vec2 depths, vec4 values, vec2 pixel, inout Seen seen) {
    CubicPiece piece = cubic_piece(values);
    vec2 last = vec2(-NOWHERE_ELSE, 0.0);
    while (!is_over(seen)) {
        float nearest = NOWHERE_ELSE;
        int found = 0;
        for (int i = 0; i < ISOVALUES; ++i) {
            float t = next_pass(piece, i, seen.sides[i], last);
            if (t < nearest) {
                nearest = t;
                found = i;
            }
        }
        if (nearest >= NOWHERE_ELSE) break;
        float depth = mix(depths.x, depths.y, (nearest - FROM) / (TO - FROM));
        vec4 behind = surface_at(walk, found, depth, pixel);
        seen.color += (1.0 - seen.color.a) * behind;
        last = vec2(nearest, float(found));
    }
    for (int i = 0; i < ISOVALUES; ++i) seen.sides[i] = side_of(cubic_between(piece.values - isovalues[i], TO));
}

// Composite the surfaces between two depths.
void see_between(BoxWalk walk, vec2 depths, vec2 pixel, inout Seen seen) {
    SampleWalk planes_walk = sample_walk(walk.start - first_corner, walk.step, samples);
    vec3 planes;
    vec2 box = box_depths(walk);
    float end = min(depths.y, box.y);
    float front = max(depths.x, box.x);
    first_depth(planes_walk, box.x, front, planes);
    vec4 values = vec4(value_at(walk_position(walk, front)));
    while (front < end && !is_over(seen)) {
        float next = min(max(next_depth(planes_walk, box.y, planes), front), end);
        if (next > front) {
            values = values_between(walk, front, next, values.w);
            see_piece(walk, vec2(front, next), values, pixel, seen);
        }
        front = next;
        if (front >= end) break;  // see compositing.glsl
    }
}

// The surfaces as the ray of `pixel` sees them in the slabs that are drawn, or between the `depths` at which these
// begin and end; `looked_at` is the number of slabs in which they were looked for.
vec4 all_surfaces(BoxWalk walk, vec2 slabs, vec2 depths, vec2 pixel, out float looked_at) {
    Seen seen;
    seen.color = vec4(0.0);
    for (int i = 0; i < ISOVALUES; ++i) seen.sides[i] = 0.0;
    looked_at = 0.0;
    float slab = slabs.x;
    float end = ceil(depths.y);
#if SKIPS
    CellWalk cells = cell_walk(walk.start, walk.step);
#endif
    while (slab < end && !is_over(seen)) {
        vec2 run = vec2(slab, end);
#if SKIPS
        run = full_run(cells, slab, end);
        if (run.x == NOWHERE) break;
#endif
        see_between(walk, vec2(max(run.x, depths.x), min(run.y, depths.y)), pixel, seen);
        looked_at += max(min(run.y, slabs.y) - run.x, 0.0);
        slab = run.y;
        if (slab >= end) break;
    }
    return seen.color;
}
