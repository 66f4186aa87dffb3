#version 330
// Texels of a picture of the same size, times a factor.

uniform sampler2D source;
uniform vec4 factor;

out vec4 texel;

void main() {
    texel = factor * texelFetch(source, ivec2(gl_FragCoord.xy), 0);
}
