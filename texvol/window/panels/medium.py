"""Medium tab: mode, classification, and the editor of the transfer function over the histogram."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import imgui, implot

from texvol.scene import transfer
from texvol.scene.display import number_colors
from texvol.scene.looks import look_of
from texvol.scene.scene import NUMBER_MODES, Scene
from texvol.scene.transfer import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.window import editing
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.editing import Curve, extinction_of, opacity_of
from texvol.window.histogram import Histogram
from texvol.window.naming import volume_called
from texvol.window.panels import axis, labels, mode, parts, tips

# Fraction of the panel: with a height of 600 pixels, all controls of the curve are visible without scrolling.
_PLOT_FRACTION = 0.26
_LOWEST_PLOT, _HIGHEST_PLOT = 90.0, 260.0  # window coordinates at scale 1
_LENGTH = 1 / 20  # of the box's mean edge: over that length, proposed transfer functions use the plot's height
_MOST_OPACITY = 0.9999  # by dragging: a switch makes a point opaque
_ENOUGH = 40  # points: more points would overlap
_POINT = 6.0
_EXTINCTION = 0.45  # fraction of the width beside the switch: the rest is for the unit
_REMEMBERED = 100  # names of transfer functions
_LETTERS = 22  # of a file name: leaves room for a channel's number
_NO_BUTTON = 4  # no mouse button has this number


def show(desk: Desk, document: Document) -> None:
    """Show the Medium tab."""
    scene = document.scene
    mode.show(desk, scene)
    imgui.separator_text("Transfer function")
    number = _volume_number(desk, scene)
    medium = editing.owner_of(scene, number).transfer_function
    if medium is None or scene.volumes[number].labels:
        parts.steps(desk)
    if medium is None:
        imgui.text_disabled("No transfer function: the mode shows numbers." if number == 0 else "No transfer function.")
        return
    if scene.mode in NUMBER_MODES and number_colors(scene, document.showing.window) is None:
        imgui.text_disabled("The mode shows numbers and does not use the transfer function.")
    if scene.volumes[number].labels:
        labels.show(desk, scene, medium, number)
        return
    _presets(desk, document, medium, number)
    _curve(desk, document, medium, number)


def _volume_number(desk: Desk, scene: Scene) -> int:
    """Return the number of the edited volume; show a choice if there are several volumes."""
    state, number = desk.panel_state, 0
    if scene.added:
        names = [f"{position + 1}: {volume_called(each, _LETTERS)}" for position, each in enumerate(scene.volumes)]
        imgui.set_next_item_width(-1)  # wide, because names of volumes from one file differ at their ends
        number = names.index(parts.choice("##volume", names[min(state.get("volume", 0), len(names) - 1)], names))
        imgui.set_item_tooltip(f"volume {number + 1}: {volume_called(scene.volumes[number])}")
        state["volume"] = number
    if state.get("edited") is not scene.volumes[number]:  # forget the state of the editor
        state["edited"] = scene.volumes[number]
        for key in ("named", "curve_of", "length", "density", "look_of"):
            state.pop(key, None)
    return number


@dataclass(frozen=True)
class _Named:
    """Transfer function with its displayed name and, for a preset, its materials and which of them are shown."""

    medium: TransferFunction
    name: str
    materials: tuple[str, ...] = ()
    shown: frozenset[str] = frozenset()


def _presets(desk: Desk, document: Document, medium: TransferFunction, number: int) -> None:
    scene, state = document.scene, desk.panel_state
    if "named" not in state:
        given = document.origin.transfer_function
        opened = (os.path.basename(given) if given else "proposed") if number == 0 else "as opened"
        found = medium.materials if opened in transfer.PRESETS else ()
        state["named"] = [_Named(medium, opened, found, frozenset(found))]
    # Looked up by the transfer function, because undo may have brought back an earlier one.
    named = next((each for each in state["named"] if each.medium is medium), _Named(medium, "own"))
    names = transfer.PRESETS if named.name in transfer.PRESETS else (named.name, *transfer.PRESETS)
    imgui.set_next_item_width(imgui.get_content_region_avail().x - parts.width_of_steps())
    name = parts.choice("##preset", named.name, names)
    imgui.set_item_tooltip("preset")
    imgui.same_line()
    parts.steps(desk)
    if name != named.name and name in transfer.PRESETS:
        _apply(desk, scene, number, name)
        return
    switched = parts.switches({name: name in named.shown for name in named.materials})
    chosen = tuple(name for name, is_shown in switched.items() if is_shown)
    if chosen and set(chosen) != named.shown:
        _apply(desk, scene, number, named.name, named.materials, chosen)


def _apply(
    desk: Desk, scene: Scene, number: int, name: str, every: tuple[str, ...] = (), chosen: tuple[str, ...] | None = None
) -> None:
    """Set a preset, or the chosen ones of its materials."""

    def load() -> None:
        look = look_of(name, scene.volumes[number], chosen)
        found = look.transfer_function
        if desk.change(**editing.with_look(scene, number, look)):
            named = _Named(found, name, every or found.materials, frozenset(chosen or found.materials))
            desk.panel_state["named"] = [*desk.panel_state["named"][-_REMEMBERED:], named]

    desk.attempt(load)


def _curve(desk: Desk, document: Document, medium: TransferFunction, number: int) -> None:
    state, box = desk.panel_state, document.scene.volumes[number]
    histogram = document.histogram(box)
    if state.get("curve_of") is not medium:
        state["curve_of"], state["curve"] = medium, Curve.of(medium)
        state["density"] = 0.0  # log10 of the factor since this curve was set
        # The range of the histogram is extended to the curve's ends, so that all points can be reached.
        low, high = histogram.edges[[0, -1]].tolist()
        state["bounds"] = min(low, state["curve"].points[0].value), max(high, state["curve"].points[-1].value)
        state["selected"] = min(state.get("selected", 0), len(state["curve"].points) - 1)
    curve: Curve = state["curve"]
    length = float(state.setdefault("length", _LENGTH * float(np.linalg.norm(box.box_edges, axis=0).mean())))
    unit = box.unit or "units"
    edited = _plot(state, histogram, medium, curve, length, f"opacity of {length:.3g} {unit}")
    imgui.text_disabled("double click: add a point · right click: remove")
    edited = _selected(state, edited, length, box.unit)
    edited = _whole(state, edited)
    if edited is not curve:
        changed = edited.applied(medium)
        if desk.change("curve", **editing.with_own(document.scene, number, transfer_function=changed)):
            state["curve_of"], state["curve"] = changed, edited
    state["log"] = parts.switch("logarithmic histogram", state.get("log", True))
    wanted = parts.number(f"opacity is per ({unit})", length)
    if wanted > 0:
        state["length"] = wanted


def _plot(
    state: dict[str, Any], histogram: Histogram, medium: TransferFunction, curve: Curve, length: float, title: str
) -> Curve:
    """Show the curve over the histogram, with points to drag, to add by double click and to remove by right click."""
    low, high = state["bounds"]
    scale = parts.scale()
    tall = float(np.clip(_PLOT_FRACTION * imgui.get_window_height(), _LOWEST_PLOT * scale, _HIGHEST_PLOT * scale))
    flags = implot.Flags_.no_legend | implot.Flags_.no_mouse_text | implot.Flags_.no_menus | implot.Flags_.no_title
    flags |= implot.Flags_.no_box_select
    # The name contains the range, because ImPlot remembers the shown range of a plot by its name.
    if not implot.begin_plot(f"##{low!r} {high!r}", imgui.ImVec2(-1, tall), flags):
        return curve
    plain = implot.AxisFlags_.no_highlight | implot.AxisFlags_.no_menus
    implot.setup_axes("", "", plain, plain | implot.AxisFlags_.lock)
    implot.setup_axis_ticks(implot.ImAxis_.y1, [0.0, 0.5, 1.0], ["0", ".5", "1"], False)
    implot.setup_axis_limits(implot.ImAxis_.x1, low - 0.02 * (high - low), high + 0.02 * (high - low))
    implot.setup_axis_limits(implot.ImAxis_.y1, -0.04, 1.06, implot.Cond_.always)
    implot.setup_axis_limits_constraints(implot.ImAxis_.x1, low - (high - low), high + (high - low))
    implot.get_input_map().fit = _NO_BUTTON  # a double click adds a point
    implot.setup_finish()
    _columns(histogram.edges, histogram.heights(state.get("log", True)))
    _line(medium, curve, length, low, high)
    edited = curve
    if len(curve.points) <= _ENOUGH:
        edited = _points(state, curve, length)
    position = implot.get_plot_mouse_pos()
    if (
        edited is curve
        and implot.is_plot_hovered()
        and imgui.is_mouse_double_clicked(0)
        and state.get("over point") is None
    ):
        opacity = float(np.clip(position.y, 0, _MOST_OPACITY))
        edited, state["selected"] = curve.added(float(position.x), extinction_of(opacity, length))
    limits, corner, size = implot.get_plot_limits().x, implot.get_plot_pos(), implot.get_plot_size()
    implot.end_plot()
    at = imgui.ImVec2(corner.x + 6, corner.y + 2)
    imgui.get_window_draw_list().add_text(at, imgui.get_color_u32(imgui.Col_.text_disabled), title)
    under = axis.Axis((limits.min, limits.max), corner.x, size.x)
    axis.bar(under, medium)
    ranged = axis.track(under, state, curve, (low, high))
    return ranged if edited is curve else edited


def _columns(edges: Any, heights: Any) -> None:
    spec = implot.Spec()
    spec.fill_color, spec.line_color = imgui.ImVec4(0.42, 0.47, 0.53, 0.55), imgui.ImVec4(0, 0, 0, 0)
    implot.plot_shaded("histogram", np.repeat(edges, 2)[1:-1], np.repeat(heights, 2), 0.0, spec)


def _line(medium: TransferFunction, curve: Curve, length: float, low: float, high: float) -> None:
    margin = high - low
    points = np.array([point.value for point in curve.points])
    values = np.concatenate([np.linspace(low - margin, high + margin, 768), points, np.nextafter(points, -np.inf)])
    values = np.unique(values)
    opacities = opacity_of(medium.at(values)[:, 3], length)
    spec = implot.Spec()
    spec.line_color, spec.line_weight = imgui.ImVec4(0.95, 0.96, 0.98, 1.0), 2.0
    implot.plot_line("opacity", values, np.ascontiguousarray(opacities), spec)


def _points(state: dict[str, Any], curve: Curve, length: float) -> Curve:
    edited, state["over point"] = curve, None
    removed = None
    for index, point in enumerate(curve.points):
        is_selected = index == state.get("selected")
        ring = imgui.ImVec4(1, 1, 1, 1) if is_selected else imgui.ImVec4(0.75, 0.78, 0.82, 1)
        opacity = float(opacity_of(point.extinction, length))
        spec = implot.Spec()
        spec.marker, spec.marker_size = implot.Marker_.circle.value, _POINT + 2 * is_selected
        spec.marker_fill_color, spec.marker_line_color = parts.shade(srgb_from_linear(np.array(point.color))), ring
        implot.plot_scatter(f"##{index}", np.array([point.value]), np.array([opacity]), spec)
        changed, x, y, clicked, hovered, _ = implot.drag_point(
            index, point.value, opacity, imgui.ImVec4(0, 0, 0, 0), _POINT + 2, implot.DragToolFlags_.none,
            False, False, False,
        )  # fmt: skip
        if hovered:
            state["over point"] = index
            if imgui.is_mouse_clicked(1):
                removed = index
        if clicked:
            state["selected"] = index
        if changed:
            # An opaque point stays opaque until it is dragged down.
            opaque = np.isinf(point.extinction) and y > 0.98
            extinction = point.extinction if opaque else extinction_of(float(np.clip(y, 0, _MOST_OPACITY)), length)
            edited, state["selected"] = edited.moved(index, float(x), extinction), index
    if removed is not None:
        edited, state["selected"] = curve.removed(removed), max(removed - 1, 0)
    return edited


def _selected(state: dict[str, Any], curve: Curve, length: float, unit: str) -> Curve:
    """Show the values of the selected point as numbers."""
    index = state.get("selected", 0)
    if not 0 <= index < len(curve.points) or len(curve.points) > _ENOUGH:
        return curve
    point = curve.points[index]
    imgui.push_id(index)
    color = parts.color("colour", point.color)
    if color != point.color:
        curve = curve.colored(index, color)
    value, extinction = parts.number("value", point.value), point.extinction
    was_opaque = bool(np.isinf(extinction))
    opaque = parts.switch("opaque", was_opaque)
    if opaque != was_opaque:
        extinction = np.inf if opaque else extinction_of(_MOST_OPACITY, length)
    elif not opaque:
        imgui.same_line()
        imgui.set_next_item_width(_EXTINCTION * imgui.get_content_region_avail().x)
        extinction = parts.number(f"extinction /{unit or 'unit'}", extinction)
        opacity = float(opacity_of(point.extinction, length))
        wanted = parts.number(f"opacity /{length:.3g} {unit or 'units'}", opacity)
        if wanted != opacity:
            extinction = extinction_of(float(np.clip(wanted, 0, _MOST_OPACITY)), length)
    if (value, extinction) != (point.value, point.extinction):
        curve = curve.moved(index, value, extinction)
    imgui.pop_id()
    return curve


def _whole(state: dict[str, Any], curve: Curve) -> Curve:
    """Show controls of the whole curve: its range, and a factor of its extinction."""
    ends = curve.points[0].value, curve.points[-1].value
    if ends[1] > ends[0]:
        wanted = parts.ends("range", ends, *state["bounds"])
        curve = curve if wanted == ends else curve.between(*wanted)
    before = state.setdefault("density", 0.0)
    changed, state["density"] = imgui.slider_float("density", before, -2.0, 2.0, f"x {10**before:.3g}")
    tips.show("density")
    return curve.denser(10 ** (state["density"] - before)) if changed else curve
