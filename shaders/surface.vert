#version 330
// A corner of a polygon that covers a triangle or a line on the screen, and the numbers of either for the fragments.
//
// Switches: LIT 1: some shapes are lit, and primitives have normals.

#include "surface_table.glsl"

in vec2 in_position;     // normalised device coordinates
in vec2 in_numbers;      // of the primitive, and of the shape that it belongs to

flat out float number;
flat out vec4 look;      // see surface_table.glsl
flat out vec4 kind;
flat out vec4 high[3];   // the primitive's numbers, and the rest that float32 leaves of them
flat out vec4 low[3];
#if LIT
flat out vec3 normals[3];
#endif

void main() {
    number = in_numbers.x;
    look = look_of(int(in_numbers.y));
    kind = kind_of(int(in_numbers.y));
    int first = first_texel(int(number));
    for (int i = 0; i < 3; ++i) {
        high[i] = entry(first + i);
        low[i] = entry(first + 3 + i);
#if LIT
        normals[i] = entry(first + 6 + i).xyz;
#endif
    }
    gl_Position = vec4(in_position, 0.0, 1.0);
}
