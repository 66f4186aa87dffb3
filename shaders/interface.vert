#version 330
// Vertices of Dear ImGui's lists, in window coordinates from the upper left corner.

uniform vec2 window_size;

in vec2 position;
in vec2 texture_position;
in vec4 color;

out vec2 fetched_at;
out vec4 tint;

void main() {
    fetched_at = texture_position;
    tint = color;
    gl_Position = vec4(2.0 * position.x / window_size.x - 1.0, 1.0 - 2.0 * position.y / window_size.y, 0.0, 1.0);
}
