"""Labels of a volume in the window: which ones a search finds, one label alone, and names from a file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from texvol.formats.label_tables import read_label_table
from texvol.scene.display import straight_colors
from texvol.scene.label_counts import label_counts, share_counts
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.labels import OPACITY, LabelLook, label_function
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window import editing
from texvol.window.desk import Desk
from texvol.window.navigation import triple

Opacities = Mapping[int, float]


def look_of(medium: TransferFunction, volume: Volume) -> LabelLook:
    """Return the colour of each label, and its opacity over one smallest spacing."""
    labels = label_counts(volume).labels
    optics = medium.classify(labels.astype(np.float64))
    opacities = np.clip(editing.opacity_of(optics.extinction, volume.smallest_spacing), 0, 1)
    colors = np.clip(straight_colors(medium, labels.astype(np.float64)), 0, 1)
    names = labels.tolist()
    return LabelLook(
        dict(zip(names, opacities.tolist(), strict=True)), dict(zip(names, map(triple, colors), strict=True))
    )


def matching(labels: Iterable[int], names: Mapping[int, str], text: str) -> list[int]:
    """Return the labels whose number begins with a text, or whose name has all of its words; label 0 is left out."""
    words = text.lower().split()
    return [
        label
        for label in labels
        if label
        and (
            all(word in names.get(label, "").lower() for word in words)
            or (len(words) == 1 and str(label).startswith(words[0]))
        )
    ]


def with_shown(opacities: Opacities, labels: Iterable[int], *, shown: bool) -> dict[int, float]:
    """Return the opacities with labels shown or hidden; a label that is shown already keeps its opacity."""
    return {**opacities, **{label: (opacities[label] or OPACITY) if shown else 0.0 for label in labels}}


def alone(opacities: Opacities, label: int, before: Opacities | None) -> tuple[dict[int, float], Opacities | None]:
    """Return the opacities with one label alone, and those to return to; of a label that is alone, the ones before.

    Parameters
    ----------
    before : mapping, optional
        Opacities before a label was alone.
    """
    if is_alone(opacities, label) and before is not None:
        return {each: before.get(each, opacity) for each, opacity in opacities.items()}, None
    is_any = before is not None and sum(opacity > 0 for opacity in opacities.values()) == 1
    kept = before if is_any and before is not None else opacities
    return {each: (kept[label] or OPACITY) if each == label else 0.0 for each in opacities}, kept


def is_alone(opacities: Opacities, label: int) -> bool:
    """True if no other label is shown."""
    return opacities[label] > 0 and sum(opacity > 0 for opacity in opacities.values()) == 1


def number_of_labels(desk: Desk) -> int:
    """Return the number of the volume whose labels are edited, else of the first one with labels; 0 without labels."""
    if desk.document is None:
        return 0
    volumes, edited = desk.document.scene.volumes, int(desk.panel_state.get("volume", 0))
    candidates = [edited, *range(len(volumes))] if edited < len(volumes) else range(len(volumes))
    return next((number for number in candidates if volumes[number].labels), 0)


def take_names(desk: Desk, number: int, path: str) -> None:
    """Give the labels of a volume the names and colours of a file; opacities stay."""
    document = desk.document
    if document is None or not document.scene.volumes[number].labels:
        desk.say(f"{path}: names of labels need a volume of labels; open one before you add names", fault=True)
        return
    scene = document.scene

    def take(found: tuple[Volume, TransferFunction]) -> None:
        if scene.volumes[number] in document.scene.volumes:
            place = document.scene.volumes.index(scene.volumes[number])
            document.change(**_with_volume(document.scene, place, *found))

    desk.fetch(os.path.basename(path), lambda: _named(scene, number, path), take)


def _named(scene: Scene, number: int, path: str) -> tuple[Volume, TransferFunction]:
    """Return a volume with the table of a file, and its transfer function in the table's colours."""
    volume, medium = scene.volumes[number], editing.owner_of(scene, number).transfer_function
    table = read_label_table(path)
    if not any(label in table.entries for label in label_counts(volume).labels.tolist() if label):
        raise InputError(f"{path}: names none of the labels of {volume.name}")
    other = copy(volume)
    other.label_table = table
    other.source = {**volume.source, "label_names": os.path.abspath(path)} if volume.source else {}
    share_counts(volume, other)
    opacities = None if medium is None else look_of(medium, volume).opacities
    return other, label_function(other, opacities)


def _with_volume(scene: Scene, number: int, volume: Volume, medium: TransferFunction) -> dict[str, Any]:
    if number == 0:
        return {"volume": volume, "transfer_function": medium}
    changed = replace(scene.added[number - 1], volume=volume, transfer_function=medium)
    return {"added": (*scene.added[: number - 1], changed, *scene.added[number:])}
