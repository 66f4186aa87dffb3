// Textures, interpolated at a position between their texels and clamped at their edges: by the driver, or in float32
// here, where the driver's weights have too few digits.
//
// Switches: FETCHED 1: texels are fetched and interpolated here.

#if FETCHED
// Texels on the left and the right of a place, counted in texels, and the fraction of the way between them.
void neighbours_of(vec3 place, vec3 size, out ivec3 left, out ivec3 right, out vec3 fraction) {
    vec3 low = floor(place - 0.5);
    fraction = (place - 0.5) - low;
    left = ivec3(clamp(low, vec3(0.0), size - 1.0));
    right = ivec3(clamp(low + 1.0, vec3(0.0), size - 1.0));
}

// Texel at texture coordinates.
vec4 interpolated(sampler3D texels, vec3 position) {
    ivec3 a, b;
    vec3 t;
    vec3 size = vec3(textureSize(texels, 0));
    neighbours_of(position * size, size, a, b, t);
    vec4 front_below = mix(texelFetch(texels, a, 0), texelFetch(texels, ivec3(b.x, a.yz), 0), t.x);
    vec4 front_above = mix(
        texelFetch(texels, ivec3(a.x, b.y, a.z), 0), texelFetch(texels, ivec3(b.xy, a.z), 0), t.x);
    vec4 behind_below = mix(
        texelFetch(texels, ivec3(a.xy, b.z), 0), texelFetch(texels, ivec3(b.x, a.y, b.z), 0), t.x);
    vec4 behind_above = mix(texelFetch(texels, ivec3(a.x, b.yz), 0), texelFetch(texels, b, 0), t.x);
    return mix(mix(front_below, front_above, t.y), mix(behind_below, behind_above, t.y), t.z);
}

// Entry of a table at texture coordinates.
vec4 interpolated_entry(sampler2D table, vec2 position) {
    ivec3 a, b;
    vec3 t;
    vec3 size = vec3(textureSize(table, 0), 1.0);
    neighbours_of(vec3(position, 0.5) * size, size, a, b, t);
    vec4 below = mix(texelFetch(table, a.xy, 0), texelFetch(table, ivec2(b.x, a.y), 0), t.x);
    vec4 above = mix(texelFetch(table, ivec2(a.x, b.y), 0), texelFetch(table, b.xy, 0), t.x);
    return mix(below, above, t.y);
}
#else
vec4 interpolated(sampler3D texels, vec3 position) {
    return textureLod(texels, position, 0.0);
}

vec4 interpolated_entry(sampler2D table, vec2 position) {
    return textureLod(table, position, 0.0);
}
#endif
