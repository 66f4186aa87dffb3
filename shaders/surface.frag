#version 330
// The depth at which a pixel's ray meets a triangle or a line, and the colour that it sees there.
//
// The same program first finds the depth of the nearest position behind one position and in front of another, and
// then shows the primitive there: so that it finds the same depth to the last bit both times.
//
// Switches: see surface_hit.glsl and surface_color.glsl.

#include "surface_hit.glsl"
#include "surface_color.glsl"

uniform bool finds_depth;         // true: find the nearest depth; false: show the primitive there
uniform sampler2D behind;         // positions behind which a primitive is looked for
uniform sampler2D in_front_of;    // positions in front of which it is looked for
uniform sampler2D nearest;        // depths that were found

// See surface.vert.
flat in float number;
flat in vec4 look;
flat in vec4 kind;
flat in vec4 high[3];
flat in vec4 low[3];
#if LIT
flat in vec3 normals[3];
#endif
layout(location = 0) out vec4 color;  // premultiplied colour and opacity; or the depth
layout(location = 1) out vec4 ray_position;

// Numbers of the primitive.
real4 row(int index) {
    return real4(high[index]) + real4(low[index]);
}

void main() {
    vec2 pixel = pixel_at(gl_FragCoord.xy);
    Meeting meeting;
    if (!meets_primitive(Primitive(row(0), row(1), row(2)), kind, pixel, meeting)) discard;

    float rounded = float(meeting.depth);
    vec4 after = texelFetch(behind, ivec2(gl_FragCoord.xy), 0);
    if (!comes_after(vec2(number, rounded), after)) discard;
    if (!comes_before(vec2(number, rounded), texelFetch(in_front_of, ivec2(gl_FragCoord.xy), 0))) discard;
    uint done = uint(after.w);
    uint bit = uint(kind.w);
    if ((done & bit) != 0u) discard;
    if (finds_depth) {
        color = vec4(rounded);
        ray_position = vec4(0.0);
        return;
    }
    if (rounded != texelFetch(nearest, ivec2(gl_FragCoord.xy), 0).r) discard;
    vec3 normal = vec3(0.0);
#if LIT
    normal = meeting.weights.x * normals[0] + meeting.weights.y * normals[1] + meeting.weights.z * normals[2];
#endif
    color = surface_color(look, kind, normal, pixel, rounded, meeting.position);
    ray_position = vec4(number, rounded, float(meeting.depth - real(rounded)), float(done | bit));
}
