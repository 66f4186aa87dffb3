// Opacity, optical depth and transmittance: the twin of texvol/scene/optics.py in float32; a test compares the two.
//
// Switches: SHALLOW 1: no optical depth exceeds 2, so that no exponential is needed.
//
// GLSL promises exp and log only to about 2^-21 near 1, which at 2000 slabs would be 1e-3. So small numbers go through
// a series, and exp and log are called only where their result is of order 1. Terms of a series are summed up in pairs:
// one after the other, each would wait for the one before it.

// (1 - e^-x) / x for x from 0 to 1/2: a minimax polynomial; with coefficients in float32 its error is 1e-8 of the
// result.
float mean_transmittance_of_shallow(float x) {
    float square = x * x;
    float behind = (0.166662888 - 0.0416320484 * x) + square * (0.00819329532 - 0.00112592259 * x);
    return (1.0 - 0.499999865 * x) + square * behind;
}

// 1 - e^-x for x >= 0.
float opacity_from_depth(float x) {
#if SHALLOW
    float opacity = 0.25 * x * mean_transmittance_of_shallow(0.25 * x);
    opacity *= 2.0 - opacity;  // of twice the depth: 1 - (1 - A)², without a difference of equals
    opacity *= 2.0 - opacity;
    return opacity;
#else
    float series = x * mean_transmittance_of_shallow(x);
    return x < 0.5 ? series : 1.0 - exp(-x);
#endif
}

// -log(1 - A) for A in [0, 1]; 1e30 for 1, which is infinitely deep. Below 1/2 it is 2 atanh(y), y = A / (2 - A) <=
// 1/3, by a minimax polynomial with an error of 6e-10 of the result.
float depth_from_opacity(float opacity) {
    float y = opacity / (2.0 - opacity);
    float z = y * y;
    float square = z * z;
    float behind = (0.199994442 + 0.143082984 * z) + square * (0.107153704 + 0.121447789 * z);
    float series = 2.0 * y * ((1.0 + 0.333333378 * z) + square * behind);
    // GLSL leaves the logarithm of 0 undefined.
    return opacity < 0.5 ? series : (opacity < 1.0 ? -log(1.0 - opacity) : 1e30);
}

// -log(1 - A) / A for A from 0 to 0.8873, a depth of 2.18, and no further: a rational minimax function of 1 - A, so
// that hardly anything cancels; its error is 8e-7 of the result, with rounding.
float depth_per_opacity(float opacity) {
    float left = 1.0 - opacity;
    float square = left * left;
    float behind = (1.55249758 + 0.265148534 * left) - 0.0251843742 * square;
    float above = (0.026176642 + 0.605223378 * left) + square * behind;
    return above / ((0.00499737783 + 0.220807502 * left) + square * (1.19805792 + left));
}

// φ(x) = (1 - e^-x) / x, the mean transmittance to a point of a slab, given A = 1 - e^-x; φ(0) = 1.
float mean_transmittance(float x, float opacity) {
    return x > 0.0 ? opacity / x : 1.0;
}

// Front over back, premultiplied (Porter, Duff 1984).
vec4 over(vec4 front, vec4 back) {
    return front + (1.0 - front.a) * back;
}
