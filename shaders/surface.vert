#version 330
// A corner of a polygon that covers a triangle or a line on the screen, and the numbers of either for the fragments.
//
// Switches: LIT 1: some shapes are lit, and primitives have normals.

in vec2 in_position;     // normalised device coordinates
in vec2 in_numbers;      // of the primitive, and of the shape that it belongs to

uniform sampler2D table; // two texels for each shape, then some for each primitive; see opengl/surfaces/surfaces.py
uniform int table_width;
uniform int shapes;

const int TEXELS = LIT == 1 ? 9 : 6;  // of a primitive

flat out float number;
flat out vec4 look;      // colour and opacity
flat out vec4 kind;      // 1 if the shape is lit; if it is cut; if it is lines; and the bit of the lines, or 0
flat out vec4 high[3];   // the primitive's numbers, and the rest that float32 leaves of them
flat out vec4 low[3];
#if LIT
flat out vec3 normals[3];
#endif

// Texel of the table.
vec4 entry(int index) {
    return texelFetch(table, ivec2(index % table_width, index / table_width), 0);
}

void main() {
    number = in_numbers.x;
    look = entry(2 * int(in_numbers.y));
    kind = entry(2 * int(in_numbers.y) + 1);
    int first = 2 * shapes + TEXELS * int(number);
    for (int i = 0; i < 3; ++i) {
        high[i] = entry(first + i);
        low[i] = entry(first + 3 + i);
#if LIT
        normals[i] = entry(first + 6 + i).xyz;
#endif
    }
    gl_Position = vec4(in_position, 0.0, 1.0);
}
