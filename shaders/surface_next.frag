#version 330
// The nearest position behind one position and in front of another in a pixel's list, and the colour there. It leaves
// the list: the next one is looked for behind it.
//
// Switches: see surface_lists.glsl and surface_color.glsl.

#include "surface_lists.glsl"
#include "surface_color.glsl"

uniform int picture_width;
uniform sampler2D behind;         // positions behind which one is looked for
uniform sampler2D in_front_of;    // positions in front of which it is looked for

layout(location = 0) out vec4 color;  // premultiplied colour and opacity
layout(location = 1) out vec4 ray_position;

// Bit of a primitive's shape, or 0.
uint bit_of(uint number) {
#if LINES
    return uint(kind_of(int(shape_of[number])).w);
#else
    return 0u;
#endif
}

// Normal of a primitive of which a ray meets the place with these weights of the corners.
vec3 normal_at(int first, vec3 weights) {
#if LIT
    return weights.x * entry(first + 6).xyz + weights.y * entry(first + 7).xyz + weights.z * entry(first + 8).xyz;
#else
    return vec3(0.0);
#endif
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 after = texelFetch(behind, at, 0);
    vec4 before = texelFetch(in_front_of, at, 0);
    uint done = uint(after.w);
    uvec4 found = uvec4(0u);
    bool is_found = false;
    uint before_found = 0u;
    int list = at.y * picture_width + at.x;
    for (uint place = first_hits[list], last = 0u, next; place != 0u; last = place, place = next) {
        uvec4 hit = hits[place - 1u];
        next = hit.x;
        vec2 here = vec2(float(hit.y), uintBitsToFloat(hit.z));
        if (!comes_after(here, after) || !comes_before(here, before)) continue;
        if ((done & bit_of(hit.y)) != 0u) continue;
        before.xy = here;
        found = hit;
        is_found = true;
        before_found = last;
    }
    if (!is_found) discard;
    if (before_found == 0u) first_hits[list] = found.x;
    else hits[before_found - 1u].x = found.x;
    vec2 pixel = pixel_at(gl_FragCoord.xy);
    int shape = int(shape_of[found.y]);
    vec4 kind = kind_of(shape);
    int first = first_texel(int(found.y));
    Meeting meeting;
    meets_primitive(primitive_at(first), kind, pixel, meeting);
    float depth = uintBitsToFloat(found.z);
    color = surface_color(look_of(shape), kind, normal_at(first, meeting.weights), pixel, depth, meeting.position);
    ray_position = vec4(float(found.y), depth, uintBitsToFloat(found.w), float(done | bit_of(found.y)));
}
