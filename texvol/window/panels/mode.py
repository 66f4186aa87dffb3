"""Mode and classification; the integrand of an X-ray, and the colouring of numbers."""

from __future__ import annotations

from imgui_bundle import imgui

from texvol.scene.air import AIR, HOUNSFIELD, air_in_8_bits
from texvol.scene.display import possible_range
from texvol.scene.scene import CLASSIFICATIONS, COLORINGS, MODES, NUMBER_MODES, Scene
from texvol.window import editing
from texvol.window.desk import Desk
from texvol.window.panels import parts

_COLORING_NAMES = dict(zip(COLORINGS, ("grey", "transfer function"), strict=True))
_NO_AIR, _VALUE = "plain integral", "above a value"


def show(desk: Desk, scene: Scene) -> None:
    """Show the controls."""
    mode = parts.choice("mode", scene.mode, MODES)
    if mode != scene.mode:
        desk.change(**editing.with_mode(scene, mode))
        return
    if scene.mode == "composite":
        kind = parts.choice("classification", scene.classification, CLASSIFICATIONS)
        if kind != scene.classification:
            desk.change(classification=kind)
    if scene.mode == "isosurface" and scene.isovalue is not None:
        low, high = scene.volume.finite_range or (0.0, 1.0)
        changed, value = parts.slider("isovalue", scene.isovalue, low, high)
        if changed:
            desk.change("isovalue", isovalue=value)
    if scene.mode == "xray":
        _air(desk, scene)
    if scene.mode in NUMBER_MODES:
        _numbers(desk, scene)


def _air(desk: Desk, scene: Scene) -> None:
    """Show the integrand of an X-ray."""
    now = scene.air if scene.air == HOUNSFIELD else _NO_AIR if scene.air is None else _VALUE
    chosen = parts.choice("integrates", str(now), (HOUNSFIELD, _VALUE, _NO_AIR))
    low, high = scene.volume.finite_range or (0.0, 1.0)
    if chosen != now:
        usual = air_in_8_bits(scene.volume)
        value = AIR if usual == HOUNSFIELD else low
        desk.change(air={HOUNSFIELD: HOUNSFIELD, _VALUE: value, _NO_AIR: None}[chosen])
    elif isinstance(scene.air, float):
        changed, value = parts.slider("value of air", scene.air, min(low, scene.air), max(high, scene.air))
        if changed:
            desk.change("air", air=value)


def _numbers(desk: Desk, scene: Scene) -> None:
    """Show the colouring of numbers, and the window of grey values."""
    assert desk.document is not None
    showing, names = desk.document.showing, list(_COLORING_NAMES.values())
    now = "grey" if showing.window is not None else scene.coloring
    chosen = names.index(parts.choice("numbers", _COLORING_NAMES[now], names))
    if COLORINGS[chosen] != now:
        desk.document.show(window=None)
        desk.change(**editing.with_coloring(scene, COLORINGS[chosen]))
    elif now == "grey":
        _window(desk, scene)


def _window(desk: Desk, scene: Scene) -> None:
    assert desk.document is not None
    showing, shown = desk.document.showing, desk.director.shown
    found = imgui.checkbox("automatic black and white", showing.window is None)
    low, high = possible_range(scene)
    if found[0]:
        seen = shown.metadata.get("window") if shown is not None else None
        centre, width = seen or ((low + high) / 2, high - low)
        desk.document.show(window=None if found[1] else (centre, max(width, 1e-300)))
    elif showing.window is not None:
        centre, width = showing.window
        changed, centre = parts.slider("centre", centre, low, high)
        wider, width = parts.slider("width", width, 1e-3 * (high - low), 2 * (high - low))
        if changed or wider:
            desk.document.show(window=(centre, max(width, 1e-300)))
