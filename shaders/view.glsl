// Pixels, and the depth of the eye.

#include "precision.glsl"

flat uniform real eye_depth;           // nothing in front of it is seen
flat uniform vec2 picture_middle;      // pixels

// Pixel at a position in the window, counted from the middle of the picture.
vec2 pixel_at(vec2 window_position) {
    return window_position - picture_middle;
}
