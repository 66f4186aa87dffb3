#version 330
// The depth at which a pixel's ray meets a triangle or a line, and the colour that it sees there; the formulas are in
// opengl/surfaces/on_screen.py.
//
// A *position* on a ray is the number of a primitive, the depth in float32, the rest that float32 leaves of the
// depth, and as bits the lines that the ray has passed. In a pixel positions are ordered by depth in float32, and at
// one depth by number. The same program first finds the depth of the nearest position behind one position and in
// front of another, and then shows the primitive there: so that it finds the same depth to the last bit both times.
//
// Switches: LINES 1: there are lines. HALF_SPACES: see half_spaces.glsl.
//           LIT, CUE, PERSPECTIVE and those of lights: see seen.glsl; without light shapes show their colours.

#include "half_spaces.glsl"
#include "pixel_ray.glsl"
#include "seen.glsl"
#include "view.glsl"

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

const float TIE = 1.0 / 4096.0;   // pixels; TIE of on_screen.py

// Numbers of the primitive.
real4 row(int index) {
    return real4(high[index]) + real4(low[index]);
}

// True if a weight is inside of an edge; a weight of 0 is so for one of the two triangles at the edge.
bool is_inside(real weight, real4 edge) {
    bool owns = edge.x > 0.0 || (edge.x == 0.0 && (edge.y > 0.0 || (edge.y == 0.0 && edge.z > 0.0)));
    return weight > 0.0 || (weight == 0.0 && owns);
}

// True if the ray of a pixel meets the triangle, at `depth`, where the corners have these weights.
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
// True if a pixel is within the width of the line; `depth` is that of the line where it is nearest to the pixel.
bool meets_line(real2 pixel, out real depth) {
    real4 a = row(0);
    real4 b = row(1);
    real radius = row(2).x;
    real2 line = b.xy - a.xy;
    real2 from_start = pixel - a.xy;
    real square = dot(line, line);
    real along = square > 0.0 ? clamp(dot(from_start, line) / square, real(0.0), real(1.0)) : real(0.0);
    real at_a = (real(1.0) - along) * a.z;
    real at_b = along * b.z;
    depth = (at_a * a.w + at_b * b.w) / (at_a + at_b);
    real2 off = from_start - along * line;
    if (along <= 0.0 || along >= 1.0) return dot(off, off) <= radius * radius;
    real across = (line.x * from_start.y - line.y * from_start.x) / sqrt(square);
    return across >= -radius - TIE && across < radius - TIE;
}
#endif

// True if the primitive at a depth comes behind another position, or in front of it.
bool comes_after(float depth, vec4 other) {
    return depth > other.y || (depth == other.y && number > other.x);
}

bool comes_before(float depth, vec4 other) {
    return depth < other.y || (depth == other.y && number < other.x);
}

// Premultiplied colour and opacity of the shape at a position in the box.
vec4 color_at(vec3 weights, vec2 pixel, float depth, vec3 position) {
    vec3 shown = look.rgb;
#if LIT
    if (kind.x > 0.0) {
        vec3 normal = weights.x * normals[0] + weights.y * normals[1] + weights.z * normals[2];
        Shade shade = shade_at(-normal, to_eye_from(pixel), position);
        shown = shown * shade.diffuse + shade.specular;
    }
#endif
    return cued(vec4(shown * look.a, look.a), depth);
}

// True if the ray of `pixel` meets the primitive, at `depth`; and the weights of a triangle's corners there.
bool meets_primitive(real2 pixel, out real depth, out vec3 weights) {
    weights = vec3(0.0);
#if LINES
    if (kind.z > 0.0) return meets_line(pixel, depth);
#endif
    return meets_triangle(pixel, depth, weights);
}

void main() {
    vec2 pixel = pixel_at(gl_FragCoord.xy);
    real depth;
    vec3 weights;
    bool is_met = meets_primitive(real2(pixel), depth, weights);
    vec3 position = vec3(0.0);
#if HALF_SPACES || POINT_LIGHTS
    real3 exact_position = position_at(pixel_ray(pixel), depth);
    is_met = is_met && (kind.y == 0.0 || is_kept(exact_position));
    position = vec3(exact_position);
#endif
    if (!is_met || depth < eye_depth) discard;

    float rounded = float(depth);
    vec4 after = texelFetch(behind, ivec2(gl_FragCoord.xy), 0);
    if (!comes_after(rounded, after)) discard;
    if (!comes_before(rounded, texelFetch(in_front_of, ivec2(gl_FragCoord.xy), 0))) discard;
    uint done = uint(after.w);
    uint bit = uint(kind.w);
    if ((done & bit) != 0u) discard;
    if (finds_depth) {
        color = vec4(rounded);
        ray_position = vec4(0.0);
        return;
    }
    if (rounded != texelFetch(nearest, ivec2(gl_FragCoord.xy), 0).r) discard;
    color = color_at(weights, pixel, rounded, position);
    ray_position = vec4(number, rounded, float(depth - real(rounded)), float(done | bit));
}
