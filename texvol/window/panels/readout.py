"""Lines of text about a point: the values of all volumes there, names of labels, its position."""

from __future__ import annotations

import numpy as np

from texvol.scene.scene import Scene
from texvol.window.naming import volume_called
from texvol.window.probe import Found

_LETTERS = 24  # of a volume's name


def lines(scene: Scene, found: Found, *, index: bool = False) -> list[str]:
    """Return a line for each volume and one for the position; with `index` also the first volume's nearest sample."""
    several = len(found.all) > 1
    texts = []
    for each in found.all:
        volume = scene.volumes[each.number]
        name = f"{volume_called(volume, _LETTERS)}: " if several else "label " if volume.labels else "value "
        texts.append(name + _value(each.value, each.label, volume.value_unit, labels=volume.labels))
    digits = 2 - int(np.floor(np.log10(scene.volume.smallest_spacing)))  # a hundredth of the distance of samples
    position = ", ".join(f"{round(part, digits) + 0.0:.7g}" for part in found.point.tolist())
    texts.append(f"at {position} {scene.volume.unit}".rstrip())
    if index and found.all[0].index is not None:
        texts.append(f"sample {', '.join(map(str, found.all[0].index))}")
    return texts


def _value(value: float, label: str, unit: str, *, labels: bool) -> str:
    if not np.isfinite(value):
        return "outside" if np.isnan(value) else f"{value:g}"
    if labels:
        return f"{value:.0f}" + (f" {label}" if label else "")
    return f"{value:.5g} {unit}".rstrip()
