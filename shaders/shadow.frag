#version 330
// Optical depth between a node of the box and a light, as much of it as lies in one brick; a pixel for each node.
//
// Nodes lie in the middles of a grid of cells: pixel (i, j + k ny) is node (i, j, first_layer + k). The path is cut into parts of
// one length, and each part belongs to the brick in which its middle is. Of several volumes each is a box for
// itself, and the depths between a node of any of them and a light add up.
//
// Switches: POINT 1: the light is at a position, 0: it comes from a direction.
//           ELSEWHERE 1: the nodes are those of another box.
//           HALF_SPACES: see half_spaces.glsl. BRICKS, GRADIENT, WEIGHTS: see volume_texture.glsl.
//           RAMPS, MISSING, EMISSIVE: see classify.glsl. MODULATIONS, GRADED, CONTOURS: see graded.glsl.

#include "single_precision.glsl"
#include "half_spaces.glsl"
#include "volume_texture.glsl"
#include "classify.glsl"
#include "graded.glsl"

uniform ivec3 nodes;
uniform int first_layer;          // of nodes along z, of those that are drawn
#if ELSEWHERE
uniform mat3 box_from_other;      // from fractions of the other box to fractions of this one
uniform vec3 other_corner;
#endif
uniform vec3 to_light;            // position of the light from the middle of the box, or direction to it at length 1
uniform mat3 box_from_position;      // of positions and directions from the middle of the box, in units of its radius
uniform mat3 position_from_box;
uniform float part_length;        // at most, in those units
uniform float length_per_unit;    // of the transfer function's unit of length

out vec4 optical_depth;

// Position in the box of the node of a pixel.
vec3 node_position(ivec2 pixel) {
    vec3 position = (vec3(pixel.x, pixel.y % nodes.y, first_layer + pixel.y / nodes.y) + 0.5) / vec3(nodes);
#if ELSEWHERE
    position = box_from_other * position + other_corner;
#endif
    return position;
}

// Ray from a position in the box to the light, whose depth is the distance in units of the box's radius; and the
// light's depth.
Ray light_ray(vec3 position, out float light_depth) {
    vec3 direction = to_light;
    light_depth = 1e30;
#if POINT
    direction = to_light - position_from_box * (position - 0.5);
    light_depth = length(direction);
    direction /= max(light_depth, 1e-30);
#endif
    return Ray(position, box_from_position * direction);
}

// Interval of depths at which a ray is in the box, which it leaves along each axis through the face that it goes to;
// from a node of another box it may enter.
vec2 depths_in_box(Ray ray) {
    vec3 ahead = mix(ray.position, 1.0 - ray.position, greaterThan(ray.direction, vec3(0.0)));
    vec3 speed = max(abs(ray.direction), vec3(1e-30));
    vec3 exits = ahead / speed;
    vec2 interval = vec2(0.0, min(exits.x, min(exits.y, exits.z)));
#if ELSEWHERE
    vec3 entries = (ahead - 1.0) / speed;
    interval.x = max(0.0, max(entries.x, max(entries.y, entries.z)));
#endif
    return interval;
}

// Optical depth of a part of the ray.
float depth_of_part(vec3 position, float path_length) {
    vec4 texel = texel_at(position);
    float value = value_of(texel);
    float magnitude = magnitude_of(gradient_of(texel));
    vec4 medium = medium_of_value(value);
    medium *= modulation_of(magnitude);
    if (GRADED != 0 || CONTOURS != 0) medium += value == value ? graded_medium(value, magnitude) : vec4(0.0);
    medium.a *= weight_at(position);
    return medium.a * path_length;
}

void main() {
    float light_depth;
    Ray ray = light_ray(node_position(ivec2(gl_FragCoord.xy)), light_depth);
    vec2 interval = depths_in_box(ray);
    interval = kept_interval(vec2(interval.x, min(light_depth, interval.y)), ray);
    float whole = max(interval.y - interval.x, 0.0);
    float parts = max(ceil(whole / part_length), 1.0);
    float one = whole / parts;
    load_ramps();
    float depth = 0.0;
    for (float part = 0.0; part < parts; part += 1.0) {
        vec3 position = position_at(ray, interval.x + (part + 0.5) * one);
        float its_depth = depth_of_part(position, one * length_per_unit);
        if (is_in_brick(position)) depth += its_depth;
    }
    optical_depth = vec4(depth, 0.0, 0.0, 0.0);
}
