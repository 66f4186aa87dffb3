// Twin of texvol/optics.py in float32; a test compares the two.
//
// exp and log are promised only to about 2^-21 near 1, which at 2000 slabs would be 1e-3. So what is small goes
// through a series, and exp and log are called only where their result is of order 1.

// 1 - e^-x for x >= 0. Below 1/2 the Taylor series to x^8 is short by x^9/9!, 5e-9 of the result.
float opacity_from_depth(float x) {
    float series = x * (1.0 + x * (-1.0 / 2.0 + x * (1.0 / 6.0 + x * (-1.0 / 24.0 + x * (1.0 / 120.0
        + x * (-1.0 / 720.0 + x * (1.0 / 5040.0 - x / 40320.0)))))));
    return x < 0.5 ? series : 1.0 - exp(-x);
}

// -log(1 - A) for A in [0, 1]; 1 is infinitely deep.
// Below 1/2: 2 atanh(y), y = A / (2 - A) <= 1/3, whose series to y^15 is short by (1/3)^17 / 17, 1e-9 of the result.
float depth_from_opacity(float opacity) {
    float y = opacity / (2.0 - opacity);
    float z = y * y;
    float series = 2.0 * y * (1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0
        + z * (1.0 / 11.0 + z * (1.0 / 13.0 + z / 15.0)))))));
    // GLSL leaves the logarithm of 0 undefined.
    return opacity < 0.5 ? series : (opacity < 1.0 ? -log(1.0 - opacity) : 1e30);
}

// φ(x) = (1 - e^-x) / x, given A = 1 - e^-x; φ(0) = 1.
float mean_transmittance(float x, float opacity) {
    return x > 0.0 ? opacity / x : 1.0;
}

// front over back, premultiplied.
vec4 over(vec4 front, vec4 back) {
    return front + (1.0 - front.a) * back;
}
