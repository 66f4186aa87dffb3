#version 330
// A corner of the polygon of a slab: where the plane in the middle of the slab meets an edge of the box.

uniform mat4 projection;         // from eye space to clip coordinates

in vec3 in_position;             // eye space
in float in_slab;

flat out float slab;

void main() {
    slab = in_slab;
    gl_Position = projection * vec4(in_position, 1.0);
}
