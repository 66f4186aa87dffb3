#version 330
// The way from one texel to the next, as the driver interpolates it: see opengl/filtering.py.

#include "interpolated.glsl"

uniform sampler3D texels;         // two of them: 0 and 1
uniform float way_per_pixel;

out float value;

void main() {
    value = interpolated(texels, vec3(0.25 + 0.5 * gl_FragCoord.x * way_per_pixel, 0.5, 0.5)).r;
}
