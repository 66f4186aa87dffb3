"""Changes of the list of volumes by panels and commands; each is one step of the undo history.

Commands name a volume by its number in the list, from 1:

    eye 2                    hide it, or show it
    solo 2                   show it alone; once more, show all
    remove 1                 take it out of the scene
    as-labels 2              take its values as labels, or as measured values
    opacity 2 0.5            half as dense as it was
    color 2 #ff8000          in one hue
    spacing 1 1,1,2.5        another distance of samples
    transform 2 FILE         moved by the matrix of a file; `none` takes it back
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

from texvol.options import files, texts
from texvol.scene.transfer import proposed_beside, proposed_for
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window import placing, volume_list
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.tinting import Color, tint_of
from texvol.window.volume_list import Entry


def entries(document: Document) -> list[Entry]:
    """Return all volumes of the open scene, hidden ones included."""
    return volume_list.entries(document.scene, document.off)


def apply(desk: Desk, document: Document, found: Sequence[Entry], stroke: str | None = None) -> None:
    """Make these volumes those of the scene."""
    desk.change(stroke, **volume_list.changed(found, document.off))


def toggle(desk: Desk, document: Document, number: int) -> None:
    """Hide a volume, or show it."""
    found = entries(document)
    entry = found[number]
    if entry.shown and document.scene.mode != "composite":
        raise InputError(f"a volume is hidden in mode composite only, got mode {document.scene.mode}")
    apply(desk, document, volume_list.with_entry(found, number, replace(entry, shown=not entry.shown)))


def solo(desk: Desk, document: Document, number: int) -> None:
    """Show a volume alone; if it is alone, show all."""
    found = entries(document)
    is_alone = [at for at, each in enumerate(found) if each.shown] == [number]
    wanted = [replace(each, shown=is_alone or at == number) for at, each in enumerate(found)]
    if wanted != found:
        apply(desk, document, wanted)


def remove(desk: Desk, document: Document, number: int) -> None:
    """Take a volume out of the scene; the next one becomes the first."""
    found = volume_list.with_entry(entries(document), number)
    if not found:
        raise InputError("the only volume of a scene stays: open another file instead")
    if not any(each.shown for each in found) and document.scene.mode != "composite":
        found[0] = replace(found[0], shown=True)
    apply(desk, document, found)


def set_opacity(desk: Desk, document: Document, number: int, factor: float) -> None:
    """Make a volume so many times as dense as its transfer function was."""
    found = entries(document)
    medium = found[number].owner.medium
    changed = replace(tint_of(medium), opacity=factor).applied()
    found = volume_list.with_owner(found, number, transfer_function=changed)
    apply(desk, document, found, f"opacity {number}")


def set_color(desk: Desk, document: Document, number: int, color: Color | None) -> None:
    """Show a volume in one hue, or in the colours that its transfer function had."""
    found = entries(document)
    changed = replace(tint_of(found[number].owner.medium), color=color).applied()
    found = volume_list.with_owner(found, number, transfer_function=changed)
    apply(desk, document, found, f"color {number}")


def set_spacing(desk: Desk, document: Document, number: int, spacing: Sequence[float]) -> None:
    """Give a volume another spacing."""
    _replace(desk, document, number, lambda volume: placing.with_spacing(volume, spacing))


def set_transform(desk: Desk, document: Document, number: int, path: str | None) -> None:
    """Move a volume by the matrix of a file, or back to where its own file says."""
    matrix = files.TransformChoice(path=path).matrix() if path else placing.IDENTITY
    _replace(desk, document, number, lambda volume: placing.with_transform(volume, matrix))


def _replace(desk: Desk, document: Document, number: int, change: Callable[[Volume], Volume]) -> None:
    found = entries(document)
    owner = found[number].owner
    volume = change(owner.volume)
    document.adopt(volume, owner.volume)
    # The proposal for a volume is of that object; another one would be proposed anew.
    parts = {"volume": volume, "transfer_function": owner.transfer_function}
    apply(desk, document, volume_list.with_owner(found, number, **parts))


def set_labels(desk: Desk, document: Document, number: int, on: bool) -> None:
    """Take the values of a volume as labels, each with a colour, or as measured values; read on a thread."""
    before = entries(document)[number].owner.volume

    def make() -> Volume:
        volume = placing.with_labels(before, on)
        document.histogram(volume)
        proposed_for(volume)
        return volume

    def take(volume: Volume) -> None:
        found = entries(document)
        here = next((at for at, each in enumerate(found) if each.owner.volume is before), None)
        if here is not None:
            medium = proposed_for(volume) if on or here == 0 else proposed_beside(volume, here - 1)
            apply(desk, document, volume_list.with_owner(found, here, volume=volume, transfer_function=medium))

    desk.fetch(before.name, make, take)


def command(name: str) -> Callable[[Desk, Document, str], None]:
    """Return the command of that name, for `texvol.window.commands`."""

    def run(desk: Desk, document: Document, words: str) -> None:
        number, _, rest = words.partition(" ")
        desk.attempt(lambda: _run(desk, document, name, _position(document, number), rest.strip()))

    return run


def _position(document: Document, word: str) -> int:
    count = len(entries(document))
    if not word.isdigit() or not 1 <= int(word) <= count:
        raise InputError(f"volume must be a number from 1 to {count}, got {word!r}")
    return int(word) - 1


def _run(desk: Desk, document: Document, name: str, number: int, words: str) -> None:
    try:
        if name == "eye":
            toggle(desk, document, number)
        elif name == "solo":
            solo(desk, document, number)
        elif name == "remove":
            remove(desk, document, number)
        elif name == "as-labels":
            set_labels(desk, document, number, not entries(document)[number].owner.volume.labels)
        elif name == "opacity":
            set_opacity(desk, document, number, texts.opacity_factor(words))
        elif name == "color":
            set_color(desk, document, number, texts.color(words))
        elif name == "spacing":
            set_spacing(desk, document, number, texts.triple(words))
        else:
            set_transform(desk, document, number, None if words in ("", "none") else words)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"{name} {error}") from None


COMMANDS = ("eye", "solo", "remove", "as-labels", "opacity", "color", "spacing", "transform")
