// What is at a place of the box: a texel, and the gradient where texels hold it.
//
// Switches: BRICKS 1: the texture is a part of the volume. GRADIENT 1: texels are the gradient and the value.

uniform sampler3D texels;
#if BRICKS
// A place in the texture: the driver's own product with the number of samples, less whole samples, times a power of two.
// So it is exactly where it would be in the texture of the whole.
uniform vec3 samples_per_box;
uniform vec3 first_sample;
uniform vec3 textures_per_sample;
#endif

vec4 texel_at(vec3 position) {
#if BRICKS
    position = (position * samples_per_box - first_sample) * textures_per_sample;
#endif
    return textureLod(texels, position, 0.0);
}

#if GRADIENT
uniform vec2 gradient_range;      // texels of 0 and of 1 stand for these

vec3 gradient_of(vec4 texel) {
    return mix(vec3(gradient_range.x), vec3(gradient_range.y), texel.rgb);
}

float value_of(vec4 texel) {
    return texel.a;
}
#else
float value_of(vec4 texel) {
    return texel.r;
}
#endif
