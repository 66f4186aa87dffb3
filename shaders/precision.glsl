// Double precision where the driver has it, under names that hold without it as well.

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
