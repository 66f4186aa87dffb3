"""Orientation letters at the middles of the picture's borders, as in radiological displays.

The world axes of a medical volume point to the right or left, front or back, head or feet of the patient, as its
`space` says. A border gets the letters of the nearest of 26 directions, those of a cube's faces, edges and corners: R,
or RA for a direction between two axes, the larger part first.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from texvol.annotation.sheet import Sheet
from texvol.annotation.view import View
from texvol.scene.spaces import OPPOSITE, letters_of_space
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_SCALE = 1.2  # single letters are drawn a little larger
_FROM_BORDER = 1.0  # ems from the border to the letters' centre
_SAME = 1e-6  # parts of a direction that differ by less are ordered as the world axes


def check_space(volume: Volume) -> tuple[str, str, str]:
    """Return the letters of the world axes' directions; InputError if the orientation in the body is unknown."""
    letters = letters_of_space(volume.space)
    if letters is None:
        space = f"space {volume.space!r}" if volume.space else "no space"
        raise InputError(
            f"{volume.name}: orientation letters need a volume whose file gives the directions of its axes in the "
            f"body, such as right-anterior-superior (NIfTI, DICOM, MetaImage, NRRD), got {space}"
        )
    return letters


def letters_towards(direction: NDArray[np.float64], axes: tuple[str, str, str]) -> str:
    """Return the letters of a world direction; `axes` are the letters of the world axes."""
    unit = direction / np.linalg.norm(direction)
    directions = [np.array(each) for each in product((-1, 0, 1), repeat=3) if any(each)]
    nearest = max(directions, key=lambda each: float(each @ unit) / float(np.linalg.norm(each)))
    order = sorted(np.flatnonzero(nearest), key=lambda axis: -round(abs(float(unit[axis])) / _SAME))
    return "".join(axes[axis] if nearest[axis] > 0 else OPPOSITE[axes[axis]] for axis in order)


def border_letters(view: View) -> dict[str, str]:
    """Return the letters of the borders "left", "right", "top" and "bottom"."""
    axes = check_space(view.volume)
    right, up = view.camera.right, view.camera.upward
    towards = {"left": -right, "right": right, "top": up, "bottom": -up}
    return {border: letters_towards(direction, axes) for border, direction in towards.items()}


def draw_orientation(sheet: Sheet, view: View) -> None:
    """Draw the letters of each border at its middle, below the title."""
    width, height = sheet.size
    below_title = max((rect.bottom for rect in sheet.taken), default=0.0)
    for border, text in border_letters(view).items():
        across, down = sheet.text_size(text, _SCALE)
        off = _FROM_BORDER * sheet.em
        middle = {
            "left": (max(off, across / 2 + 0.4 * sheet.em), height / 2),
            "right": (width - max(off, across / 2 + 0.4 * sheet.em), height / 2),
            "top": (width / 2, below_title + max(off, down / 2 + 0.4 * sheet.em)),
            "bottom": (width / 2, height - max(off, down / 2 + 0.4 * sheet.em)),
        }[border]
        rect = sheet.text_rect(text, middle, _SCALE)
        if sheet.fits(rect):
            sheet.taken.append(rect)
            sheet.text(text, middle, _SCALE)
