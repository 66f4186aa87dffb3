"""The mistakes that planted_mistakes.py plants: in Python by package, from top to bottom, then in shaders."""

from __future__ import annotations

from planted_mistake_shaders import IN_SHADERS
from planted_mistake_sources import Mistake
from planted_mistake_stages import IN_STAGES

_UPPER = (
    Mistake(
        *("cli", "command_line:main"),
        *("return 2", "return 1"),
        "a wrong command line has the exit status of a comparison",
        "test_command_line.py -k 'wrong_is_said'",
    ),
    Mistake(
        *("cli", "diff:_status"),
        *("return DIFFERENT", "return SAME"),
        "the exit status of a difference is lost",
        "test_diff_command.py -k 'one_pixel_off'",
    ),
    Mistake(
        *("cli", "render:run"),
        *("if arguments.stats:\n", "if False:\n"),
        "stats are never written",
        "test_command_line.py -k 'stats_hold'",
    ),
    Mistake(
        *("window", "navigation:orbit"),
        *("rotation(axis, -right)", "rotation(axis, right)"),
        "the turntable turns against the hand",
        "test_window_navigation.py",
    ),
    Mistake(
        *("window", "navigation:dolly"),
        *("(1 - height / camera.height)", "(1 - camera.height / height)"),
        "an orthographic dolly shifts by the inverse ratio",
        "test_window_navigation.py",
    ),
    Mistake(
        *("window", "ranges:Hold.taken"),
        *("is_low = at - low < high - at", "is_low = at - low > high - at"),
        "a hand takes the farther end of a range",
        "test_window_ranges.py",
    ),
    Mistake(
        *("window", "histogram:histogram_of"),
        *("bins = int(high - low) + 1", "bins = int(high - low)"),
        "one bin too few for whole numbers",
        "test_window_histogram.py",
    ),
    Mistake(
        *("window", "recent:add"),
        *("if each != newest", "if each == newest"),
        "the list of recent files keeps only the newest",
        "test_window_browsing.py test_window_contents.py test_window_document.py -k 'recent or latest or lately'",
    ),
    Mistake(
        *("pytest_plugin", "names:Claims.page"),
        *("self._pages[page] = self._pages.get(page, 0) + 1", "self._pages[page] = 1"),
        "two checks of one name write one page",
        "test_pytest_plugin_names.py -k 'share_a_name_with_itself'",
    ),
    Mistake(
        *("pytest_plugin", "references:position_of"),
        *("picture.channels >= 3", "picture.channels >= 1"),
        "a grey picture replaces a PNG, which loses its digits",
        "test_pytest_plugin.py -k 'other_formats'",
    ),
    Mistake(
        *("pytest_plugin", "repeats:noise_of"),
        *("(len(pictures) - 1)", "len(pictures)"),
        "the noise of repeats is divided by n instead of n - 1",
        "test_pytest_plugin_report.py -k 'systematic_difference'",
    ),
    Mistake(
        *("report", "orders:slope"),
        *("np.polyfit(np.log(steps), np.log(changes), 1)[0]", "np.polyfit(np.log(steps), np.log(changes), 1)[1]"),
        "the intercept stands for the slope",
        "test_report_orders.py -k 'slope'",
    ),
    Mistake(
        *("report", "orders:_three_times"),
        *("/ 3 - 0.5", "/ 3"),
        "a finer grid is half a sample off",
        "test_report_orders.py -k 'grids'",
    ),
    Mistake(
        *("report", "convergence:pareto_front"),
        *(" < ", " > "),
        "the Pareto front holds the slowest settings",
        "test_convergence.py",
    ),
    Mistake(
        *("comparison", "measures:measure"),
        *("worst_pixel=(column, row)", "worst_pixel=(row, column)"),
        "row and column of the worst pixel are swapped",
        "test_measures.py",
    ),
    Mistake(
        *("comparison", "limits:Check.is_broken"),
        *("not self.measure <= self.limit", "self.measure > self.limit"),
        "what is no number breaks no limit",
        "test_limits.py",
    ),
    Mistake(
        *("comparison", "limits:default_limits"),
        *("drivers[0] != drivers[1]", "drivers[0] == drivers[1]"),
        "the limits of one and of two drivers are swapped",
        "test_limits.py",
    ),
    Mistake(
        *("comparison", "wrong_functions:with_wrong_function"),
        *("if len(changed) != 1:", "if len(changed) > 1:"),
        "a mistake in a function that is gone changes nothing, and nobody says so",
        "test_mistakes.py -k 'not_there'",
    ),
    Mistake(
        *("output", "sequences:views"),
        *("360 * i / count", "360 * i / max(count - 1, 1)"),
        "the last view of an orbit is the first again",
        "test_orbit.py -k 'single_pictures or first_view_is_the_picture'",
    ),
    Mistake(
        *("output", "sequences:representative_volume"),
        *("np.linspace(0, len(series) - 1, _STEPS)", "np.linspace(0, 0, _STEPS)"),
        "a series is judged by its first step",
        "test_sequences.py -k 'adapts'",
    ),
    Mistake(
        *("options", "texts:size"),
        *("int(match[1]), int(match[2])", "int(match[2]), int(match[1])"),
        "width and height of --size are swapped",
        "test_command_line.py -k 'picture_and_its_oracle'",
    ),
    Mistake(
        *("options", "texts:sample_value"),
        *("return int(text)", "return float(text)"),
        "a missing value of many digits is rounded",
        "test_missing.py -k 'keeps_all_its_digits'",
    ),
    Mistake(
        *("annotation", "rounding:round_down"),
        *("float(step) <= most", "float(step) >= most"),
        "a round length is longer than there is room for",
        "test_annotation_parts.py test_annotation_text.py -k 'scale_bar or round'",
    ),
    Mistake(
        *("annotation", "orientation:border_letters"),
        *('"left": -right, "right": right', '"left": right, "right": -right'),
        "the letters of left and right are swapped",
        "test_annotation_parts.py -k 'letters'",
    ),
    Mistake(
        *("annotation", "scale_bar:bar_length"),
        *("float(length) / pixel", "float(length) * pixel"),
        "the scale bar is longer where pixels are larger",
        "test_annotation_parts.py -k 'scale_bar'",
    ),
    Mistake(
        *("provenance", "metadata:Metadata.of"),
        *("version not in (1, FORMAT)", "version in (1, FORMAT)"),
        "headers of the present format are refused",
        "test_scene_facts.py -k 'tampered or is_none'",
    ),
    Mistake(
        *("provenance", "volumes:positions"),
        *("if folder is not None and path:", "if folder is not None and not path:"),
        "a volume is not looked for beside its picture",
        "test_stored_volumes.py -k 'beside'",
    ),
    Mistake(
        *("provenance", "scene_metadata:_crc32_of"),
        *("np.ascontiguousarray(values)", "np.ascontiguousarray(values[:1])"),
        "the checksum is of the first layer alone",
        "test_stored_volumes.py -k 'checksum'",
    ),
)

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
        *("opengl", "compositor:Compositor.picture"),
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
        *("slicing", "cells:_along_rows"),
        *("np.maximum(starts - 1, 0)", "np.maximum(starts, 0)"),
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
        *("geometry", "surfaces.marching_cubes:marching_cubes"),
        *("[used, ::-1].astype(np.float64) - 1", "[used, ::-1].astype(np.float64)"),
        "a surface lies one sample off",
        "test_geometry_extraction.py",
    ),
    Mistake(
        *("geometry", "extraction:surface_of"),
        *("is_mirrored = np.linalg.det(volume.direction) < 0", "is_mirrored = np.linalg.det(volume.direction) > 0"),
        "triangles are turned around on right-handed grids",
        "test_geometry_extraction.py",
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

MISTAKES = (*_UPPER, *_LOWER, *IN_SHADERS, *IN_STAGES)
