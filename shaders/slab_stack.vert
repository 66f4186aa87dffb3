#version 330
// One vertex of a polygon that covers the projection of a slab stack, in normalised device coordinates.

in vec2 in_position;     // normalised device coordinates
in vec2 in_slab_range;   // first slab of the stack, and the one after its last

flat out vec2 slab_range;

void main() {
    slab_range = in_slab_range;
    gl_Position = vec4(in_position, 0.0, 1.0);
}
