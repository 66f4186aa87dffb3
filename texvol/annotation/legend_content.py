"""Contents of a legend by the scene's mode: colours and opacity of values, caption, names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texvol.annotation import rounding
from texvol.scene.air import HOUNSFIELD
from texvol.scene.display import Window, isosurface_color, number_colors, straight_colors
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.pieces import LARGEST_VALUE, inside
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError

Numbers = NDArray[np.float64]
_MARGIN = 0.05  # of the range in which colours change, added at both ends
_NEARLY_ALL = np.log(10)  # optical depth of opacity 0.9, which the densest medium reaches in the legend
_NUMBERS = {"mip": "largest value", "minip": "least value", "average": "average value"}


@dataclass(frozen=True)
class ColorBar:
    """Colours of the values from `low` to `high`, and their opacity if the values are classified."""

    low: float
    high: float
    colors: Callable[[Numbers], Numbers]  # straight and linear, shape (n, 3); NaN for nothing to show
    opacities: Callable[[Numbers], Numbers] | None = None
    opacity_of: tuple[str, ...] = ()  # lines of text about the length to which the opacity applies
    contours: tuple[tuple[float, Numbers, float], ...] = ()  # value, colour and opacity of single surfaces


@dataclass(frozen=True)
class Content:
    """Caption, colour bar, and names with their colours if these are known."""

    caption: str
    bar: ColorBar | None
    entries: tuple[tuple[str, Numbers | None], ...] = ()


def content_of(scene: Scene, value_name: str, window: Window | None) -> Content:
    """Return the contents of a scene's legend; `window` is that of `display.shown`.

    Raises
    ------
    InputError
        If the mode shows numbers and `window` is missing.
    """
    name = value_name.strip() or "value"
    if scene.mode == "isosurface":
        assert scene.isovalue is not None
        return Content("", None, ((f"{name} = {rounding.plain(scene.isovalue)}", isosurface_color(scene)),))
    if scene.mode == "composite":
        transfer = scene.transfer_function
        if transfer is None:
            from texvol.scene.transfer import proposed_for

            transfer = proposed_for(scene.volume)
        looks: tuple[Numbers | None, ...] = tuple(np.array(color) for color in transfer.material_colors)
        looks = looks or (None,) * len(transfer.materials)
        return Content(name, _medium(transfer, scene.volume), tuple(zip(transfer.materials, looks, strict=True)))
    caption = _of_xray(scene, name) if scene.mode == "xray" else value_name.strip() or _NUMBERS[scene.mode]
    if (given := number_colors(scene, window)) is not None:
        low, high = _shown_range(given, scene.volume)
        return Content(caption, ColorBar(low, high, lambda values: straight_colors(given, values)))
    return Content(caption, _grey(scene, window))


def _of_xray(scene: Scene, name: str) -> str:
    """Return the name of the numbers of an X-ray."""
    length = scene.volume.unit or "length"
    if scene.air == HOUNSFIELD:
        return f"{length} of water"
    above = "" if scene.air is None or scene.air == 0 else f" above {rounding.plain(scene.air)}"
    return f"{name}{above} × {length}"


def texts_of(content: Content) -> list[str]:
    """Return the texts that come from files and arguments."""
    return [content.caption, *(content.bar.opacity_of if content.bar else ()), *(name for name, _ in content.entries)]


def _grey(scene: Scene, window: Window | None) -> ColorBar:
    if window is None:
        if scene.mode in ("xray", "average"):
            raise InputError(
                f"annotation: window is missing; the legend of mode {scene.mode} needs the window of values"
            )
        from texvol.scene.display import found_window

        window = found_window(np.zeros((0, 0, 4)), scene)
    centre, width = window
    low, high = centre - width / 2, centre + width / 2
    if not high > low:
        return ColorBar(centre, centre, lambda values: np.tile(linear_from_srgb(np.full(3, 0.5)), (values.size, 1)))

    def grey(values: Numbers) -> Numbers:
        fractions = np.clip((values - centre) / width + 0.5, 0, 1)
        return np.repeat(linear_from_srgb(fractions)[:, np.newaxis], 3, axis=1)

    return ColorBar(low, high, grey)


def _medium(transfer: TransferFunction, volume: Volume) -> ColorBar:
    """Return a medium's colours, and its opacity over a round length in which the densest value is nearly opaque."""
    low, high = _shown_range(transfer, volume)
    extinctions = _at_full_gradient(transfer, np.linspace(low, high, 1025))[1]
    extinctions = np.append(extinctions, [contour.extinction for contour in transfer.contours])
    densest = float(np.max(extinctions, where=np.isfinite(extinctions), initial=0.0))
    reach = rounding.round_up(_NEARLY_ALL / densest if densest > 0 else volume.smallest_spacing)
    length = float(reach)

    def colors(values: Numbers) -> Numbers:
        return _straight(transfer, values)

    def opacities(values: Numbers) -> Numbers:
        return -np.expm1(-_at_full_gradient(transfer, values)[1] * length)

    contours = tuple(
        (
            contour.value,
            np.minimum(np.array(contour.emission) / max(contour.extinction, 1e-300), 1.0),
            float(-np.expm1(-contour.extinction * length)),
        )
        for contour in transfer.contours
    )
    lines = ["opacity of", rounding.length(reach, volume.unit)]
    if transfer.needs_gradient:
        lines.append("at full gradient")
    return ColorBar(low, high, colors, opacities, tuple(lines), contours)


def _straight(transfer: TransferFunction, values: Numbers) -> Numbers:
    """Return the straight colours of values, in [0, 1], shape (n, 3).

    Without gradients they are the colours of pictures of numbers. Values without emission and extinction get NaN.
    """
    emission, extinction = _at_full_gradient(transfer, values)
    if not transfer.graded:
        colors = straight_colors(transfer, values)
    else:
        weight = np.where(np.isfinite(extinction) & (extinction > 0), extinction, 1.0)
        colors = np.minimum(emission / weight[:, np.newaxis], 1.0)
    nothing = (extinction == 0) & (emission == 0).all(axis=1) & (transfer.glows or bool(transfer.graded))
    return np.where(nothing[:, np.newaxis], np.nan, colors)


def _at_full_gradient(transfer: TransferFunction, values: Numbers) -> tuple[Numbers, Numbers]:
    """Return emission and extinction at the gradient at which each part is strongest, without contours."""
    points = TransferFunction(
        transfer.values, transfer.colors, transfer.extinctions, transfer.emissive, premultiplied=transfer.premultiplied
    ).classify(values)
    emission, extinction = points.emission, points.extinction
    if transfer.modulation is not None:
        most = float(transfer.modulation[:, 1].max())
        opaque = np.isinf(extinction) & (most > 0)
        extinction = np.where(opaque, np.inf, np.where(np.isinf(extinction), 0.0, extinction) * most)
        emission = emission * np.where(opaque, 1.0, most)[:, np.newaxis]
    for part in transfer.graded:
        more = inside(part.values, np.column_stack([part.emissions, part.extinctions]), values)
        emission = emission + np.where(np.isinf(extinction)[:, np.newaxis], 0.0, more[:, :3])
        extinction = extinction + more[:, 3]
    return emission, extinction


def _shown_range(transfer: TransferFunction, volume: Volume) -> tuple[float, float]:
    """Return the range of a volume's values, limited to those between which colours change, and a margin."""
    values = np.concatenate([
        transfer.values,
        *(part.values[np.abs(part.values) < LARGEST_VALUE] for part in transfer.graded),
        [contour.value for contour in transfer.contours],
    ])  # fmt: skip
    low, high = np.clip(volume.finite_range or (0.0, 1.0), -LARGEST_VALUE / 2, LARGEST_VALUE / 2)
    margin = _MARGIN * (float(values.max()) / 2 - float(values.min()) / 2) * 2
    first, last = max(low, float(values.min()) - margin), min(high, float(values.max()) + margin)
    if values.max() > values.min() and last > first:
        low, high = first, last
    if not high > low:
        half = abs(low) / 2 or 0.5
        low, high = low - half, high + half
    return float(low), float(high)
