// Texels of a volume at a position in the box: its value, its gradient where texels hold it, and its weight.
//
// Switches: GRADIENT 1: texels are the gradient and the value, 2: the gradient is in 16 bits, of which the middle is 0.
//           WEIGHTS 1: the medium has a weight from 0 to 1. MISSING 1: values may be missing. BRICKS: see brick.glsl.
//           FETCHED: see interpolated.glsl.

#include "held.glsl"
#include "brick.glsl"
#include "interpolated.glsl"

uniform sampler3D texels;
#if WEIGHTS
uniform sampler3D weights;        // lies as the texels do
#endif
#if MISSING
uniform float missing_from;       // magnitude of texels beyond which the value is missing
float held_missing_from = HELD(missing_from);
#endif

// Texture coordinates at which texels are looked up for a position in the box.
vec3 lookup_position(vec3 position) {
    return texture_position(position);
}

// Texel at a position in the box, interpolated.
vec4 texel_at(vec3 position) {
    return interpolated(texels, lookup_position(position));
}

// Weight of the medium at a position in the box, 0 to 1.
float weight_at(vec3 position) {
#if WEIGHTS
    return interpolated(weights, texture_position(position)).r;
#else
    return 1.0;
#endif
}

// Gradient in a texel, relative to the largest component that texels hold; 0 where they hold none.
vec3 gradient_of(vec4 texel) {
    const float NO_GRADIENT = 32767.0;  // of 65535: components from -1 to 1 are the whole numbers from 0 to twice this
#if GRADIENT == 2
    return (texel.rgb - NO_GRADIENT / 65535.0) * (65535.0 / NO_GRADIENT);
#elif GRADIENT
    return texel.rgb;
#else
    return vec3(0.0);
#endif
}

// The number in a texel that stands for its value.
float stored_value(vec4 texel) {
    return GRADIENT != 0 ? texel.a : texel.r;
}

// The value that a number stands for; NaN where it is missing.
float value_from(float stored) {
#if MISSING
    if (abs(stored) > held_missing_from) stored = uintBitsToFloat(0x7fc00000u);
#endif
    return stored;
}

// Value in a texel; NaN where it is missing.
float value_of(vec4 texel) {
    return value_from(stored_value(texel));
}
