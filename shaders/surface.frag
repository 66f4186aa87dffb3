#version 330
// Where a pixel's ray meets a triangle or a line, and what it sees there; the formulas are in geometry/on_screen.py.
//
// A *place* is the number of a primitive, its depth in float32 and what that leaves of it, and as bits the lines that are
// done with. In a pixel places follow each other by depth in float32, and at one depth by number. The same program first
// finds the depth of the nearest place behind one and in front of another, and then shows what is there: so that it
// finds the same depth to the last bit both times.
//
// Switches: LINES 1: there are lines. HALF_SPACES: see depths.glsl.
//           LIT, CUE, PERSPECTIVE and those of lights: see seen.glsl; without light shapes show their colours.

#include "precision.glsl"
#include "seen.glsl"

uniform bool finds_depth;         // or shows what is at the nearest depth
uniform sampler2D behind;         // the place behind which
uniform sampler2D in_front_of;    // and that in front of which
uniform sampler2D nearest;        // depth
uniform vec2 picture_middle;      // pixels
uniform float eye_depth;
#if HALF_SPACES || POINT_LIGHTS
// As in ray.glsl.
uniform real3 point;
uniform real3 point_per_column;
uniform real3 point_per_row;
uniform real3 velocity;
#if PERSPECTIVE
uniform real3 velocity_per_column;
uniform real3 velocity_per_row;
#endif
#endif
#if HALF_SPACES
uniform real4 half_spaces[HALF_SPACES];
#endif

// See surface.vert.
flat in float number;
flat in vec4 look;
flat in vec4 kind;
flat in vec4 high[3];
flat in vec4 low[3];
#if LIT
flat in vec3 normals[3];
#endif
layout(location = 0) out vec4 color;  // premultiplied; or the depth
layout(location = 1) out vec4 position_out;

const float TIE = 1.0 / 4096.0;   // TIE of on_screen.py

real4 row(int index) {
    return real4(high[index]) + real4(low[index]);
}

// Whether a weight of 0 counts as inside: it does on one side of an edge.
bool is_inside(real weight, real4 edge) {
    bool owns = edge.x > 0.0 || (edge.x == 0.0 && (edge.y > 0.0 || (edge.y == 0.0 && edge.z > 0.0)));
    return weight > 0.0 || (weight == 0.0 && owns);
}

// Depth at which the ray meets the triangle, if it does, and the weights of its corners.
bool meets_triangle(real2 pixel, out real depth, out vec3 weights) {
    real4 a = row(0);
    real4 b = row(1);
    real4 c = row(2);
    real at_a = a.x * pixel.x + a.y * pixel.y + a.z;
    real at_b = b.x * pixel.x + b.y * pixel.y + b.z;
    real at_c = c.x * pixel.x + c.y * pixel.y + c.z;
    real sum = at_a + at_b + at_c;
    depth = (at_a * a.w + at_b * b.w + at_c * c.w) / sum;
    weights = vec3(at_a / sum, at_b / sum, at_c / sum);
    return is_inside(at_a, a) && is_inside(at_b, b) && is_inside(at_c, c) && sum > 0.0;
}

#if LINES
// Depth of the line where it is nearest to the pixel, if that is within its width.
bool meets_line(real2 pixel, out real depth) {
    real4 a = row(0);
    real4 b = row(1);
    real radius = row(2).x;
    real2 direction = b.xy - a.xy;
    real2 from_start = pixel - a.xy;
    real square = dot(direction, direction);
    real along = square > 0.0 ? clamp(dot(from_start, direction) / square, real(0.0), real(1.0)) : real(0.0);
    real at_a = (real(1.0) - along) * a.z;
    real at_b = along * b.z;
    depth = (at_a * a.w + at_b * b.w) / (at_a + at_b);
    real2 off = from_start - along * direction;
    if (along <= 0.0 || along >= 1.0) return dot(off, off) <= radius * radius;
    real across = (direction.x * from_start.y - direction.y * from_start.x) / sqrt(square);
    return across >= -radius - TIE && across < radius - TIE;
}
#endif

// Where a primitive comes at a depth, beside a place.
bool comes_after(float depth, vec4 other) {
    return depth > other.y || (depth == other.y && number > other.x);
}

bool comes_before(float depth, vec4 other) {
    return depth < other.y || (depth == other.y && number < other.x);
}

#if HALF_SPACES || POINT_LIGHTS
// In the box.
real3 position_at(real2 pixel, real depth) {
    real3 direction = velocity;
#if PERSPECTIVE
    direction += pixel.x * velocity_per_column + pixel.y * velocity_per_row;
#endif
    return point + pixel.x * point_per_column + pixel.y * point_per_row + depth * direction;
}
#endif

bool is_kept(real2 pixel, real depth) {
#if HALF_SPACES
    real3 position = position_at(pixel, depth);
    for (int i = 0; i < HALF_SPACES; ++i) {
        if (dot(half_spaces[i].xyz, position) + half_spaces[i].w < 0.0) return false;
    }
#endif
    return true;
}

// Premultiplied colour and opacity of the shape.
vec4 color_at(vec3 weights, vec2 pixel, real depth) {
    vec3 shown = look.rgb;
#if LIT
    if (kind.x > 0.0) {
        vec3 normal = weights.x * normals[0] + weights.y * normals[1] + weights.z * normals[2];
        vec3 position = vec3(0.0);
#if POINT_LIGHTS
        position = vec3(position_at(real2(pixel), depth));
#endif
        Shade shade = shade_at(-normal, to_eye_from(pixel), position);
        shown = shown * shade.diffuse + shade.specular;
    }
#endif
    return cued(vec4(shown * look.a, look.a), float(depth));
}

void main() {
    vec2 pixel = gl_FragCoord.xy - picture_middle;
    real depth;
    vec3 weights = vec3(0.0);
    bool met;
#if LINES
    if (kind.z > 0.0) met = meets_line(real2(pixel), depth);
    else
#endif
    met = meets_triangle(real2(pixel), depth, weights);
    if (!met || depth < eye_depth || (kind.y > 0.0 && !is_kept(real2(pixel), depth))) discard;

    float rounded = float(depth);
    vec4 after = texelFetch(behind, ivec2(gl_FragCoord.xy), 0);
    if (!comes_after(rounded, after)) discard;
    if (!comes_before(rounded, texelFetch(in_front_of, ivec2(gl_FragCoord.xy), 0))) discard;
    uint done = uint(after.w);
    uint bit = uint(kind.w);
    if ((done & bit) != 0u) discard;
    if (finds_depth) {
        color = vec4(rounded);
        position_out = vec4(0.0);
        return;
    }
    if (rounded != texelFetch(nearest, ivec2(gl_FragCoord.xy), 0).r) discard;
    color = color_at(weights, pixel, depth);
    position_out = vec4(number, rounded, float(depth - real(rounded)), float(done | bit));
}
