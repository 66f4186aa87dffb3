// What is at a place of the box: a texel, and the gradient where texels hold it.
//
// Switches: BRICKS 1: the texture is a part of the volume. GRADIENT 1: texels are the gradient and the value, 2: the
//           gradient in 16 bits, of which the middle is 0. WEIGHTS 1: matter has a weight, from 0 to 1.
//           MISSING 1: there may be no value.

#include "held.glsl"

uniform sampler3D texels;
#if WEIGHTS
uniform sampler3D weights;        // as the texels lie
#endif
#if BRICKS
// For a place in the texture: the driver's own product with the number of samples, less whole samples, times a power of two.
// So it is exactly where it would be in the texture of the whole.
uniform vec3 samples_per_box;
uniform vec3 first_sample;
uniform vec3 textures_per_sample;
vec3 held_samples_per_box = HELD(samples_per_box);
vec3 held_first_sample = HELD(first_sample);
vec3 held_textures_per_sample = HELD(textures_per_sample);
#endif

// Where in the textures a place of the box is.
vec3 in_texture(vec3 position) {
#if BRICKS
    return (position * held_samples_per_box - held_first_sample) * held_textures_per_sample;
#else
    return position;
#endif
}

vec4 texel_at(vec3 position) {
    position = in_texture(position);
    return textureLod(texels, position, 0.0);
}

#if WEIGHTS
float weight_at(vec3 position) {
    return textureLod(weights, in_texture(position), 0.0).r;
}
#endif

#if GRADIENT
// Components from -1 to 1 are the whole numbers from 0 to 2 NO_GRADIENT of 65535.
const float NO_GRADIENT = 32767.0;

vec3 gradient_of(vec4 texel) {
#if GRADIENT == 2
    return (texel.rgb - NO_GRADIENT / 65535.0) * (65535.0 / NO_GRADIENT);
#else
    return texel.rgb;
#endif
}

#endif

#if MISSING
uniform float missing_from;       // magnitude of texels beyond which there is no value
float held_missing_from = HELD(missing_from);
#endif

// NaN where there is none.
float value_of(vec4 texel) {
#if GRADIENT
    float value = texel.a;
#else
    float value = texel.r;
#endif
#if MISSING
    if (abs(value) > held_missing_from) value = uintBitsToFloat(0x7fc00000u);
#endif
    return value;
}
