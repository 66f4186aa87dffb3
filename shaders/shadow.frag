#version 330
// Optical depth between a node of the box and a light, so much of it as lies in one brick; a pixel for each node.
//
// Nodes lie in the middles of a grid of cells: pixel (i, j + k ny) is node (i, j, k). The way is cut into parts of one
// length, and each belongs to the brick in which its middle is. Of several volumes each is a box for itself, and what
// lies in it between a node of any of them and a light adds up.
//
// Switches: POINT 1: the light is at a place, 0: it comes from a direction.
//           ELSEWHERE 1: the nodes are those of another box.
//           HALF_SPACES: how many there are outside of which there is no matter.
//           BRICKS, GRADIENT, WEIGHTS: see volume_texture.glsl. RAMPS, MISSING, EMISSIVE: see classify.glsl.
//           MODULATIONS, GRADED, CONTOURS: see graded.glsl.

#include "volume_texture.glsl"
#include "classify.glsl"
#if MODULATIONS || GRADED || CONTOURS
#include "graded.glsl"
#endif

uniform ivec3 nodes;
#if ELSEWHERE
uniform mat3 box_from_other;      // between the shares of both boxes
uniform vec3 other_corner;
#endif
uniform vec3 to_light;            // where the light is, or the direction to it at length 1; from the middle of the box
uniform mat3 box_from_position;      // of places and directions from the middle of the box, in units of its radius
uniform mat3 position_from_box;
uniform float part_length;        // at most, in those units
uniform float length_per_unit;    // of the transfer function's unit of length
#if HALF_SPACES
uniform vec4 half_spaces[HALF_SPACES];  // as in depths.glsl
#endif
#if BRICKS
uniform vec3 brick_low;
uniform vec3 brick_high;
#endif

out vec4 optical_depth;

// Extinction times length of a part of the way.
float depth_of_part(vec4 texel, float path_length, vec3 position) {
    float value = value_of(texel);
    vec4 medium = medium_of_value(value);
#if MODULATIONS
    medium *= modulation_of(magnitude_of(gradient_of(texel)));
#endif
#if GRADED || CONTOURS
    if (value == value) medium += graded_medium(value, magnitude_of(gradient_of(texel)));
#endif
#if WEIGHTS
    medium.a *= weight_at(position);
#endif
    return medium.a * path_length;
}

bool is_own(vec3 position) {
#if BRICKS
    return all(greaterThanEqual(position, brick_low)) && all(lessThan(position, brick_high));
#else
    return true;
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 start = (vec3(pixel.x, pixel.y % nodes.y, pixel.y / nodes.y) + 0.5) / vec3(nodes);
#if ELSEWHERE
    start = box_from_other * start + other_corner;
#endif
    float farthest = 1e30;
    vec3 direction = to_light;
#if POINT
    direction = to_light - position_from_box * (start - 0.5);
    farthest = length(direction);
    direction /= max(farthest, 1e-30);
#endif
    vec3 direction_in_box = box_from_position * direction;
    // Where it leaves the box: along each axis through the face that it goes to.
    vec3 ahead = mix(start, 1.0 - start, greaterThan(direction_in_box, vec3(0.0)));
    vec3 faces = ahead / max(abs(direction_in_box), vec3(1e-30));
    float whole = min(farthest, min(faces.x, min(faces.y, faces.z)));
    float near = 0.0;
#if ELSEWHERE
    vec3 entries = (ahead - 1.0) / max(abs(direction_in_box), vec3(1e-30));
    near = max(near, max(entries.x, max(entries.y, entries.z)));
#endif
#if HALF_SPACES
    for (int i = 0; i < HALF_SPACES; ++i) {
        float height = dot(half_spaces[i].xyz, start) + half_spaces[i].w;
        float rise = dot(half_spaces[i].xyz, direction_in_box);
        float meets = -height / (abs(rise) < 1e-30 ? 1e-30 : rise);
        if (rise >= 1e-30) near = max(near, meets);
        else if (rise <= -1e-30) whole = min(whole, meets);
        else if (height < 0.0) whole = 0.0;
    }
#endif
    whole = max(whole - near, 0.0);
    float parts = max(ceil(whole / part_length), 1.0);
    float one = whole / parts;

#if RAMPS
    load_ramps();
#endif
    float depth = 0.0;
    for (float part = 0.0; part < parts; part += 1.0) {
        vec3 position = start + (near + (part + 0.5) * one) * direction_in_box;
        float fraction = depth_of_part(texel_at(position), one * length_per_unit, position);
        if (is_own(position)) depth += fraction;
    }
    optical_depth = vec4(depth, 0.0, 0.0, 0.0);
}
