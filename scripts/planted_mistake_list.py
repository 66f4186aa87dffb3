"""The mistakes that planted_mistakes.py plants: in Python by package, from top to bottom, then in shaders."""

from __future__ import annotations

from planted_mistake_kinds import OF_KINDS
from planted_mistake_shaders import IN_SHADERS
from planted_mistake_sources import Mistake
from planted_mistake_stages import IN_STAGES
from planted_mistake_upper import UPPER

_LOWER = (
    Mistake(
        *("ray_casting", "bernstein:cubic"),
        *("mix(a[1], b[1], entry), 2 / 3)", "mix(a[1], b[1], entry), 1 / 3)"),
        "a coefficient of the cubic along a ray has another weight",
        "NUMBA_DISABLE_JIT=1 test_ray_casting.py -k 'linear_extinction_and_constant'",
    ),
    Mistake(
        *("ray_casting", "rays_of"),
        *("np.maximum(first, eye)", "first"),
        "what lies behind the eye is in the oracle's picture",
        "NUMBA_DISABLE_JIT=1 test_ray_casting.py -k 'chord and inside'",
    ),
    Mistake(
        *("rendering", "settings:checked"),
        *("if len(chosen) > 1:", "if len(chosen) > 2:"),
        "two ways to choose the slab thickness are accepted",
        "test_render.py test_error_control.py -k 'refused or given or wrong or choose'",
    ),
    Mistake(
        *("rendering", "settings:checked"),
        *("scene.smallest_spacing / (sampling_rate", "scene.smallest_spacing * (sampling_rate"),
        "a sampling rate makes slabs thicker",
        "test_orders.py -k 'thinner'",
    ),
    Mistake(
        *("rendering", "render:over_background"),
        *("(1 - picture[..., 3:])", "picture[..., 3:]"),
        "the background shows through what is opaque",
        "test_render.py -k 'background'",
    ),
    Mistake(
        *("rendering", "side_pictures:SidePictures.__init__"),
        *("view.slab_thickness / 2**_HALVINGS", "view.slab_thickness"),
        "both pictures that tell the error of a large volume have the same slabs",
        "test_side_pictures.py -k 'bounds_the_error'",
    ),
    Mistake(
        *("rendering", "several:_Turn.part"),
        *("brick.position != region.position", "brick.position == region.position"),
        "of several large volumes a part is drawn where another one belongs",
        "test_several_in_parts.py -k 'in_memory and one_grid or in_memory and one and orthographic'",
    ),
    Mistake(
        *("opengl", "compositor:Compositor.pixels"),
        *("pixels[::-1]", "pixels"),
        "pictures stand on their head",
        "test_render.py",
    ),
    Mistake(
        *("scene", "refinement:_neighbours"),
        *("(samples + 0.5) / factor - 0.5", "samples / factor"),
        "finer samples lie beside where they belong",
        "test_refinement.py -k 'in_between'",
    ),
    Mistake(
        *("slicing", "bricks:Brick.texture_from_box"),
        *(" | is_part", ""),
        "a part whose texture is as long as the volume lies at its beginning",
        "test_region_bricks.py",
    ),
    Mistake(
        *("opengl", "wilson:slab_middles"),
        *("slabs.last[-1]) + 0.5", "slabs.last[-1]) + 0.0"),
        "slabs are cut at their fronts, and not in their middles",
        "test_polygons.py -k 'slabs_are_whole'",
    ),
    Mistake(
        *("opengl", "shaders:Programs.program"),
        *("key = (name, *sorted(switches.items()))", "key = (name,)"),
        "a program is kept whatever its switches",
        "test_nothing_modelled.py test_render.py",
    ),
    Mistake(
        *("opengl", "uniforms:cue_uniforms"),
        *("(middle - near) / (far - near)", "(middle - far) / (far - near)"),
        "a depth cue begins at its far end",
        "test_light_drawn.py -k 'depth_cue'",
    ),
    Mistake(
        *("opengl", "shaders:set_uniforms"),
        *("if dropped:", "if False:"),
        "a uniform that the linker dropped is no error of ours",
        "test_shader_files.py -k 'lacks'",
    ),
    Mistake(
        *("slicing", "bricks:_ranks"),
        *("reverse=forward < 0", "reverse=forward > 0"),
        "bricks are drawn back to front where rays are parallel",
        "test_bricks.py -k 'in_their_order or visibility'",
    ),
    Mistake(
        *("slicing", "bricks:margin"),
        *("(1 + int(np.ceil(each))", "(int(np.ceil(each))"),
        "a brick lacks the next sample for the interpolation",
        "test_slicing.py -k 'half_a_slab'",
    ),
    Mistake(
        *("slicing", "cells:_along"),
        *("max(cell * count - 1, 0)", "max(cell * count, 0)"),
        "a cell does not know the sample before it",
        "test_cells.py",
    ),
    Mistake(
        *("textures", "slab_texture:_texel_scale"),
        *("np.exp2(np.ceil(np.log2(scale)))", "np.exp2(np.floor(np.log2(scale))) * 1.1"),
        "texels of floats lose digits to their scale",
        "test_slab_texture.py",
    ),
    Mistake(
        *("textures", "slab_texture:_medium_encoder"),
        *("glow = emission * length_unit", "glow = emission"),
        "the emission of a texel is not that of its unit of length",
        "test_slab_texture.py",
    ),
    Mistake(
        *("textures", "ramps:ramp_uniforms"),
        *("sums = sums + rises[-1]", "sums = number"),
        "rounding of a sum of ramps is not carried on",
        "test_ramps.py",
    ),
    Mistake(
        *("geometry", "marching_cubes:marching_cubes"),
        *("[used, ::-1].astype(np.float64) - 1", "[used, ::-1].astype(np.float64)"),
        "a surface lies one sample off",
        "test_geometry_extraction.py",
    ),
    Mistake(
        *("geometry", "extraction:_mesh"),
        *("is_mirrored = np.linalg.det(volume.direction) < 0", "is_mirrored = np.linalg.det(volume.direction) > 0"),
        "triangles are turned around on right-handed grids",
        "test_geometry_extraction.py",
    ),
    Mistake(
        *("geometry", "marching_tetrahedra:_tetrahedra"),
        *("steps[_five(is_odd)]", "steps[_five(False)]"),
        "cells of tetrahedra are not cut alternately",
        "test_geometry_methods.py",
    ),
    Mistake(
        *("geometry", "cuberille:_faces"),
        *("np.where(ends_here[:, np.newaxis], around, around[:, ::-1])", "around"),
        "faces of voxels all look one way",
        "test_geometry_methods.py",
    ),
    Mistake(
        *("geometry", "contours:_pieces"),
        *("int(of_above[side][loop.above]), int(of_below[side][loop.below])", "int(of_above[side][loop.above]), 0"),
        "contours around a region below are joined with those around it",
        "test_geometry_methods.py",
    ),
    Mistake(
        *("geometry", "torus_path:_shortest"),
        *("best = min(best, found, key=lambda path: path.cost)", "best = first"),
        "strips between contours begin at one vertex always",
        "test_geometry_contours.py",
    ),
    Mistake(
        *("geometry", "dividing_cubes:_points"),
        *("+ 0.5) / each", ") / each"),
        "points lie at a corner of their part",
        "test_geometry_divided.py",
    ),
    Mistake(
        *("formats", "mrc:_imod_type"),
        *("not flags & 1", "flags & 1"),
        "the sign of IMOD's bytes is taken the other way around",
        "test_readers_mrc.py",
    ),
    Mistake(
        *("formats", "nifti:_axes"),
        *('"XYZTC??"[:count][::-1]', '"XYZTC??"[:count]'),
        "the axes of a NIfTI file are taken fastest first",
        "test_readers_nifti.py",
    ),
    Mistake(
        *("formats", "nifti:_scaled"),
        *("intercept if np.isfinite(intercept) else 0.0", "0.0"),
        "the intercept of a NIfTI header is forgotten",
        "test_readers_nifti.py",
    ),
    Mistake(
        *("formats", "quick_png:_chunk"),
        *("_deflate().crc32(content, zlib.crc32(kind))", "_deflate().crc32(content)"),
        "the checksum of a part of a PNG leaves its kind out",
        "test_quick_png.py",
    ),
    Mistake(
        *("formats", "image:eight_bits"),
        *("where=opacity > 0", "where=opacity > 2"),
        "a transparent PNG holds black in place of straight colour",
        "test_image.py",
    ),
    Mistake(
        *("formats", "image:_encoded"),
        *("for name, text in attributes.items():", "for name, text in ():"),
        "the header of a picture lacks its metadata",
        "test_image.py test_quick_png.py",
    ),
    Mistake(
        *("scene", "dark_objects:as_seen"),
        *("medium.extinctions[::-1]", "medium.extinctions"),
        "of a negative the background is dense, and what is before it clear",
        "test_looks.py -k 'negative'",
    ),
    Mistake(
        *("scene", "cutting:Cutting.interval"),
        *("np.maximum(first, meets)", "np.minimum(first, meets)"),
        "of two clip planes the farther one cuts",
        "test_cutting.py test_camera.py -k 'closed_form'",
    ),
    Mistake(
        *("scene", "cutting:Cutting.half_spaces"),
        *("offsets.append(plane.offset / length)", "offsets.append(plane.offset)"),
        "the offset of a clip plane is not that of its unit normal",
        "test_cutting.py -k 'closed_form or any_size'",
    ),
    Mistake(
        *("scene", "orbit:turned"),
        *("np.cross(axis, across)", "np.cross(across, axis)"),
        "an orbit turns clockwise",
        "test_orbit.py -k 'right_angles'",
    ),
    Mistake(
        *("scene", "mask:Mask.of"),
        *("(high - low), 0, 1)", "(high - low), 0, None)"),
        "weights of a mask exceed 1",
        "test_masks_drawn.py -k 'come_out'",
    ),
    Mistake(
        *("scene", "camera:Camera.rays"),
        *("(width - 1) / 2", "width / 2"),
        "rays pass half a pixel beside the centres of pixels",
        "test_camera.py",
    ),
    Mistake(
        *("scene", "optics:over"),
        *("(1 - front[..., 3:])", "(1 - back[..., 3:])"),
        "over weighs the back with its own opacity",
        "test_optics.py -k 'associative'",
    ),
    Mistake(
        *("util", "termination:_raise_what_ended"),
        *("_arrived[-1] == signal.SIGINT", "_arrived[-1] != signal.SIGINT"),
        "SIGTERM while a library loads is taken for ctrl-C",
        "test_termination.py -k 'import_error'",
    ),
    Mistake(
        *("util", "writing:check_apart"),
        *("if os.path.realpath(path) == os.path.realpath(another):", "if path == another:"),
        "two names of one file count as two files",
        "NUMBA_DISABLE_JIT=1 test_outputs_apart.py -k 'place_of_another'",
    ),
    Mistake(
        *("util", "writing:write_files"),
        *("folders.callback(remove, folder)\n", "pass\n"),
        "scratch folders stay behind",
        "test_writing.py",
    ),
    Mistake(
        *("util", "writing:_written"),
        *("0o666", "0o600"),
        "files are their owner's alone whatever the umask",
        "test_writing.py",
    ),
    Mistake(
        *("util", "color:srgb_from_linear"),
        *("- 0.055", "- 0.05"),
        "sRGB has a step in its curve",
        "test_image.py",
    ),
    Mistake(
        *("util", "statistics:median"),
        *("(len(ordered) - 1) // 2", "len(ordered) // 2"),
        "the median of an even number of numbers is the upper one",
        "test_ranks.py",
    ),
)

MISTAKES = (*UPPER, *_LOWER, *OF_KINDS, *IN_SHADERS, *IN_STAGES)
