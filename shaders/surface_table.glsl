// Table of shapes and primitives: two texels for each shape, then some for each primitive; see
// opengl/surfaces/on_device.py.
//
// Switches: LIT 1: some shapes are lit, and primitives have normals.

uniform sampler2D table;
uniform int table_width;
uniform int shapes;

const int TEXELS = LIT == 1 ? 9 : 6;  // of a primitive: numbers, the rest that float32 leaves of them, normals

// Texel of the table.
vec4 entry(int index) {
    return texelFetch(table, ivec2(index % table_width, index / table_width), 0);
}

// First texel of a primitive.
int first_texel(int number) {
    return 2 * shapes + TEXELS * number;
}

// Colour and opacity of a shape.
vec4 look_of(int shape) {
    return entry(2 * shape);
}

// 1 if a shape is lit; if it is cut; if it is lines; and the bit of the lines, or 0.
vec4 kind_of(int shape) {
    return entry(2 * shape + 1);
}
