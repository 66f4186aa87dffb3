// The first surface of one value that a ray meets.
//
// Switches: DEPTH 1: the depth of the surface in place of its colour.
//           SKIPS 1: slabs that `skips` shows to be without the surface are skipped.
//           LIT, CUE, PERSPECTIVE and those of lights: see seen.glsl. MISSING: see value_pieces.glsl.

#include "value_pieces.glsl"
#include "seen.glsl"
#if SKIPS
#include "skip.glsl"
#endif

uniform vec3 samples;             // of the volume, along x, y and z
uniform vec3 first_corner;        // see extreme_value.glsl
uniform float isovalue;
uniform float same;               // values that differ by less may have been the isovalue before they were interpolated
#if MISSING
uniform float far_from;           // distance from the isovalue beside which float32 loses that of most samples
#endif
#if !DEPTH
uniform vec3 surface_color;
#endif

const float POSITIONS = 1.0 / 4194304.0;  // of the box: what float32 leaves of a position in it, 2^-22

// A piece of a ray, relative to the isovalue.
struct Piece {
    vec4 above;                   // the isovalue, at t = 0, 1, 2 and 3 of the cubic
    vec2 ends;                    // in t, between which the surface is looked for
    float margin;                 // values this near to the isovalue count as it
};

#if MISSING
// True if any of these differences from the isovalue is that of a far-off sample.
bool any_far(vec4 above) {
    return largest_size(above) > far_from;
}
#endif

// The piece between two depths, whose values are at t = 0, 1, 2 and 3; depth grows by `longest` over the longest
// edge of the box.
Piece piece_of(vec4 values, float length, float longest) {
    Piece piece;
    piece.above = values - isovalue;
#if MISSING
    // Beside an infinity all is infinite: the surface is where that begins or ends.
    if (largest_size(values) > largest_finite) piece.above = vec4(dot(piece.above, vec4(1.0)));
#endif
    // The end may be a little before the plane at which the value reaches the isovalue and stays there.
    float off = min(POSITIONS * longest / length, 1.0) * (TO - FROM) * abs(piece.above.w - piece.above.z);
    piece.ends = vec2(FROM, TO);
#if MISSING
    // Beside a far-off sample that would take every value for near, and nothing is left of what is extrapolated.
    if (any_far(piece.above)) {
        off = 0.0;
        piece.ends = vec2(0.0, 3.0);
    }
#endif
    piece.margin = max(same, off);
    return piece;
}

// True if a piece meets the surface, at `t`. `before` is how much the value was above the isovalue at the end of the
// piece in front of it, or NaN, and becomes that of this piece.
bool meets_piece(Piece piece, inout float before, out float t) {
    bool is_met = first_root(piece.above, piece.ends.x, piece.ends.y, piece.margin, t);
#if MISSING
    // Between two pieces, whose ends are equal but for rounding, or of which one is infinite.
    if (before * cubic_between(piece.above, piece.ends.x) < 0.0) {
        is_met = true;
        t = FROM;
    }
    before = cubic_between(piece.above, piece.ends.y);
#endif
    return is_met;
}

// True if the ray meets the surface in these slabs, or in a cell that they touch, at `depth`.
bool meets_surface(BoxWalk walk, vec2 slabs, out float depth) {
    SampleWalk planes_walk = sample_walk(walk.start - first_corner, walk.step, samples);
    vec3 planes;
    vec2 box = box_depths(walk);
    float front = first_depth(planes_walk, box.x, max(slabs.x, box.x), planes);
    vec4 values = vec4(value_at(walk_position(walk, front)));
    vec3 direction = planes_walk.direction;
    float longest = max(samples.x, max(samples.y, samples.z)) / max(direction.x, max(direction.y, direction.z));
    bool is_met = false;
    float before = 0.0;
    depth = front;
    while (front < slabs.y && front < box.y && !is_met) {
        float next = max(next_depth(planes_walk, box.y, planes), front);
        values = values_between(walk, front, next, values.w);
        float t;
        is_met = meets_piece(piece_of(values, next - front, longest), before, t);
        depth = mix(front, next, (t - FROM) / (TO - FROM));
        front = next;
        if (front >= slabs.y || front >= box.y || is_met) break;  // see compositing.glsl
    }
    return is_met;
}

// Colour and opacity of the surface at a depth on the ray of `pixel`; or red is the depth.
vec4 surface_at(BoxWalk walk, float depth, vec2 pixel) {
#if DEPTH
    return vec4(depth, 0.0, 0.0, 1.0);
#else
    vec3 position = walk_position(walk, depth);
    vec3 color = surface_color;
#if LIT
    Shade shade = shade_at(gradient_of(texel_at(position)), to_eye_from(pixel), position);
    color = color * shade.diffuse + shade.specular;
#endif
    return cued(vec4(color, 1.0), depth);
#endif
}

// The surface as the ray of `pixel` sees it in the slabs that are drawn; `is_met` is false where there is none, and
// `looked_at` is the number of slabs in which it was looked for.
vec4 first_surface(BoxWalk walk, vec2 slabs, vec2 pixel, out bool is_met, out float looked_at) {
    vec4 surface = vec4(0.0);
    is_met = false;
    looked_at = 0.0;
    float slab = slabs.x;
#if SKIPS
    CellWalk cells = cell_walk(walk.start, walk.step);
#endif
    while (slab < slabs.y && !is_met) {
        vec2 run = vec2(slab, slabs.y);
#if SKIPS
        run = full_run(cells, slab, slabs.y);
        if (run.x == NOWHERE) break;
#endif
        float depth;
        is_met = meets_surface(walk, run, depth);
        if (is_met) surface = surface_at(walk, depth, pixel);
        looked_at += (is_met ? floor(depth) + 1.0 : run.y) - run.x;
        slab = run.y;
        if (slab >= slabs.y || is_met) break;
    }
    return surface;
}
