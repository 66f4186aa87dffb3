"""Which legends a scene has: one for each volume that has colours by value, or by label."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from texvol.annotation.legend_content import Content, content_of
from texvol.annotation.lettering import Lettering
from texvol.scene.display import Window, straight_colors
from texvol.scene.label_counts import label_counts
from texvol.scene.scene import Scene
from texvol.scene.transfer import proposed_for
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_CHOSEN = ("variable", "series", "channel", "time")  # of a file, that tell its volumes apart


def contents_of(scene: Scene, value_name: str, window: Window | None, letters: Lettering) -> list[Content]:
    """What the legends of a scene say, in the order of its volumes; arguments as for `content_of`.

    Several are called after their files, but for one that `value_name` says; volumes with colours of their own have
    none.
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


def _labels(scene: Scene, name: str) -> Content:
    """The labels that are seen, by their colours; by names where the transfer function has some."""
    medium = scene.transfer_function or proposed_for(scene.volume)
    names, colors = medium.materials, [np.array(color) for color in medium.material_colors]
    if not colors:
        labels = label_counts(scene.volume).labels.astype(np.float64)
        seen = labels[medium.classify(labels).extinction > 0]
        names, colors = tuple(f"{label:.0f}" for label in seen), list(straight_colors(medium, seen))
    entries = zip((each.removeprefix("label ") for each in names), colors, strict=True)
    return Content(name.strip() or "label", None, tuple(entries))


def _name(volume: Volume, number: int, letters: Lettering) -> str:
    """What a volume is called: its file, and what was chosen of it."""
    chosen = [f"{what} {volume.source[what]}" for what in _CHOSEN if what in volume.source]
    name = ", ".join([*chosen, Path(volume.name).name])  # in this order, since long ones are cut
    try:
        letters.check(name, "legend")
    except InputError:  # of a file's name nobody has to answer for what a font lacks
        return f"volume {number}"
    return name
