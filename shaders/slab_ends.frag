#version 330
// What a pixel's ray needs beside the polygons of whole slabs: the slabs at its ends, which the box cuts short, and
// which slabs lie between them. slab_stack.glsl draws the same slabs in the same way.
//
// Switches: those of slab_stack.glsl.

#include "stack_walk.glsl"
#include "end_slabs.glsl"

flat in vec2 slab_range;
layout(location = 0) out vec4 whole_range;    // first whole slab, and the one behind the last; both 0 where there is none
layout(location = 1) out vec4 front_color;    // premultiplied colour and opacity of the first slab
layout(location = 2) out vec4 behind_color;   // of the last slab

void main() {
    vec2 slabs;
    BoxWalk walk = stack_walk(gl_FragCoord.xy, slab_range, slab_length, slabs);
    if (slabs.x >= slabs.y) discard;
    prepare_medium(pixel_at(gl_FragCoord.xy));
    Progress progress = Progress(vec4(0.0), slabs.x, slabs.y, 0.0);
    behind_color = last_color(walk, progress);
    behind_color = target_color(behind_color, progress.samples);
    progress.samples = 0.0;
    draw_cap(walk, progress);
    draw_first_slab(walk, progress);
    front_color = target_color(progress.color, progress.samples);
    whole_range = vec4(progress.slab, progress.end, 0.0, 0.0);
}
