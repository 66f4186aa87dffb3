// The brick of a volume that a texture holds, and the part of the box that this brick alone draws.
//
// Switches: BRICKS 1: the texture holds a brick, 0: it holds the whole volume.

#include "held.glsl"
#include "ray.glsl"

#if BRICKS
uniform real3 brick_low;          // the brick's own part of the box; infinite where the box ends
uniform real3 brick_high;
// A texture coordinate is the driver's own product with the number of samples, less whole samples, times a power of
// two: so it is exactly the position that it would be in a texture of the whole volume.
uniform vec3 samples_per_box;
uniform vec3 first_sample;
uniform vec3 textures_per_sample;
vec3 held_samples_per_box = HELD(samples_per_box);
vec3 held_first_sample = HELD(first_sample);
vec3 held_textures_per_sample = HELD(textures_per_sample);

// Interval of depths at which a ray is in the brick's own part: neighbours compute the same depth for a face that
// they share.
real2 brick_interval(Ray ray) {
    return box_interval(ray, brick_low, brick_high);
}
#endif

// True if a position in the box is in the brick's own part.
bool is_in_brick(real3 position) {
#if BRICKS
    return all(greaterThanEqual(position, brick_low)) && all(lessThan(position, brick_high));
#else
    return true;
#endif
}

// Texture coordinates of a position in the box.
vec3 texture_position(vec3 position) {
#if BRICKS
    return (position * held_samples_per_box - held_first_sample) * held_textures_per_sample;
#else
    return position;
#endif
}
