"""Looks of one volume, made on a thread, because some of them take statistics of the volume; strips of all lists."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence

import numpy as np

from texvol.options.looks import load_look
from texvol.scene.looks import Look, look_as_is
from texvol.scene.transfer import TransferFunction, proposed_beside
from texvol.scene.transfer.labels import color_list
from texvol.scene.volume import Volume
from texvol.window import color_maps, lineage, opacity_shapes, strips
from texvol.window.look_list import LABELS, OF_LOOK, OPENED, PROPOSED, Entry

_MOST = 96  # strips on a sheet


class Sheet:
    """Strips below each other in one picture, by their keys."""

    def __init__(self) -> None:
        self.pixels = np.zeros((_MOST * strips.HEIGHT, strips.WIDTH, 3), np.uint8)
        self.version = 0
        self._rows: dict[str, int] = {}

    def put(self, key: str, strip: strips.Pixels) -> None:
        """Add a strip; strips for which there is no room are left out."""
        row = self._rows.get(key, len(self._rows))
        if row < _MOST:
            self.pixels[row * strips.HEIGHT : (row + 1) * strips.HEIGHT] = strip
            self._rows[key] = row
            self.version += 1

    def place(self, key: str) -> tuple[float, float] | None:
        """Return the upper and the lower end of a strip as fractions of the picture's height; None if it is missing."""
        row = self._rows.get(key)
        if row is None:
            return None
        inset = 0.5  # pixels: its neighbours must not shine in
        top = row * strips.HEIGHT
        height = _MOST * strips.HEIGHT
        return (top + inset) / height, (top + strips.HEIGHT - inset) / height


class Catalogue:
    """Looks of one volume, each as soon as it is made.

    Parameters
    ----------
    volume : Volume
    number : int
        Number of the volume in its scene.
    opened : TransferFunction, optional
        Transfer function that the scene was opened with.
    length : float
        Length of the path whose opacity strips show, world units.
    wake : callable
        Called, on the thread, when a look has been made.

    Attributes
    ----------
    looks : dict of str to Look
    sheet, maps, shapes : Sheet
        Strips of the looks, of colour maps, and of opacity shapes; those of looks are in all three.
    faults : dict of str to str
        Reasons why looks can't be made.
    """

    def __init__(
        self,
        volume: Volume,
        number: int,
        entries: Sequence[Entry],
        opened: TransferFunction | None,
        length: float,
        wake: Callable[[], None],
    ) -> None:
        self.volume, self.entries = volume, list(entries)
        self.looks: dict[str, Look] = {}
        self.faults: dict[str, str] = {}
        self.sheet, self.maps, self.shapes = Sheet(), Sheet(), Sheet()
        self._number, self._opened, self._length, self._wake = number, opened, length, wake
        self._over = False

    def start(self) -> Catalogue:
        """Start the thread."""
        threading.Thread(target=self._make, daemon=True, name="texvol looks").start()
        return self

    def stop(self) -> None:
        """End the thread after the look that it makes."""
        self._over = True

    def _make(self) -> None:
        for name in color_maps.NAMES:
            self.maps.put(name, strips.of_stops(color_maps.map_stops(name)))
        for name, (shape, _) in opacity_shapes.SHAPES.items():
            self.shapes.put(name, strips.of_shape(shape))
        self._wake()
        for entry in self.entries:
            if self._over:
                return
            try:
                if entry.group == LABELS:
                    self.sheet.put(entry.key, strips.of_list(color_list(entry.key).tolist()))
                else:
                    self._add(entry.key, self._look(entry.key))
            except Exception as error:  # a file may hold anything; the list says so
                self.faults[entry.key] = " ".join(str(error).split()) or repr(error)
            self._wake()

    def _add(self, key: str, look: Look) -> None:
        """Add a look, and the strips of all of it, of its colours and of its opacity."""
        medium = look.transfer_function
        self.maps.put(OF_LOOK + key, strips.of_stops(lineage.palette_of(medium)))
        self.shapes.put(OF_LOOK + key, strips.of_opacity(medium, self._length))
        self.sheet.put(key, strips.of_medium(medium, self._length))
        self.looks[key] = look

    def _look(self, key: str) -> Look:
        if key == OPENED and self._opened is not None:
            return Look(self._opened, name=key)
        if key == PROPOSED:
            return look_as_is(self.volume) if not self._number else Look(proposed_beside(self.volume, self._number))
        return load_look(key, self.volume)
