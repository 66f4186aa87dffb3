"""Values of a measure in the Measure tab: tables, the plot of a profile, and volumes of labels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui, implot

from texvol.annotation.rounding import grouped
from texvol.scene.measures.measure import Measure, Point
from texvol.scene.measures.values import Measured, Profile, Quantity
from texvol.window import measure_changes
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.naming import shortened
from texvol.window.navigation import triple
from texvol.window.panels import parts
from texvol.window.panels.measure_letters import in_letters
from texvol.window.stand_in import StandIn

_DIGITS = 5
_PLOT = 170.0  # height, window coordinates at scale 1
_LINE = 1.6  # width of a curve
_ROWS = 9  # of the table of labels, which scrolls
_HEADS = ("number and name of the label", "samples that have it", "their volume in the world")  # tooltips
_WIDTHS = (1.6, 1.0, 1.1)  # of its columns, relative: names are longer than numbers
_LETTERS = 14  # of a volume's name
_MOST_PLOTTED = 4000  # points of a plotted line


def show(desk: Desk, document: Document, found: Measured, each: Measure) -> None:
    """Show the values of a measure."""
    own = [quantity for quantity in found.quantities if not quantity.volume]
    rows = [(quantity.what, _text(quantity)) for quantity in own]
    if each.kind in ("ruler", "profile"):
        steps = np.abs(np.subtract(each.points[1], each.points[0]))
        for axis, step in zip("xyz", steps.tolist(), strict=True):
            rows.append((f"along {axis}", _text(Quantity("", step, own[0].unit))))
    if each.kind == "angle":
        arms = np.linalg.norm(np.array(each.points)[[0, 2]] - np.array(each.points)[1], axis=1)
        unit = document.scene.volume.unit
        rows += [(f"arm {number}", _text(Quantity("", float(arm), unit))) for number, arm in enumerate(arms, 1)]
    if found.profile is not None:
        apart = found.profile.distances[1] - found.profile.distances[0]
        rows.append(("between points", _text(Quantity("", float(apart), own[0].unit))))
        desk.panel_state["profile at"] = _plot(found.profile, document.scene.volume.unit)
    _pairs("own", rows)
    if each.kind == "box":
        _of_volumes(found)
    if each.kind in ("box", "profile") and any(isinstance(volume, StandIn) for volume in document.scene.volumes):
        parts.note("Of the level in memory; `texvol measure` takes all samples of the store.")


def labels(desk: Desk, document: Document) -> None:
    """Show the number of samples and the volume of each label."""
    if not any(volume.labels for volume in document.scene.volumes):
        return
    imgui.separator_text("Labels")
    found = measure_changes.labels_of(desk)
    if found is None:
        imgui.text_disabled("counting …")
    for each in found or ():
        if len(found or ()) > 1:
            imgui.text_unformatted(shortened(each.name, 2 * _LETTERS))
        _labels(each)


def _labels(each: Measured) -> None:
    """Show a table of labels, that scrolls if they are many."""
    samples, volumes = each.quantities[0::2], each.quantities[1::2]
    unit = volumes[0].unit if volumes else ""
    line = imgui.get_text_line_height() + 2 * imgui.get_style().cell_padding.y
    height = line * (min(len(samples), _ROWS) + 1) + 2
    flags = imgui.TableFlags_.scroll_y | imgui.TableFlags_.row_bg
    if not imgui.begin_table(f"labels {each.name}", 3, flags, imgui.ImVec2(0, height)):
        return
    imgui.table_setup_scroll_freeze(0, 1)
    heads = "label", "samples", f"volume ({unit})" if unit else "volume"
    for head, width in zip(heads, _WIDTHS, strict=True):
        imgui.table_setup_column(head, imgui.TableColumnFlags_.width_stretch.value, width)
    imgui.table_next_row(imgui.TableRowFlags_.headers)
    for head, tip in zip(heads, _HEADS, strict=True):
        imgui.table_next_column()
        imgui.table_header(head)
        imgui.set_item_tooltip(tip)
    clipper = imgui.ListClipper()
    clipper.begin(len(samples))
    while clipper.step():
        for position in range(clipper.display_start, clipper.display_end):
            count, volume = samples[position], in_letters(grouped(volumes[position].value, _DIGITS))
            label = f"{count.label} {count.label_name}".rstrip()
            imgui.table_next_row()
            imgui.table_next_column()
            imgui.text_unformatted(parts.fitting(label, imgui.get_content_region_avail().x))
            imgui.set_item_tooltip(label)
            for cell in (f"{int(count.value):,}", volume):
                imgui.table_next_column()
                imgui.text_unformatted(cell)
    clipper.end()
    imgui.end_table()


def _pairs(name: str, rows: Sequence[tuple[str, str]]) -> None:
    """Show names and values in two columns."""
    if not imgui.begin_table(name, 2, imgui.TableFlags_.sizing_stretch_same):
        return
    for what, text in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_disabled(what)
        imgui.table_next_column()
        imgui.text_unformatted(text)
    imgui.end_table()


def _of_volumes(found: Measured) -> None:
    """Show the statistics of the samples inside a box, a column for each volume."""
    volumes = list(dict.fromkeys(quantity.volume for quantity in found.quantities if quantity.volume))
    whats = list(dict.fromkeys(_named(quantity) for quantity in found.quantities if quantity.volume))
    texts = {(_named(each), each.volume): _text(each) for each in found.quantities if each.volume}
    flags = imgui.TableFlags_.sizing_stretch_same | imgui.TableFlags_.row_bg
    if not imgui.begin_table("volumes", len(volumes) + 1, flags):
        return
    if len(volumes) > 1:
        imgui.table_next_row()
        for head in ("", *volumes):
            imgui.table_next_column()
            imgui.text_disabled(shortened(head, _LETTERS))
            if head:
                imgui.set_item_tooltip(head)
    for what in whats:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_disabled(parts.fitting(what, imgui.get_content_region_avail().x))
        imgui.set_item_tooltip(what)
        for volume in volumes:
            imgui.table_next_column()
            imgui.text_unformatted(texts.get((what, volume), ""))
    imgui.end_table()


def _named(quantity: Quantity) -> str:
    what = quantity.what.removeprefix("standard ")  # the column is narrow
    if quantity.label is None:
        return what
    return (
        f"{quantity.label} {quantity.label_name}: {what}" if quantity.label_name else f"label {quantity.label}: {what}"
    )


def _plot(profile: Profile, unit: str) -> Point | None:
    """Show the values along the line, a curve for each volume; return the world point under the mouse."""
    flags = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
    flags |= implot.Flags_.no_legend if len(profile.volumes) == 1 else 0
    if not implot.begin_plot("##profile", imgui.ImVec2(-1, _PLOT * parts.scale()), flags):
        return None
    above = implot.LegendFlags_.outside | implot.LegendFlags_.horizontal
    implot.setup_legend(implot.Location_.north_west, above)
    fit = implot.AxisFlags_.auto_fit | implot.AxisFlags_.no_highlight
    implot.setup_axes(f"distance ({unit})" if unit else "distance", "", fit, fit)
    step = max(len(profile.distances) // _MOST_PLOTTED, 1)
    distances = np.ascontiguousarray(profile.distances[::step])
    for name, values in zip(profile.volumes, profile.values, strict=True):
        spec = implot.Spec()
        spec.line_weight = _LINE * parts.scale()
        implot.plot_line(shortened(name, 2 * _LETTERS), distances, np.ascontiguousarray(values[::step]), spec)
    at = implot.get_plot_mouse_pos().x if implot.is_plot_hovered() else None
    implot.end_plot()
    return None if at is None else _hovered(profile, at, unit)


def _hovered(profile: Profile, distance: float, unit: str) -> Point:
    """Show the values of the point nearest to a distance in a tooltip; return the point."""
    number = int(np.abs(profile.distances - distance).argmin())
    lines = [f"at {grouped(float(profile.distances[number]), _DIGITS)} {unit}".strip()]
    for name, values, value_unit in zip(profile.volumes, profile.values, profile.units, strict=True):
        value = in_letters(grouped(float(values[number]), _DIGITS)) if np.isfinite(values[number]) else "outside"
        lines.append(f"{name}: {value} {value_unit}".strip() if len(profile.volumes) > 1 else f"{value} {value_unit}")
    imgui.set_tooltip("\n".join(lines))
    return triple(profile.points[number])


def _text(quantity: Quantity) -> str:
    if quantity.what.endswith("samples"):
        return f"{int(quantity.value):,}"
    number = in_letters(grouped(quantity.value, _DIGITS))
    return f"{number}°" if quantity.unit == "°" else f"{number} {quantity.unit}".strip()
