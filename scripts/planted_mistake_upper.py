"""Mistakes in the upper packages, from `cli` down."""

from __future__ import annotations

from planted_mistake_sources import Mistake

UPPER = (
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
        *("window", "lineage:adjusted"),
        *("base = before.base or medium", "base = medium"),
        "range and opacity are applied to what range and opacity have made",
        "test_window_layers.py -k 'command_line or lost'",
    ),
    Mistake(
        *("window", "lineage:remembered"),
        *("replace(lineage, base=None) if lineage.base is medium else lineage", "lineage"),
        "a transfer function is held by its own lineage",
        "test_window_layers.py -k 'lineage_ends'",
    ),
    Mistake(
        *("window", "layers:Layers.merged"),
        *("color=right if number else left", "color=left"),
        "a colour map in steps has no steps",
        "test_window_layers.py -k 'another_colour_map'",
    ),
    Mistake(
        *("window", "layers:Layers.with_curve"),
        *(
            "points = (replace(each, color=triple(color_at(self.palette, each.value))) for each in curve.points)\n"
            "        return Layers(Curve(tuple(points)), self.palette)",
            "return Layers(curve)",
        ),
        "a point that is moved over a colour map takes its colour along",
        "test_window_layers.py -k 'moves_over'",
    ),
    Mistake(
        *("window", "gestures:Drag._denser"),
        *("extinction_of(there, length) / extinction_of(here, length)", "there / here"),
        "a curve that is pulled does not come to the mouse",
        "test_window_gestures.py -k 'pulled'",
    ),
    Mistake(
        *("window", "gestures:widened"),
        *("about - (about - low) * factor", "low"),
        "a curve is widened about its low end",
        "test_window_gestures.py -k 'wide or wheel'",
    ),
    Mistake(
        *("window", "opacity_shapes:with_opacities"),
        *("layers = Layers(curve).with_palette(palette)", "layers = Layers(curve)"),
        "an opacity shape loses the colours between its points",
        "test_window_layers.py -k 'shape_leaves'",
    ),
    Mistake(
        *("window", "strips:_filled"),
        *("rows = 1 - (np.arange", "rows = (np.arange"),
        "strips hang from their upper edge",
        "test_window_looks.py -k 'strip_shows_colours'",
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
        *("scene", "orbit:cameras"),
        *("360 * number / count", "360 * number / max(count - 1, 1)"),
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
        *("int(match[1]), int(match[2] or match[1])", "int(match[2] or match[1]), int(match[1])"),
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
        *("formats", "scene_metadata:_crc32_of"),
        *("np.ascontiguousarray(values)", "np.ascontiguousarray(values[:1])"),
        "the checksum is of the first layer alone",
        "test_stored_volumes.py -k 'checksum'",
    ),
)
