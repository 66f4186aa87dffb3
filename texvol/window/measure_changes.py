"""Changes of measures in the window, their values, and their table."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from texvol.annotation import check
from texvol.options import measures as measure_options
from texvol.scene.measures.measure import POINTS, Measure, called
from texvol.scene.measures.table import csv_of, csv_of_profile
from texvol.scene.measures.values import Measured, measure, measured, measured_labels
from texvol.scene.scene import Scene
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.exporting import guarded
from texvol.window.handles import bounds
from texvol.window.navigation import triple

_BOX_SIDE = 0.25  # of the shortest side of the scene's box: side of a new box
_LABELS, _TABLE = "labels", "table"


def update(desk: Desk) -> None:
    """Follow the open document, pass values on, and show faults; once in each frame."""
    desk.measuring.follow(desk.document)
    desk.measuring.counting.update()
    for fault in desk.measuring.counting.faults:
        desk.say(fault, fault=True)
    desk.measuring.counting.faults.clear()


def change(desk: Desk, measures: Sequence[Measure], stroke: str | None = None) -> bool:
    """Change the measures; return False and show a message if they can't be drawn."""
    document = desk.document
    assert document is not None
    wanted = tuple(measures)
    if wanted == document.measures:
        return True

    def apply() -> None:
        if any(each.name for each in wanted if each not in document.measures):
            check(replace(document.showing.annotation, measures=wanted), document.scene)
        document.change(stroke, measures=wanted)

    return desk.attempt(apply)


def replaced(desk: Desk, number: int, other: Measure | None, stroke: str | None = None) -> bool:
    """Change one measure, or remove it."""
    assert desk.document is not None
    measures = desk.document.measures
    return change(desk, (*measures[:number], *([] if other is None else [other]), *measures[number + 1 :]), stroke)


def take(desk: Desk, tool: str) -> None:
    """Take a tool in hand, or put it down if it is in hand already."""
    state = desk.measuring
    state.tool, state.placed = ("" if tool == state.tool else tool), ()


def place(desk: Desk, point: ArrayLike) -> None:
    """Place the next point of the measure in hand at a world position; the last point makes the measure."""
    state, document = desk.measuring, desk.document
    if document is None or not state.tool:
        return
    position = triple(np.asarray(point, np.float64))
    if position in state.placed[-1:]:  # a second click at the same position
        return
    points = _box_about(document.scene, position) if state.tool == "box" else (*state.placed, position)
    if len(points) < POINTS[state.tool]:
        state.placed = points
        return
    kind, state.tool, state.placed = state.tool, "", ()
    add(desk, Measure(kind, points))


def add(desk: Desk, each: Measure) -> None:
    """Add a measure, and select it."""
    assert desk.document is not None
    if change(desk, (*desk.document.measures, each)):
        desk.measuring.selected = len(desk.document.measures) - 1


def _box_about(scene: Scene, middle: tuple[float, float, float]) -> tuple[tuple[float, float, float], ...]:
    """Return the corners of a cube about a point."""
    half = _BOX_SIDE / 2 * min(high - low for low, high in bounds(scene.box))
    return triple(np.subtract(middle, half)), triple(np.add(middle, half))


def values_of(desk: Desk, number: int) -> tuple[Measured | None, bool]:
    """Return the values of a measure, and True if they are not of its points now, but of the points before."""
    document = desk.document
    assert document is not None
    each, volumes = document.measures[number], document.scene.volumes
    slot, key = f"measure {number}", (replace(each, name="", shown=True), volumes)
    name = called(document.measures)[number]
    found = desk.measuring.counting.ask(slot, key, lambda: measured(volumes, each, name), desk.wake)
    if found is not None:
        return found, False
    before = desk.measuring.counting.last(slot)
    return (before if before is not None and before.kind == each.kind else None), True


def labels_of(desk: Desk) -> tuple[Measured, ...] | None:
    """Return the volumes of labels, or None until they are known."""
    assert desk.document is not None
    volumes = desk.document.scene.volumes
    found: tuple[Measured, ...] | None = desk.measuring.counting.ask(
        _LABELS, volumes, lambda: measured_labels(volumes), desk.wake
    )
    return found


def with_table(desk: Desk, document: Document, done: Callable[[str], Any], number: int | None = None) -> None:
    """Pass the values as CSV to `done`, when they are known: of all measures and labels, or of one measure.

    A profile alone is a table with a column for each volume.
    """
    measures, volumes = document.measures, document.scene.volumes
    if number is not None and number >= len(measures):
        return

    def make() -> str:
        unit = volumes[0].unit
        if number is None:
            return csv_of([*measure(volumes, measures), *measured_labels(volumes)], unit)
        found = measured(volumes, measures[number], called(measures)[number])
        return csv_of([found], unit) if found.profile is None else csv_of_profile(found.profile, unit)

    desk.measuring.counting.ask(_TABLE, (measures, volumes, number), make, desk.wake, done)


def copy(desk: Desk, document: Document, number: int | None = None) -> None:
    """Copy the values as CSV to the clipboard."""
    if not document.measures and not any(volume.labels for volume in document.scene.volumes):
        desk.say("nothing is measured yet; choose a tool in the tab Measure")
        return

    def done(text: str) -> None:
        desk.copy(text)
        what = "all measures" if number is None else called(document.measures)[number]
        desk.say(f"{what} copied as CSV, {len(text.splitlines()) - 1} rows")

    with_table(desk, document, done, number)


def save(desk: Desk, document: Document, path: str) -> None:
    """Write the values as CSV to a file; files of others are not overwritten unasked."""

    def done(text: str) -> None:
        def write(chosen: str) -> None:
            if desk.attempt(lambda: writing.write_files({chosen: text.encode()})):
                desk.own.wrote([chosen])
                desk.say(f"wrote {chosen}")

        guarded(desk, path, lambda each: [each], write)

    if desk.attempt(lambda: writing.check_writable(path)):
        with_table(desk, document, done)


def browse_to_save(desk: Desk, document: Document) -> None:
    """Choose a file for the values."""
    stem = document.origin.volume.rstrip("/").rpartition("/")[2].partition(".")[0] or "scene"
    desk.browse("Save all measures as CSV", lambda path, _: save(desk, document, path), saves=True,
                name=f"{stem}-measures.csv")  # fmt: skip


def run(desk: Desk, document: Document, words: str) -> None:
    """Run a command: a kind takes a tool, "delete", "copy" and "csv FILE" are of the values, else a measure is added.

    The words of a measure are those of the option --measure.
    """
    state = desk.measuring
    state.follow(document)
    name, _, rest = words.partition(" ")
    if not words:
        desk.say("a measure must be ruler, angle, box or profile, with its points")
    elif words in POINTS:
        take(desk, words)
    elif words == "delete":
        if state.selected is not None:
            name = called(document.measures)[state.selected]
            if replaced(desk, state.selected, None):
                desk.say(f"removed {name}; undo (ctrl-z) brings it back")
    elif words == "copy":
        copy(desk, document)
    elif name == "csv" and rest:
        save(desk, document, rest)
    else:
        try:
            each = measure_options.measure(words)
        except (argparse.ArgumentTypeError, InputError) as error:
            desk.say(f"measure {error}", fault=True)
            return
        add(desk, each)
