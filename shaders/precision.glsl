// Types `real`, `real2`, `real3` and `real4`: double precision where the driver has it, single precision where it
// has not, or where the program included single_precision.glsl first.

#ifndef real
#extension GL_ARB_gpu_shader_fp64 : enable

#ifdef GL_ARB_gpu_shader_fp64
#define real double
#define real2 dvec2
#define real3 dvec3
#define real4 dvec4
#else
#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
#endif
#endif
