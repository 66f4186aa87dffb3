"""Legends of a scene: one for each volume that is coloured by value or by label."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texvol.annotation.legend_content import Content, content_of
from texvol.annotation.lettering import Lettering
from texvol.scene.display import Window, straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_CHOSEN = ("variable", "series", "channel", "time")  # options that tell volumes of one file apart


def contents_of(scene: Scene, value_name: str, window: Window | None, letters: Lettering) -> list[Content]:
    """Return the contents of a scene's legends, in the order of its volumes; arguments as for `content_of`.

    With several volumes, legends are named after the files; `value_name` names the first. Volumes with a colour for
    each sample have no legend.
    """
    contents = []
    for number, each in enumerate(scene.completed((1, 1)).each_alone(), 1):
        name = value_name if number == 1 else ""
        if each.volume.colors is not None:
            continue
        if scene.added:
            name = name.strip() or _name(each.volume, number, letters)
        if each.volume.labels:
            contents.append(_labels(each, name))
        else:
            contents.append(content_of(each, name, window))
    return contents


def _labels(scene: CompleteScene, name: str) -> Content:
    """Return the visible labels with their colours, by the transfer function's names or by number."""
    medium = scene.medium
    names, colors = medium.materials, [np.array(color) for color in medium.material_colors]
    if not colors:
        labels = label_counts(scene.volume).labels.astype(np.float64)
        seen = labels[medium.classify(labels).extinction > 0]
        names, colors = tuple(f"{label:.0f}" for label in seen), list(straight_colors(medium, seen))
    entries = zip((each.removeprefix("label ") for each in names), colors, strict=True)
    return Content(name.strip() or "label", None, tuple(entries))


def _name(volume: Volume, number: int, letters: Lettering) -> str:
    """Return a volume's name: the options that choose it, and its file."""
    chosen = [f"{what} {volume.source[what]}" for what in _CHOSEN if what in volume.source]
    name = ", ".join([*chosen, Path(volume.name).name])  # the file last, because long names are cut at the end
    try:
        letters.check(name, "legend")
    except InputError:  # the font lacks a letter of the file's name
        return f"volume {number}"
    return name
