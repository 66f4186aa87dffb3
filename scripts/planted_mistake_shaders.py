"""Mistakes in the shaders."""

from __future__ import annotations

from planted_mistake_sources import Mistake

_TEXEL_AT = "vec4 texel_at(vec3 position)"


def _wrong(signature: str, body: str, words: str, tests: str) -> Mistake:
    """A function of a shader with another body, which may call the right one."""
    return Mistake("shaders", signature, "", body, words, tests)


def _changed(file: str, old: str, new: str, words: str, tests: str) -> Mistake:
    """Another text in a file that has no function but main."""
    return Mistake("shaders", file, old, new, words, tests)


IN_SHADERS = (
    _wrong(
        "float opacity_from_depth(float x)",
        "return min(x, 1.0);",
        "opacity is the optical depth",
        "test_optics.py -k 'shader'",
    ),
    _wrong(
        "float depth_from_opacity(float opacity)",
        "return -log(max(1.0 - opacity, 1e-30));",
        "the depth of a small opacity loses its digits",
        "test_optics.py -k 'shader'",
    ),
    _wrong(
        "vec4 over(vec4 front, vec4 back)",
        "return over_right(back, front);",
        "slabs are composited from back to front",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        _TEXEL_AT,
        "return textureLod(texels, in_texture(position) + 0.5 / vec3(textureSize(texels, 0)), 0.0);",
        "texels are looked up half a texel off",
        "test_render.py",
    ),
    _wrong(
        _TEXEL_AT,
        "return textureLod(texels, in_texture(position).zyx, 0.0);",
        "two axes of the volume are swapped",
        "test_render.py",
    ),
    _wrong(
        "float weight_at(vec3 position)",
        "return 1.0 - weight_at_right(position);",
        "a mask shows what it hides",
        "test_masks_drawn.py -k 'closed_form'",
    ),
    _wrong(
        "float obliquity_of(vec2 pixel)",
        "return 1.0 + 1e-20 * obliquity_of_right(pixel);",
        "oblique rays cross slabs no longer than the middle one",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        "Ray ray_through(vec2 place, vec2 slab_range)",
        "Ray ray = ray_through_right(place, slab_range); ray.first_share = 0.0; ray.last_share = 1.0; return ray;",
        "slabs at the box's faces count whole",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        "BoxWalk box_walk(vec2 pixel, float obliquity, real2 seen, bool is_cut)",
        "BoxWalk walk = box_walk_right(pixel, obliquity, seen, is_cut); walk.last_share = 1.0; return walk;",
        "the last slab of each of several volumes counts whole",
        "test_several_drawn.py",
    ),
    _wrong(
        "real2 depths_between_planes(real2 inside, real low, real high, real position, real way)",
        "return depths_between_planes_right(inside, low, 0.9 * high, position, way);",
        "the box ends before its upper faces",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        "real3 position_of(vec2 pixel)",
        "return position_of_right(pixel + 0.5);",
        "rays start half a pixel off",
        "test_render.py",
    ),
    _wrong(
        "vec4 color_of_straight(vec4 matter, float path_length)",
        "vec4 right = color_of_straight_right(matter, path_length); return vec4(matter.rgb, right.a);",
        "straight colour is not multiplied by opacity",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        "float mean_place(float extinction_in_front, float extinction_behind, float depth, float opacity)",
        "return 0.5 + 1e-20 * mean_place_right(extinction_in_front, extinction_behind, depth, opacity);",
        "the colour of a slab is that of its middle",
        "test_render_convergence.py test_orders.py test_closed_forms_drawn.py -k 'integrated'",
    ),
    _wrong(
        "vec2 take_run(inout Runs runs, float base)",
        "vec2 run = take_run_right(runs, base); return vec2(run.x + 1.0, run.y);",
        "a run of slabs begins one slab late",
        "test_empty_space.py -k 'skipping or leaping or changes'",
    ),
    _wrong(
        "vec3 normal_of(vec3 gradient, float magnitude)",
        "return normal_of_right(-gradient, magnitude);",
        "normals point to higher values",
        "test_light_drawn.py -k 'lit_by_the_formula'",
    ),
    _wrong(
        "vec3 lit_normal(vec3 normal, vec3 to_eye)",
        "return normal;",
        "only one side of a surface is lit",
        "test_light_drawn.py -k 'lit_by_the_formula'",
    ),
    _wrong(
        "float left_of_light(int number, vec3 place, vec3 to_light)",
        "return left_of_light_right(number, place, -to_light);",
        "shadows are looked up on the far side of a place",
        "test_shadows.py -k 'falls_off or nearer_to_the_light'",
    ),
    _wrong(
        "vec4 modulated(vec4 matter, float factor)",
        "return matter * vec4(vec3(factor), 1.0);",
        "the gradient modulates colour in place of extinction",
        "test_graded_drawn.py -k 'modulat'",
    ),
    _wrong(
        "float contour_distance(float value, float magnitude, vec3 place)",
        "return contour_distance_right(value, 0.1 + 1e-6 * magnitude, place);",
        "a contour has the same width in values everywhere",
        "test_graded_drawn.py -k 'contour'",
    ),
    _wrong(
        "vec4 cued(vec4 color, float depth)",
        "return cued_right(cued_right(color, depth), depth);",
        "a depth cue is applied twice",
        "test_light_drawn.py -k 'depth_cue'",
    ),
    _wrong(
        "SampleWalk sample_walk(vec3 start, vec3 step, vec3 samples)",
        "return sample_walk_right(start + 0.5 / samples, step, samples);",
        "planes of samples lie half a sample off",
        "test_projection_drawn.py -k 'extremes_are_exact'",
    ),
    _wrong(
        "vec2 turns_between(vec4 values, float from, float to)",
        "return vec2(from);",
        "no maximum is looked for between planes of samples",
        "test_projection_drawn.py -k 'extremes_are_exact'",
    ),
    _wrong(
        "vec4 part(float value, float share)",
        "return part_right(value, 1.0 + 1e-20 * share);",
        "end slabs of an X-ray count whole",
        "test_projection_drawn.py -k 'sums_approach'",
    ),
    _wrong(
        "bool comes_after(float depth, vec4 other)",
        "return depth > other.y || (depth == other.y && number >= other.x);",
        "a surface is met again at its own depth",
        "test_geometry_drawn.py",
    ),
    _wrong(
        "vec4 color_of(vec4 glow)",
        "return vec4(glow.rgb, opacity_from_depth(glow.a));",
        "the glow of several volumes is not absorbed on its way",
        "test_several_drawn.py",
    ),
    _wrong(
        "float depth_of_part(vec4 texel, float path_length, vec3 position)",
        "return 0.5 * depth_of_part_right(texel, path_length, position);",
        "shadows are half as deep",
        "test_shadows.py -k 'falls_off'",
    ),
    _wrong(
        "vec4 slab_color_in_run(vec4 texel, float length, float is_there, vec3 position, float depth)",
        "return slab_color_in_run_right(texel, length, 1.0, position, depth);",
        "slabs that are not there are drawn at the end of a run",
        "test_closed_forms_drawn.py",
    ),
    _wrong(
        "vec4 matter_of(vec4 texel, vec3 position)",
        "return matter_of_right(texel.gbar, position);",
        "the value is looked for in another channel",
        "test_closed_forms_drawn.py",
    ),
    _changed(
        "corner.vert",
        "vec4(in_position, 0.0, 1.0)",
        "vec4(-in_position, 0.0, 1.0)",
        "a triangle over the whole picture lies elsewhere",
        "test_shadows.py -k 'falls_off'",
    ),
    _changed(
        "slab_stack.vert",
        "slab_range = in_slab_range;",
        "slab_range = in_slab_range + 1.0;",
        "stacks hold the slabs behind their own",
        "test_closed_forms_drawn.py",
    ),
    _changed(
        "texels.frag",
        "factor * texelFetch",
        "texelFetch",
        "a factor of a copied picture is forgotten",
        "test_geometry_drawn.py test_shadows.py",
    ),
    _changed(
        "surface.vert",
        "entry(2 * int(in_numbers.y) + 1)",
        "entry(2 * int(in_numbers.y))",
        "the kind of a shape is read from its colour",
        "test_geometry_drawn.py",
    ),
    _changed(
        "held.glsl",
        "max(number, -3e38)",
        "min(number, 0.5)",
        "uniforms that are held in registers are clamped",
        "test_closed_forms_drawn.py",
    ),
    _changed(
        "precision.glsl",
        "#define real2 dvec2",
        "#define real2 vec2",
        "depths in boxes are in single precision",
        "test_closed_forms_drawn.py test_shader_files.py",
    ),
    _changed(
        "each_ramp.glsl",
        "EACH_OF_2(F) F(rise_2, place_2, 2)",
        "EACH_OF_2(F) F(rise_2, place_2, 1)",
        "the third ramp is the second again",
        "test_ramps.py",
    ),
)
