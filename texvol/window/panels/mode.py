"""Mode and classification; the integrand of an X-ray, and the colouring of numbers."""

from __future__ import annotations

from texvol.scene.air import AIR, HOUNSFIELD, air_in_8_bits
from texvol.scene.display import possible_range
from texvol.scene.scene import CLASSIFICATION_CHOICES, COLORINGS, MODES, NUMBER_MODES, Scene
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
        desk.change(classification=parts.choice("classification", scene.classification, CLASSIFICATION_CHOICES))
    if scene.mode == "isosurface" and scene.isovalue is not None:
        desk.change("isovalue", isovalue=parts.slider("isovalue", scene.isovalue, *_range(scene)))
    if scene.mode == "xray":
        _air(desk, scene)
    if scene.mode in NUMBER_MODES:
        _numbers(desk, scene)


def _range(scene: Scene) -> tuple[float, float]:
    return scene.volume.finite_range or (0.0, 1.0)


def _air(desk: Desk, scene: Scene) -> None:
    """Show the integrand of an X-ray."""
    now = scene.air if scene.air == HOUNSFIELD else _NO_AIR if scene.air is None else _VALUE
    chosen = parts.choice("integrates", str(now), (HOUNSFIELD, _VALUE, _NO_AIR))
    low, high = _range(scene)
    if chosen != now:
        value = AIR if air_in_8_bits(scene.volume) == HOUNSFIELD else low
        desk.change(air={HOUNSFIELD: HOUNSFIELD, _VALUE: value, _NO_AIR: None}[chosen])
    elif isinstance(scene.air, float):
        air = parts.slider("value of air", scene.air, min(low, scene.air), max(high, scene.air))
        desk.change("air", air=air)


def _numbers(desk: Desk, scene: Scene) -> None:
    """Show the colouring of numbers, and the window of grey values."""
    assert desk.document is not None
    names = list(_COLORING_NAMES.values())
    now = "grey" if desk.document.showing.window is not None else scene.coloring
    chosen = COLORINGS[names.index(parts.choice("numbers", _COLORING_NAMES[now], names))]
    if chosen != now:
        desk.document.show(window=None)
        desk.change(**editing.with_coloring(scene, chosen))
    elif now == "grey":
        desk.document.show(window=_window(desk, scene, desk.document.showing.window))


def _window(desk: Desk, scene: Scene, window: parts.Range | None) -> parts.Range | None:
    """Show the controls of the window of grey values; return the window."""
    shown = desk.director.shown
    low, high = possible_range(scene)
    if parts.switch("automatic black and white", window is None):
        return None
    if window is not None:
        return parts.window(("centre", "width"), window, low, high)
    seen = shown.metadata.get("window") if shown is not None else None
    centre, width = seen or ((low + high) / 2, high - low)
    return centre, max(width, 1e-300)
