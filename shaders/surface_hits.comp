#version 330
#extension GL_ARB_compute_shader : require
// Positions at which rays meet primitives, in front of other positions, as lists of the pixels: an invocation for each
// rectangle of pixels in which a primitive is looked for.
//
// Switches: see surface_lists.glsl.

#include "surface_lists.glsl"

// Of each rectangle the number of the primitive, x and y of the first pixel, width and height: 16 bits each.
layout(std430, binding = 3) readonly buffer Rectangles {
    uint rectangles[];
};
// Of opaque primitives only those are kept in front of which no other was met before: the largest key of each pixel.
layout(std430, binding = 4) buffer Nearest {
    uint nearest[];
};
uniform int rectangle_count;
uniform int picture_width;
uniform bool keeps_nearest;       // true: of opaque primitives
uniform sampler2D in_front_of;    // positions in front of which primitives are looked for

layout(local_size_x = 64) in;

// The nearer a depth is, the larger is its key; equal depths have equal ones, also 0 and -0.
uint nearness(float depth) {
    uint bits = depth == 0.0 ? 0u : floatBitsToUint(depth);
    return (bits & 0x80000000u) != 0u ? bits : 0x7fffffffu - bits;
}

uvec2 halves(uint pair) {
    return uvec2(pair & 0xffffu, pair >> 16);
}

// Put a meeting into the list of a pixel, if there is room; it counts in any case.
void keep(Meeting meeting, uint number, ivec2 at) {
    float rounded = float(meeting.depth);
    if (!comes_before(vec2(float(number), rounded), texelFetch(in_front_of, at, 0))) return;
    uint pixel = uint(at.y * picture_width + at.x);
    if (keeps_nearest) {
        uint key = nearness(rounded);
        if (atomicMax(nearest[pixel], key) > key) return;
    }
    uint place = atomicAdd(hit_count, 1u);
    if (place >= uint(hits.length())) return;
    uint next = atomicExchange(first_hits[pixel], place + 1u);
    float rest = float(meeting.depth - real(rounded));
    hits[place] = uvec4(next, number, floatBitsToUint(rounded), floatBitsToUint(rest));
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= uint(rectangle_count)) return;
    uint number = rectangles[3u * index];
    ivec2 corner = ivec2(halves(rectangles[3u * index + 1u]));
    ivec2 size = ivec2(halves(rectangles[3u * index + 2u]));
    vec4 kind = kind_of(int(shape_of[number]));
    Primitive primitive = primitive_at(first_texel(int(number)));
    for (int i = 0; i < size.x * size.y; ++i) {
        ivec2 at = corner + ivec2(i % size.x, i / size.x);
        Meeting meeting;
        if (meets_primitive(primitive, kind, pixel_at(vec2(at) + 0.5), meeting)) keep(meeting, number, at);
    }
}
