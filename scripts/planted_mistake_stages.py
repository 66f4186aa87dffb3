"""Mistakes in vertex and fragment shaders, outside of the files that they include."""

from __future__ import annotations

from planted_mistake_shaders import CLOSED_FORMS, SHADOWS, SUMS, changed

_LISTS = "test_geometry_lists.py -k 'light_cuts'"
_STACKS = "test_polygons.py -k 'make_the_picture_of_stacks and slab'"

IN_STAGES = (
    changed(
        "projection.glsl",
        "* walk.path_length",
        "* 1.0",
        "an X-ray forgets how long the path through a slab is",
        SUMS,
    ),
    changed(
        "corner.vert",
        "vec4(in_position, 0.0, 1.0)",
        "vec4(0.5 * in_position, 0.0, 1.0)",
        "a triangle covers only the middle of the picture",
        SHADOWS,
    ),
    changed(
        "slab_stack.glsl",
        "over(progress.color, behind)",
        "progress.color",
        "the last slab of a ray is left out",
        CLOSED_FORMS,
    ),
    changed(
        "slab_stack.frag",
        "gl_FragCoord.xy, slab_range",
        "gl_FragCoord.xy + 1.0, slab_range",
        "a fragment draws the ray of the pixel beside it",
        CLOSED_FORMS,
    ),
    changed(
        "several.frag",
        "gl_FragCoord.xy, slab_range",
        "gl_FragCoord.xy, 0.5 * slab_range",
        "of several volumes half of the slabs are drawn",
        "test_several_drawn.py -k 'overlapping_boxes'",
    ),
    changed(
        "projection.frag",
        "if (!draw_stack",
        "if (draw_stack",
        "a projection shows nothing where there is something",
        SUMS,
    ),
    changed(
        "rays.comp",
        "vec2(pixel) + 0.5",
        "vec2(pixel)",
        "the compute shader draws rays through the corners of pixels",
        "test_pipelines.py -k 'rays_draw and slab'",
    ),
    changed(
        "nothing.comp",
        "GL_ARB_compute_shader",
        "GL_ARB_no_such_shader",
        "no driver seems to have compute shaders by extension",
        "test_pipelines.py -k 'by_their_extension'",
    ),
    changed(
        "weights.frag",
        "0.25 + 0.5 *",
        "0.5 *",
        "weights are measured half a texel beside their texels",
        "test_interpolation.py -k 'measured'",
    ),
    changed(
        "interpolated.glsl",
        "vec3(textureSize(texels, 0));",
        "vec3(textureSize(texels, 0)) - 1.0;",
        "the shader interpolates between texels too far apart",
        "test_interpolation.py -k 'as_an_exact_driver and post'",
    ),
    changed(
        "slab_ends.frag",
        "vec4(progress.slab, progress.end, 0.0, 0.0)",
        "vec4(progress.slab, progress.end + 1.0, 0.0, 0.0)",
        "a polygon draws the last slab of a ray once more",
        _STACKS,
    ),
    changed(
        "slab_polygon.frag",
        "slab < range.x",
        "slab <= range.x",
        "the polygon behind a ray's first slab leaves the ray out",
        _STACKS,
    ),
    changed(
        "slab_polygon.vert",
        "slab = in_slab;",
        "slab = in_slab + 1.0;",
        "polygons stand for the slab behind their own",
        _STACKS,
    ),
    changed(
        "wilson.frag",
        "texel_scale * interpolated(",
        "interpolated(",
        "texels are taken as they are stored",
        "test_polygons.py -k 'goes_to_the_integral'",
    ),
    changed(
        "wilson.vert",
        "texture_position = in_texture_position;",
        "texture_position = 1.0 - in_texture_position;",
        "corners have the position of the opposite ones in the texture",
        "test_polygons.py -k 'goes_to_the_integral'",
    ),
    changed(
        "slab_stack.vert",
        "slab_range = in_slab_range;",
        "slab_range = in_slab_range + 1.0;",
        "stacks hold the slabs behind their own",
        CLOSED_FORMS,
    ),
    changed(
        "texels.frag",
        "factor * texelFetch",
        "texelFetch",
        "colours beside surfaces keep the scale of the target",
        "test_geometry_drawn.py -k 'brighter_than_white or any_size'",
    ),
    changed(
        "surface_hits.comp",
        "atomicMax(nearest[pixel], key) > key",
        "atomicMax(nearest[pixel], key) != key",
        "lists forget an opaque surface that is nearer than the one before",
        _LISTS,
    ),
    changed(
        "surface_next.frag",
        "(done & bit_of(hit.y)) != 0u",
        "false",
        "translucent lines in lists are darker at joints",
        _LISTS,
    ),
    changed(
        "surface_lists.glsl",
        " + real4(entry(first + 3))",
        "",
        "lists know edges of triangles in single precision only",
        _LISTS,
    ),
    changed(
        "surface.frag",
        "(done & bit) != 0u",
        "false",
        "translucent lines are darker at joints",
        "test_geometry_lines.py -k 'translucent_joints'",
    ),
    changed(
        "surface_color.glsl",
        "shown * look.a, look.a",
        "shown, look.a",
        "colours of translucent shapes are not multiplied by their opacity",
        "test_geometry_lines.py -k 'translucent_joints'",
    ),
    changed(
        "surface_table.glsl",
        "2 * shapes + TEXELS * number",
        "2 * shapes + TEXELS * number + TEXELS",
        "each triangle is drawn where the next one lies",
        "test_geometry_drawn.py -k 'at_one_place'",
    ),
    changed(
        "surface.vert",
        "kind_of(int(in_numbers.y))",
        "look_of(int(in_numbers.y))",
        "the kind of a shape is read from its colour",
        "test_geometry_lines.py -k 'translucent_joints'",
    ),
)
