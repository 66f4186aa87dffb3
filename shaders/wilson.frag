#version 330
// A slab at a pixel: one texel, interpolated. The blending behind this shader composites it.
//
// Switches: FETCHED: see interpolated.glsl.

#include "interpolated.glsl"

uniform sampler3D texels;        // premultiplied colour and opacity of a whole slab
uniform vec4 texel_scale;        // texels are stored relative to this

in vec3 texture_position;
out vec4 slab_color;

void main() {
    slab_color = texel_scale * interpolated(texels, texture_position);
}
