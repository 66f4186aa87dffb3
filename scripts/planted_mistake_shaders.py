"""Mistakes in the shaders, each in a file of its own at least."""

from __future__ import annotations

from planted_mistake_sources import Mistake

CLOSED_FORMS = "test_closed_forms_drawn.py -k 'case_1 or any_slant'"
_LINEAR = "test_closed_forms_drawn.py -k 'case_4'"
_LIT = "test_light_drawn.py -k 'lit_by_the_formula'"
_OVERLAY = "test_annotation_quick.py -k 'all_of_it'"
_INTERFACE = "test_window_off_screen.py"
SHADOWS = "test_shadows.py -k 'falls_off'"
# The oracle's few rays take less time than compiling it.
_PROJECTED = "NUMBA_DISABLE_JIT=1 test_projection_drawn.py -k"
_EXTREMES = f"{_PROJECTED} 'extremes_are_exact'"
SUMS = f"{_PROJECTED} 'sums_approach and xray'"


def _wrong(signature: str, body: str, words: str, tests: str) -> Mistake:
    """A function of a shader with another body, which may call the right one."""
    return Mistake("shaders", signature, "", body, words, tests)


def changed(file: str, old: str, new: str, words: str, tests: str) -> Mistake:
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
        "test_kinds_rendered.py -k 'wrong_order and bone'",
    ),
    _wrong(
        "float share_of_thirds(vec4 medium, float length)",
        "return share_of_thirds_right(medium, 0.5 * length);",
        "slabs are divided from twice the optical depth on",
        "test_divided_slabs.py -k 'plain_numpy and 1.3'",
    ),
    _wrong(
        "vec3 lookup_position(vec3 position)",
        "return lookup_position_right(position + 0.5 / vec3(textureSize(texels, 0)));",
        "texels are looked up half a texel off",
        _EXTREMES,
    ),
    _wrong(
        "float bound_of(SampleWalk walk, vec3 low, float side)",
        "return 0.5 * bound_of_right(walk, low, side);",
        "a ray passes cells of half the bound that they have",
        _EXTREMES,
    ),
    _wrong(
        "vec4 values_in_cell(BoxWalk walk, float front, float back)",
        "return values_in_cell_right(walk, front, front);",
        "all values in a cell are that at its front",
        _EXTREMES,
    ),
    _wrong(
        "vec3 lookup_position(vec3 position)",
        "return lookup_position_right(position.zyx);",
        "two axes of the volume are swapped",
        _EXTREMES,
    ),
    _wrong(
        "vec3 gradient_of(vec4 texel)",
        "return gradient_of_right(texel).bgr;",
        "components of the gradient are swapped",
        _LIT,
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
        "oblique rays cross slabs no longer than the middle ray",
        CLOSED_FORMS,
    ),
    _wrong(
        "BoxWalk walk_through(Ray ray, real2 interval, float path_length)",
        ("BoxWalk walk = walk_through_right(ray, interval, path_length); walk.first_fraction = 0.0; return walk;"),
        "the first slab of a ray counts whole",
        CLOSED_FORMS,
    ),
    _wrong(
        "vec2 slab_ends(BoxWalk walk, float slab)",
        "return vec2(0.0, 1.0);",
        "end slabs of an X-ray count whole",
        SUMS,
    ),
    _wrong(
        "BoxWalk volume_walk(vec2 pixel, Visible visible, float obliquity)",
        "BoxWalk walk = volume_walk_right(pixel, visible, obliquity); walk.last_slab += 1.0; return walk;",
        "each of several volumes goes on for a slab behind its box",
        "test_several_drawn.py -k 'overlapping_boxes'",
    ),
    _wrong(
        "vec2 drawn_slabs(BoxWalk walk, Ray ray, vec2 stack)",
        "return drawn_slabs_right(walk, ray, stack) + vec2(1.0, 0.0);",
        "a stack of slabs lacks its first slab",
        CLOSED_FORMS,
    ),
    _wrong(
        "real2 interval_between(real2 interval, real low, real high, real position, real direction)",
        "return interval_between_right(interval, low, real(0.9) * high, position, direction);",
        "the box ends before its upper faces",
        CLOSED_FORMS,
    ),
    _wrong(
        "Ray pixel_ray(vec2 pixel)",
        "return pixel_ray_right(pixel + 0.5);",
        "rays pass beside the middles of pixels",
        CLOSED_FORMS,
    ),
    _wrong(
        "vec2 pixel_at(vec2 window_position)",
        "return pixel_at_right(window_position.yx);",
        "rows and columns of the picture are swapped",
        CLOSED_FORMS,
    ),
    _wrong(
        "Visible visible_depths(Ray ray, vec2 window_position)",
        (
            "Visible visible = visible_depths_right(ray, window_position); visible.interval.x = real(-1e30); "
            "return visible;"
        ),
        "what lies behind the eye is seen",
        "test_closed_forms_drawn.py test_render.py -k 'inside'",
    ),
    _wrong(
        "real2 half_space_interval(real2 interval, real4 half_space, Ray ray)",
        "return half_space_interval_right(interval, -half_space, ray);",
        "clip planes keep what they cut away",
        "test_cutting.py -k 'closed_form'",
    ),
    _wrong(
        "bool is_in_brick(real3 position)",
        "return true;",
        "shadows of bricks hold what neighbours hold too",
        "test_shadows.py -k 'bricks'",
    ),
    _wrong(
        "vec3 texture_position(vec3 position)",
        "return texture_position_right(position) + 1e-3;",
        "a brick lies a thousandth of its texture off",
        "test_bricks.py -k 'any_format'",
    ),
    _wrong(
        "vec4 color_of_straight(vec4 medium, float path_length)",
        "return vec4(medium.rgb, color_of_straight_right(medium, path_length).a);",
        "straight colour is not multiplied by opacity",
        CLOSED_FORMS,
    ),
    _wrong(
        "vec4 over_shallow(vec4 color, vec4 front, vec4 behind, float path_length)",
        (
            "vec3 middle = 0.5 * (front.rgb + behind.rgb); "
            "return over_shallow_right(color, vec4(middle, front.a), vec4(middle, behind.a), path_length);"
        ),
        "the colour of a slab is that of its middle",
        _LINEAR,
    ),
    _wrong(
        (
            "vec4 over_slab(vec4 color, inout Place place, vec4 middle, vec4 behind, float length, vec3 position, "
            "vec3 step, float depth, float depth_step)"
        ),
        "return over_slab_right(color, place, behind, behind, length, position, step, depth, depth_step);",
        "the middle of a slab is looked up at its back",
        "test_closed_forms_drawn.py -k 'integrated'",
    ),
    _wrong(
        "vec4 slab_color_in_run(vec4 texel, float length, float fraction, vec3 position, float depth)",
        "return slab_color_in_run_right(texel, length, 1.0, position, depth);",
        "slabs behind the end of a run are drawn",
        CLOSED_FORMS,
    ),
    _wrong(
        "void leave_run(SlabRuns runs, inout Progress progress)",
        "if (progress.slab >= runs.run.y) progress.slab = progress.end;",
        "only the first runs of slabs are drawn",
        "test_empty_space.py -k 'leap or skip'",
    ),
    _wrong(
        "vec2 take_run(inout Runs runs, float base)",
        "vec2 run = take_run_right(runs, base); return vec2(run.x + 1.0, run.y);",
        "a run of slabs begins one slab late",
        "test_empty_space.py -k 'leap or skip'",
    ),
    _wrong(
        "bool is_finished(float opacity)",
        "return least_transmittance > 0.0 && opacity >= 0.5;",
        "rays end where they are half opaque",
        _LINEAR,
    ),
    _wrong(
        "void draw_cap(BoxWalk walk, inout Progress progress)",
        "if (walk.is_cut_open) draw_cap_right(walk, progress); progress.color.a *= 0.5;",
        "caps are translucent",
        "test_cutting.py -k 'cap'",
    ),
    _wrong(
        "vec3 normal_of(vec3 gradient, float magnitude)",
        "return normal_of_right(-gradient, magnitude);",
        "normals point to higher values",
        _LIT,
    ),
    _wrong(
        "vec3 lit_normal(vec3 normal, vec3 to_eye)",
        "return normal;",
        "only one side of a surface is lit",
        _LIT,
    ),
    _wrong(
        "float transmittance_to_light(int number, vec3 position, vec3 to_light)",
        "return transmittance_to_light_right(number, position, -to_light);",
        "shadows are looked up on the far side of a position",
        "test_shadows.py -k 'nearer_to_the_light or floor'",
    ),
    _wrong(
        "vec3 to_eye_from(vec2 pixel)",
        "return to_eye_from_right(vec2(0.0) * pixel);",
        "the eye is in the same direction from every pixel",
        _LIT,
    ),
    _wrong(
        "vec4 modulated(vec4 medium, float factor)",
        "return medium * vec4(vec3(factor), 1.0);",
        "the gradient modulates colour in place of extinction",
        "test_graded_drawn.py -k 'modulat'",
    ),
    _wrong(
        "float contour_distance(float value, float magnitude, vec3 position)",
        "return contour_distance_right(value, 0.1 + 1e-6 * magnitude, position);",
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
        _EXTREMES,
    ),
    _wrong(
        "vec2 turns_between(vec4 values, float from, float to)",
        "return vec2(from);",
        "no maximum is looked for between planes of samples",
        _EXTREMES,
    ),
    _wrong(
        "vec4 extreme_along(BoxWalk walk, vec2 slabs, float known_before)",
        "return extreme_along_right(walk, slabs + vec2(1.0, 0.0), known_before);",
        "the largest value is not looked for in the first slab",
        _EXTREMES,
    ),
    _wrong(
        "vec4 values_between(BoxWalk walk, float front, float back, float at_front)",
        "return values_between_right(walk, front, back, at_front).xyzz;",
        "the end of a piece is looked up a third before it",
        "test_isosurface_drawn.py -k 'thinner_than_a_slab or exactly_at'",
    ),
    _wrong(
        "vec4 part_of_integral(float value, float fraction)",
        "return part_of_integral_right(value + 2.0 * bias, fraction);",
        "the bias of an X-ray is added in place of subtracted",
        SUMS,
    ),
    _wrong(
        "Piece piece_of(vec4 values, float length, float longest)",
        "Piece piece = piece_of_right(values, length, longest); piece.above += 1e-3; return piece;",
        "an isosurface is that of a value a thousandth less",
        "NUMBA_DISABLE_JIT=1 test_isosurface_drawn.py -k 'where_they_are and sheared and perspective'",
    ),
    _wrong(
        "vec4 color_of(vec4 glow)",
        "return vec4(glow.rgb, opacity_from_depth(glow.a));",
        "the glow of several volumes is not absorbed on its way",
        "test_several_drawn.py -k 'overlapping_boxes'",
    ),
    _wrong(
        "float depth_of_part(vec3 position, float path_length)",
        "return 0.5 * depth_of_part_right(position, path_length);",
        "shadows are half as deep",
        SHADOWS,
    ),
    _wrong(
        "vec4 medium_of_value(float value)",
        "return medium_of_value_right(0.99 * value);",
        "the transfer function is looked up beside the value",
        "test_ramps.py test_closed_forms_drawn.py",
    ),
    _wrong(
        "bool comes_after(vec2 here, vec4 other)",
        "return here.y > other.y;",
        "of two surfaces at the same depth one is lost",
        "test_geometry_drawn.py -k 'at_one_place'",
    ),
    changed(
        "held.glsl",
        "max(number, -3e38)",
        "min(number, 0.5)",
        "uniforms that are held in registers are clamped",
        "test_closed_forms_drawn.py test_light_drawn.py -k 'formula'",
    ),
    changed(
        "precision.glsl",
        "#define real3 dvec3",
        "#define real3 vec3",
        "rays are in single precision where the rest is in double",
        "test_shader_switches.py -k 'slab_stack'",
    ),
    changed(
        "single_precision.glsl",
        "#define real float",
        "#define real double",
        "half spaces of shadows are in double precision",
        "test_shader_switches.py -k 'shadow'",
    ),
    changed(
        "each_ramp.glsl",
        "EACH_OF_2(F) F(rise_2, position_2, 2)",
        "EACH_OF_2(F) F(rise_2, position_2, 1)",
        "the third ramp is the second again",
        "test_ramps.py",
    ),
    _wrong(
        "float beyond(float away, vec2 direction)",
        "return away < 0.0 ? 1.0 : 0.0;",
        "lines over a moving picture have jagged edges",
        _OVERLAY,
    ),
    changed(
        "overlay.frag",
        "(1.0 - behind.a) * min(",
        "1.0 * min(",
        "far edges of the box are drawn over a moving medium",
        _OVERLAY,
    ),
    changed(
        "overlay.vert",
        "1.0 - 2.0 * place.y",
        "2.0 * place.y - 1.0",
        "a moving picture with annotation is upside down",
        _OVERLAY,
    ),
    _wrong(
        "vec3 linear_from_srgb(vec3 encoded)",
        "return encoded;",
        "annotation is blended in sRGB while the picture moves",
        _OVERLAY,
    ),
    changed(
        "interface.vert",
        "1.0 - 2.0 * position.y",
        "2.0 * position.y",
        "a window without a display is upside down",
        _INTERFACE,
    ),
    changed(
        "interface.frag",
        "tint * texture",
        "texture",
        "a window without a display has no colours",
        _INTERFACE,
    ),
)
