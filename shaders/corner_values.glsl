// Values along a piece of a ray in one cell of samples, from those at the cell's corners: eight texels are fetched,
// where each of four positions would take eight, and weights are float32's whatever the driver's are.
//
// Switches: those of value_pieces.glsl.

#include "value_pieces.glsl"

// The number at a corner.
vec4 corner(int x, int y, int z) {
    return vec4(stored_value(texelFetch(texels, ivec3(x, y, z), 0)));
}

// Values at t = 0, 1, 2 and 3 of the cubic between two depths with no plane of samples between them.
vec4 values_in_cell(BoxWalk walk, float front, float back) {
    vec3 size = vec3(textureSize(texels, 0));
    vec3 first = lookup_position(walk_position(walk, front)) * size - 0.5;
    vec3 last = lookup_position(walk_position(walk, back)) * size - 0.5;
    vec3 low = floor(0.5 * (first + last));
    ivec3 a = ivec3(clamp(low, vec3(0.0), size - 1.0));
    ivec3 b = ivec3(clamp(low + 1.0, vec3(0.0), size - 1.0));
    first = clamp(first - low, 0.0, 1.0);
    last = clamp(last - low, 0.0, 1.0);
    vec4 t = (vec4(0.0, 1.0, 2.0, 3.0) - FROM) / (TO - FROM);
    vec4 x = mix(vec4(first.x), vec4(last.x), t);
    vec4 y = mix(vec4(first.y), vec4(last.y), t);
    vec4 front_below = mix(corner(a.x, a.y, a.z), corner(b.x, a.y, a.z), x);
    vec4 front_above = mix(corner(a.x, b.y, a.z), corner(b.x, b.y, a.z), x);
    vec4 behind_below = mix(corner(a.x, a.y, b.z), corner(b.x, a.y, b.z), x);
    vec4 behind_above = mix(corner(a.x, b.y, b.z), corner(b.x, b.y, b.z), x);
    vec4 z = mix(vec4(first.z), vec4(last.z), t);
    vec4 values = mix(mix(front_below, front_above, y), mix(behind_below, behind_above, y), z);
    return vec4(value_from(values.x), value_from(values.y), value_from(values.z), value_from(values.w));
}
