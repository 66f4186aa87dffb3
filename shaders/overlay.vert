#version 330
// A corner of a picture in the window, or of a part of the annotation over it.
// PART is 0 for the picture, 1 for a patch of letters and colours, 2 for a line, 3 for all parts without a picture.

uniform vec2 size;       // of the picture in the window, pixels

in vec2 in_position;     // pixels from the upper left corner, downwards
#if PART == 1
in vec2 in_texel;        // of the atlas
#elif PART == 2
in vec4 in_line;         // pixels across the line and along it, its length, its opacity
in vec4 in_kind;         // direction of the line, 1 if it lies behind the medium, opacity of the same line under it
in vec4 in_look;         // colour, linear, and width in pixels
#endif

out vec2 place;          // in the picture, from 0 to 1
#if PART == 1
out vec2 texel_of_atlas;
#elif PART == 2
out vec4 on_line;
flat out vec4 kind;
flat out vec4 look;
#endif

void main() {
    place = in_position / size;
    gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
#if PART == 1
    texel_of_atlas = in_texel;
#elif PART == 2
    on_line = in_line;
    kind = in_kind;
    look = in_look;
#endif
}
