// Single precision under the names of precision.glsl, for a program that includes this file first.

#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
