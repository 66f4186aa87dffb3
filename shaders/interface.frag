#version 330
// Letters, lines and pictures of Dear ImGui: straight colours in sRGB, as its styles are written.

uniform sampler2D picture;

in vec2 fetched_at;
in vec4 tint;

out vec4 color;

void main() {
    color = tint * texture(picture, fetched_at);
}
