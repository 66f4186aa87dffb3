// The transfer function: the medium at a value, and the colour and opacity of a path through it.
//
// A medium is (r, g, b, extinction), where r, g, b is straight colour, or emission if the transfer function has a
// number for it. The function is a sum of ramps where that is exact to rounding, which costs next to nothing for a
// few ramps; otherwise it is a table of segments between control points, in which a grid and a binary search find a
// value. Lengths are in the volume's smallest spacing. Of a distribution of values it is the mean medium, from a table of
// the smoothed function.
//
// Switches: RAMPS n: number of ramps; 0: segments. SPREAD 1: distributions of values, and neither of these.
//           MISSING 1: values may be NaN, where there is no medium.
//           EMISSIVE 0: emission is colour times extinction; 1: emission is a number of its own, 2: likewise, and an
//                    opaque medium shows its straight colour.

#include "optics.glsl"
#include "held.glsl"
#include "interpolated.glsl"

// Stands for an infinite extinction: opaque over any length but 0, and emission is nothing beside it.
const float OPAQUE = 1e24;

// Premultiplied colour and opacity of a path through a medium of straight colour.
vec4 color_of_straight(vec4 medium, float path_length) {
    float opacity = opacity_from_depth(medium.a * path_length);
    return vec4(medium.rgb * opacity, opacity);
}

// The same where r, g, b is emission.
vec4 color_of_glowing(vec4 medium, float path_length) {
    float depth = medium.a * path_length;
    float opacity = opacity_from_depth(depth);
    return vec4(medium.rgb * (path_length * mean_transmittance(depth, opacity)), opacity);
}

#if SPREAD

uniform sampler2D smoothed;       // a row for each width, see textures/distribution.py
uniform float smoothed_low;       // value of the first column
uniform vec2 smoothed_columns;    // places per value, and of the first column
uniform vec2 smoothed_rows;       // likewise of rows
float held_low = HELD(smoothed_low);
vec2 held_columns = HELD(smoothed_columns);
vec2 held_rows = HELD(smoothed_rows);

// There are no ramps to load.
void load_ramps() {
}

// Mean medium of values that are distributed about a mean; 0 at NaN.
vec4 medium_of_spread(float mean, float row) {
    vec2 place = vec2((mean - held_low) * held_columns.x + held_columns.y, row * held_rows.x + held_rows.y);
    vec4 medium = interpolated_entry(smoothed, place);
    return MISSING == 0 || mean == mean ? medium : vec4(0.0);
}

#elif RAMPS

#if RAMPS <= 3  // there is no room for more flat uniforms
flat uniform vec4 ramp_base;      // colour and extinction before the first ramp
flat uniform vec4 ramp_rises[RAMPS];   // what each ramp adds from its start to its end
flat uniform vec3 ramp_positions[RAMPS];  // start, 1 / width and end of each ramp
#else
uniform vec4 ramp_base;
uniform vec4 ramp_rises[RAMPS];
uniform vec3 ramp_positions[RAMPS];
#endif
vec4 held_base = HELD(ramp_base);

#include "each_ramp.glsl"

// Copies of the ramps for the loop over the slabs: Mesa's software driver fetches a uniform anew each time, and
// keeps an array in memory, which makes a sample twice as expensive.
#define DECLARE(rise, position, i) vec4 rise; vec3 position;
EACH_RAMP(DECLARE)

// Fill the copies; to be called before any medium is asked for.
void load_ramps() {
#define LOAD(rise, position, i) rise = ramp_rises[i]; position = ramp_positions[i];
    EACH_RAMP(LOAD)
}

// Medium at a value; 0 at NaN.
vec4 medium_of_value(float value) {
    vec4 medium = held_base;
#define ADD(rise, position, i) medium += rise * clamp((value - position.x) * position.y, 0.0, 1.0);
    EACH_RAMP(ADD)
#if MISSING
    medium = value == value ? medium : vec4(0.0);
#endif
    return medium;
}

#else

uniform sampler2D segments;       // three rows for each 4096 of them, see textures/value_texture.py
uniform sampler2D segment_grid;   // first and last segment in which a value of the cell may lie
uniform float grid_low;
uniform float grid_per_value;
uniform int grid_cells;

struct Segment {
    float start;
    float end;
    float extinction_at_start;
    float extinction_at_end;
    vec3 color_at_start;
    vec3 color_at_end;
    float per_width;              // 1 / (end - start), 0 for steps and the two outer segments
    float opaque;                 // 0, or 1 from its start on, or 2 above its start
};

// There are no ramps to load.
void load_ramps() {
}

vec4 segment_row(int index, int row) {
    return texelFetch(segments, ivec2(index & 4095, (index >> 12) * 3 + row), 0);
}

Segment segment_at(int index) {
    vec4 range = segment_row(index, 0);
    vec4 first = segment_row(index, 1);
    vec4 second = segment_row(index, 2);
    return Segment(range.x, range.y, range.z, range.w, first.rgb, second.rgb, second.a, first.a);
}

// Index of the segment of a value: the number of control points at or below it.
int segment_of(float value) {
    // Clamped before the conversion: a far-off value's cell is beyond all integers.
    int cell = int(clamp((value - grid_low) * grid_per_value, 0.0, float(grid_cells - 1)));
    vec4 range = texelFetch(segment_grid, ivec2(cell, 0), 0);
    int first = int(range.x);
    int last = int(range.y);
    while (first < last) {
        int middle = (first + last) / 2;
        if (value < segment_row(middle, 0).y) last = middle;
        else first = middle + 1;
        if (first >= last) break;  // see compositing.glsl
    }
    return first;
}

// Fraction of its segment at which a value lies, 0 to 1.
float fraction_of(Segment segment, float value) {
    return clamp((value - segment.start) * segment.per_width, 0.0, 1.0);
}

float extinction_at(Segment segment, float fraction) {
    return mix(segment.extinction_at_start, segment.extinction_at_end, fraction);
}

vec3 color_at(Segment segment, float fraction) {
    return mix(segment.color_at_start, segment.color_at_end, fraction);
}

bool is_opaque(Segment segment, float value) {
    return segment.opaque == 1.0 || (segment.opaque == 2.0 && value > segment.start);
}

// Colour and opacity of an opaque medium.
vec4 opaque_color(vec3 color) {
    return vec4(EMISSIVE == 1 ? vec3(0.0) : color, 1.0);
}

// Medium at a value; 0 at NaN.
vec4 medium_of_value(float value) {
    Segment segment = segment_at(segment_of(value));
    float fraction = fraction_of(segment, value);
    vec4 medium = vec4(color_at(segment, fraction), extinction_at(segment, fraction));
    if (is_opaque(segment, value)) medium = vec4(medium.rgb * (EMISSIVE == 2 ? OPAQUE : 1.0), OPAQUE);
    return value == value ? medium : vec4(0.0);
}

#endif
