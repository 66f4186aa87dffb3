// Lists of the positions at which rays meet primitives, one for each pixel, in no order.
//
// Switches: those of surface_hit.glsl and surface_table.glsl.

#extension GL_ARB_shader_storage_buffer_object : require
#extension GL_ARB_shading_language_420pack : require

#include "surface_hit.glsl"
#include "surface_table.glsl"

// Places in `hits` of the first one of each pixel, row by row; 0 for none, and counted from 1.
layout(std430, binding = 0) buffer Lists {
    uint hit_count;
    uint first_hits[];
};
// Place of the next one of the pixel, or 0; number of the primitive; depth in float32, and the rest that it leaves.
layout(std430, binding = 1) buffer Hits {
    uvec4 hits[];
};
// Number of the shape that each primitive belongs to.
layout(std430, binding = 2) readonly buffer Shapes {
    uint shape_of[];
};

// The primitive whose texels begin there.
Primitive primitive_at(int first) {
    return Primitive(
        real4(entry(first)) + real4(entry(first + 3)),
        real4(entry(first + 1)) + real4(entry(first + 4)),
        real4(entry(first + 2)) + real4(entry(first + 5))
    );
}
