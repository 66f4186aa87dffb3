#version 330
// A corner of a triangle that covers the whole picture.

in vec2 in_position;     // normalised device coordinates

void main() {
    gl_Position = vec4(in_position, 0.0, 1.0);
}
