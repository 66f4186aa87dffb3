// Intersection of a pixel's ray with a triangle or a line, and the colour there; the formulas are in
// opengl/surfaces/on_screen.py.
//
// A *position* on a ray is the number of a primitive, the depth in float32, the rest that float32 leaves of the
// depth, and as bits the lines that the ray has passed. In a pixel positions are ordered by depth in float32, and at
// one depth by number.
//
// Switches: LINES 1: there are lines. HALF_SPACES: see half_spaces.glsl. PERSPECTIVE 1: rays diverge.
//           POINT_LIGHTS: see light.glsl.

#include "half_spaces.glsl"
#include "pixel_ray.glsl"
#include "view.glsl"

const float TIE = 1.0 / 4096.0;   // pixels; TIE of on_screen.py

// Numbers of a primitive.
struct Primitive {
    real4 a;
    real4 b;
    real4 c;
};

// Where a ray meets a primitive.
struct Meeting {
    real depth;
    vec3 weights;                 // of a triangle's corners
    vec3 position;                // in the box, if anything needs it
};

// True if a weight is inside of an edge; a weight of 0 is so for one of the two triangles at the edge.
bool is_inside(real weight, real4 edge) {
    bool owns = edge.x > 0.0 || (edge.x == 0.0 && (edge.y > 0.0 || (edge.y == 0.0 && edge.z > 0.0)));
    return weight > 0.0 || (weight == 0.0 && owns);
}

// True if the ray of a pixel meets the triangle, at `depth`, where the corners have these weights.
bool meets_triangle(Primitive triangle, real2 pixel, out real depth, out vec3 weights) {
    real4 a = triangle.a;
    real4 b = triangle.b;
    real4 c = triangle.c;
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
bool meets_line(Primitive segment, real2 pixel, out real depth) {
    real4 a = segment.a;
    real4 b = segment.b;
    real radius = segment.c.x;
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

// True if a position comes behind another one, or in front of it.
bool comes_after(vec2 here, vec4 other) {
    return here.y > other.y || (here.y == other.y && here.x > other.x);
}

bool comes_before(vec2 here, vec4 other) {
    return here.y < other.y || (here.y == other.y && here.x < other.x);
}

// True if the ray of `pixel` meets a primitive of a `kind`, see surface_table.glsl, where it can be seen.
bool meets_primitive(Primitive primitive, vec4 kind, vec2 pixel, out Meeting meeting) {
    meeting.weights = vec3(0.0);
    meeting.position = vec3(0.0);
    bool is_met;
#if LINES
    if (kind.z > 0.0) is_met = meets_line(primitive, real2(pixel), meeting.depth);
    else
#endif
    is_met = meets_triangle(primitive, real2(pixel), meeting.depth, meeting.weights);
#if HALF_SPACES || POINT_LIGHTS
    real3 exact_position = position_at(pixel_ray(pixel), meeting.depth);
    is_met = is_met && (kind.y == 0.0 || is_kept(exact_position));
    meeting.position = vec3(exact_position);
#endif
    return is_met && meeting.depth >= eye_depth;
}
