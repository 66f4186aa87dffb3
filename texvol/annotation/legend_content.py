"""Contents of legends, one for each volume that is coloured by value or by label: colours, opacity, caption, names."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from texvol.annotation import rounding
from texvol.annotation.lettering import Lettering
from texvol.annotation.marks import Numbers
from texvol.scene.air import HOUNSFIELD
from texvol.scene.channel import called as channel_called
from texvol.scene.display import Window, found_window, grey, isosurface_looks, number_colors, straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.label_names import names_of
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.transfer import Classified, TransferFunction
from texvol.scene.transfer.pieces import LARGEST_VALUE
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_MARGIN = 0.05  # of the range in which colours change, added at both ends
_NEARLY_ALL = np.log(10)  # optical depth of opacity 0.9, which the densest medium reaches in the legend
_CHOSEN = ("variable", "series", "time")  # options that tell volumes of one file apart
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

    @property
    def texts(self) -> list[str]:
        """Texts that come from files and arguments."""
        return [self.caption, *(self.bar.opacity_of if self.bar else ()), *(name for name, _ in self.entries)]


def contents_of(scene: Scene, value_name: str, window: Window | None, letters: Lettering) -> list[Content]:
    """Return the contents of a scene's legends, in the order of its volumes; `window` is that of `display.shown`.

    With several volumes, legends are named after the files; `value_name` names the first. Volumes with a colour for
    each sample have no legend. InputError if the mode is xray or average and `window` is missing.
    """
    contents = []
    for number, each in enumerate(scene.completed((1, 1)).each_alone(), 1):
        name = value_name if number == 1 else ""
        if each.volume.colors is not None:
            continue
        if scene.added:
            name = name.strip() or _name(each.volume, number, letters)
        if each.volume.labels:
            contents.append(_labels(each, name, letters))
        else:
            contents.append(_content_of(each, name, window))
    return contents


def _labels(scene: CompleteScene, name: str, letters: Lettering) -> Content:
    """Return the visible labels with their colours, by names of the transfer function or the table, or by number."""
    medium = scene.medium
    names, colors = medium.materials, [np.array(color) for color in medium.material_colors]
    if not colors:
        labels = label_counts(scene.volume).labels.astype(np.float64)
        seen = labels[medium.classify(labels).extinction > 0]
        known = names_of(scene.volume, map(int, seen))
        names = tuple(known.get(int(label), f"{label:.0f}") for label in seen)
        colors = list(straight_colors(medium, seen))
    entries = zip((_drawable(each.removeprefix("label "), letters) for each in names), colors, strict=True)
    return Content(name.strip() or "label", None, tuple(entries))


def _drawable(name: str, letters: Lettering) -> str:
    """Return a label's name, with a question mark for each letter that the font lacks."""
    try:
        letters.check(name, "legend")
    except InputError:
        return "".join(letter if _is_drawn(letter, letters) else "?" for letter in name)
    return name


def _is_drawn(letter: str, letters: Lettering) -> bool:
    try:
        letters.check(letter, "legend")
    except InputError:
        return False
    return True


def _name(volume: Volume, number: int, letters: Lettering) -> str:
    """Return a volume's name: its channel, the options that choose it, and its file."""
    channel = channel_called(volume.channel, volume.source.get("channel"))
    chosen = [f"{what} {volume.source[what]}" for what in _CHOSEN if what in volume.source]
    # The file comes last, because long names are cut at the end.
    name = ", ".join([*filter(None, [channel]), *chosen, Path(volume.name).name])
    try:
        letters.check(name, "legend")
    except InputError:  # the font lacks a letter of the file's name
        return f"volume {number}"
    return name


def _content_of(scene: CompleteScene, value_name: str, window: Window | None) -> Content:
    """Return the contents of a scene's legend."""
    name = value_name.strip() or "value"
    if scene.mode == "isosurface":
        shells = zip(scene.isovalues, isosurface_looks(scene), strict=True)
        return Content("", None, tuple((f"{name} = {rounding.plain(value)}", look[:3]) for value, look in shells))
    if scene.mode == "composite":
        transfer = scene.medium
        looks: tuple[Numbers | None, ...] = tuple(np.array(color) for color in transfer.material_colors)
        looks = looks or (None,) * len(transfer.materials)
        return Content(name, _medium(transfer, scene.volume), tuple(zip(transfer.materials, looks, strict=True)))
    caption = _of_xray(scene, name) if scene.mode == "xray" else value_name.strip() or _NUMBERS[scene.mode]
    if (given := number_colors(scene, window)) is not None:
        low, high = _shown_range(given, scene.volume)
        return Content(caption, ColorBar(low, high, lambda values: straight_colors(given, values)))
    return Content(caption, _grey(scene, window))


def _of_xray(scene: CompleteScene, name: str) -> str:
    """Return the name of the numbers of an X-ray."""
    length = scene.volume.unit or "length"
    if scene.air == HOUNSFIELD:
        return f"{length} of water"
    above = "" if scene.air is None or scene.air == 0 else f" above {rounding.plain(scene.air)}"
    return f"{name}{above} × {length}"


def _grey(scene: CompleteScene, window: Window | None) -> ColorBar:
    if window is None:
        if scene.mode in ("xray", "average"):
            raise InputError(
                f"annotation: window is missing; the legend of mode {scene.mode} needs the window of values"
            )
        window = found_window(np.zeros((0, 0, 4)), scene)
    centre, width = window
    return ColorBar(
        centre - width / 2, centre + width / 2, lambda values: np.repeat(grey(values, window)[:, np.newaxis], 3, axis=1)
    )


def _medium(transfer: TransferFunction, volume: Volume) -> ColorBar:
    """Return a medium's colours, and its opacity over a round length in which the densest value is nearly opaque."""
    low, high = _shown_range(transfer, volume)
    extinctions = _at_full_gradient(transfer, np.linspace(low, high, 1025)).extinction
    extinctions = np.append(extinctions, [contour.extinction for contour in transfer.contours])
    densest = float(np.max(extinctions, where=np.isfinite(extinctions), initial=0.0))
    reach = rounding.round_up(_NEARLY_ALL / densest if densest > 0 else volume.smallest_spacing)
    length = float(reach)

    def opacities(values: Numbers) -> Numbers:
        return -np.expm1(-_at_full_gradient(transfer, values).extinction * length)

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
    return ColorBar(low, high, lambda values: _straight(transfer, values), opacities, tuple(lines), contours)


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


def _at_full_gradient(transfer: TransferFunction, values: Numbers) -> Classified:
    """Return emission and extinction at the gradient at which each part is strongest, without contours."""
    modulation = None if transfer.modulation is None else np.array([[0.0, transfer.modulation[:, 1].max()]])
    graded = tuple(replace(part, start=0.0, full=0.0) for part in transfer.graded)
    return replace(transfer, modulation=modulation, graded=graded, contours=()).classify(values, 0.0)


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
