"""Options that name a further file of a scene: --transform, --mask, --mesh and --depth-in.

The files are read when the volume that they belong to has been read; until then an option is a choice: a path, and the
numbers behind the path.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import warnings
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import depth
from texvol.geometry import load_mesh
from texvol.options import texts
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.mask import Mask
from texvol.scene.shapes import Mesh
from texvol.scene.spaces import turned
from texvol.scene.volume import Volume
from texvol.util import text_files
from texvol.util.errors import InputError
from texvol.util.shown_text import shown

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FADE = rf"(?::(?P<low>{_NUMBER}),(?P<high>{_NUMBER}))?"
_COLOR = rf"{_NUMBER},{_NUMBER},{_NUMBER}|\#[0-9a-fA-F]{{6}}|\#[0-9a-fA-F]{{3}}|[a-zA-Z]+"
_COLOR_FORM = "a colour R,G,B, #RRGGBB or a name such as white"
_LOOK = rf"(?::(?P<color>{_COLOR}))?(?::(?P<opacity>{_NUMBER}))?"
_OFF = 0.5  # voxels; a mask that is farther off belongs to other samples
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)
_LONGEST_FILE = 1 << 16  # bytes: sixteen numbers and generous comments
_FORMS = "12 or 16 numbers separated by commas (rows of a 4 x 4 matrix, the last row 0,0,0,1), or a file of them"


class TransformChoice(NamedTuple):
    """Numbers of a matrix, or the path of a file with them."""

    numbers: tuple[float, ...] = ()
    path: str = ""

    def matrix(self) -> NDArray[np.float64]:
        """Return the matrix, shape (4, 4).

        Raises
        ------
        InputError
            If the file can't be read, or does not hold a matrix.
        """
        numbers = _of_file(self.path) if self.path else self.numbers
        return np.array([*numbers, *_LAST_ROW[: 16 - len(numbers)]]).reshape(4, 4)


def transform(text: str) -> TransformChoice:
    """Return the choice of "M00,M01,…" or "FILE"."""
    if os.path.exists(text):
        return TransformChoice(path=text)
    numbers = _numbers(text.split(","))
    if numbers is None and text.strip() and text.count(",") < 11:
        return TransformChoice(path=text)  # a missing file, reported when it is read
    if numbers is None or len(numbers) not in (12, 16):
        raise argparse.ArgumentTypeError(f"must be {_FORMS}, got {text!r}")
    return TransformChoice(numbers)


def transform_value(value: Any) -> TransformChoice:
    """Return the choice of a scene file: a text, an array of numbers, or an array of rows."""
    if isinstance(value, str):
        return transform(value)
    rows = value if isinstance(value, list) else []
    flat = [number for row in rows for number in row] if all(isinstance(row, list) for row in rows) else rows
    if not (texts.are_numbers(flat, 12) or texts.are_numbers(flat, 16)):
        raise argparse.ArgumentTypeError(f"must be {_FORMS}, got {value!r}")
    return TransformChoice(tuple(map(float, flat)))


def _of_file(path: str) -> tuple[float, ...]:
    """Return the numbers of a text file with three or four rows of four; # begins a comment."""
    text = text_files.read_text(path, "a transform, 4 rows of 4 numbers", _LONGEST_FILE)
    lines = (line.partition("#")[0] for line in text.splitlines())
    rows = [_numbers(re.split(r"[,\s]+", line.strip(" \t,"))) for line in lines if line.strip()]
    if len(rows) not in (3, 4) or not all(row is not None and len(row) == 4 for row in rows):
        raise InputError(f"{path}: a transform must be 4 rows of 4 numbers (or 3, without 0 0 0 1)")
    return tuple(number for row in rows for number in row or ())


def _numbers(words: list[str]) -> tuple[float, ...] | None:
    """Return finite numbers, or None if a word is not a finite number."""
    try:
        numbers = tuple(map(float, words))
    except ValueError:
        return None
    return numbers if all(map(math.isfinite, numbers)) else None


class MaskChoice(NamedTuple):
    """File of a mask, and the two values between which weights rise from 0 to 1."""

    path: str
    fade: tuple[float, float] | None = None

    def load(self, volume: Volume) -> Mask:
        """Return the mask of `volume`; warn if its file gives it another position.

        Raises
        ------
        InputError, MissingExtraError
            If the file can't be read, or has other dimensions.
        """
        from texvol.formats.readers import load

        # A mask is on the grid of its volume, so an override of the spacing holds for both.
        found = load(self.path, spacing=volume.source.get("spacing"))
        mask = Mask.of(found, self.fade)
        mask.check_fits(volume)
        _warn_if_elsewhere(found, volume)
        return mask


def mask(text: str) -> MaskChoice:
    """Return the choice of "FILE" or "FILE:LOW,HIGH"."""
    path, fade = _file_and_look(text, _FADE, "FILE[:LOW,HIGH]")
    return _checked_fade(MaskChoice(path, (float(fade["low"]), float(fade["high"])) if fade else None))


def mask_value(value: Any) -> MaskChoice:
    """Return the choice of a scene file's text, or table {file = …, fade = [LOW, HIGH]}."""
    if isinstance(value, str):
        return mask(value)
    form = "{file = FILE, fade = [LOW, HIGH]}"
    if not isinstance(value, Mapping):
        raise argparse.ArgumentTypeError(f"must be a file, or {form}, got {value!r}")
    fade = value.get("fade")
    is_fade = fade is None or texts.are_numbers(fade, 2)
    if not isinstance(value.get("file"), str) or not is_fade or set(value) - {"file", "fade"}:
        raise argparse.ArgumentTypeError(f"must be {form}, got {dict(value)!r}")
    return _checked_fade(MaskChoice(value["file"], None if fade is None else (float(fade[0]), float(fade[1]))))


def _warn_if_elsewhere(found: Volume, volume: Volume) -> None:
    """Warn if the mask's outermost samples are more than half a voxel away from the volume's."""
    if _has_no_position(found):
        return
    transform = volume.source.get("transform")
    as_read = volume if transform is None else volume.moved(np.linalg.inv(transform))
    found = turned(found, volume.own_space)
    ends = (np.arange(8)[:, np.newaxis] >> np.arange(3) & 1) * (np.array(volume.dimensions) - 1)
    off = found.origin - as_read.origin + ends @ (found.world_from_index - as_read.world_from_index).T
    farthest = float(np.abs(off @ as_read.index_from_world.T).max())
    if farthest > _OFF:
        warnings.warn(
            shown(
                f"{found.name}: the two files place the mask up to {farthest:.3g} voxels away from {volume.name}; "
                "the mask is used on the volume's samples nevertheless"
            ),
            stacklevel=2,
        )


def _has_no_position(volume: Volume) -> bool:
    """True if the volume has the default position of files that store none."""
    straight = np.array_equal(volume.direction, np.eye(3)) and not volume.origin.any()
    return straight and bool((volume.spacing == 1).all() or "spacing" in volume.source)


def _checked_fade(choice: MaskChoice) -> MaskChoice:
    if choice.fade is not None and not (np.isfinite(choice.fade).all() and choice.fade[0] != choice.fade[1]):
        raise argparse.ArgumentTypeError(f"LOW,HIGH must be two different finite numbers, got {choice.fade}")
    return choice


class DepthChoice(NamedTuple):
    """File of a depth picture."""

    path: str

    def load(self) -> DepthPicture:
        """Return the depths; raise InputError if the file can't be read."""
        source = {"path": self.path, "absolute": os.path.abspath(self.path)}
        return DepthPicture(depth.read(self.path), self.path, source)


class MeshChoice(NamedTuple):
    """File of a mesh, with a colour (linear RGB) and an opacity that replace those of the file."""

    path: str
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0


def mesh(text: str) -> MeshChoice:
    """Return the choice of "FILE", "FILE:R,G,B", "FILE:OPACITY" or "FILE:R,G,B:OPACITY"."""
    path, look = _file_and_look(text, _LOOK, "FILE[:R,G,B][:OPACITY]")
    color = texts.rgb(look["color"], _COLOR_FORM) if "color" in look else None
    return _checked_look(MeshChoice(path, color, float(look.get("opacity", 1))))  # type: ignore[arg-type]


def mesh_table(table: Mapping[str, Any]) -> MeshChoice:
    """Return the choice of a scene file's {file = …, color = [R, G, B], opacity = A}."""
    color, opacity = table.get("color"), table.get("opacity", 1.0)
    color = list(texts.rgb(color, _COLOR_FORM)) if isinstance(color, str) else color
    is_color = color is None or texts.are_numbers(color, 3)
    is_mesh = isinstance(table.get("file"), str) and is_color and texts.is_number(opacity)
    if not is_mesh or set(table) - {"file", "color", "opacity"}:
        raise argparse.ArgumentTypeError(
            f"must be {{file = FILE, color = [R, G, B], opacity = A}}, got {dict(table)!r}"
        )
    return _checked_look(MeshChoice(table["file"], None if color is None else tuple(map(float, color)), float(opacity)))  # type: ignore[arg-type]


def meshes(choices: Iterable[MeshChoice]) -> tuple[Mesh, ...]:
    """Return the meshes of the files."""
    return tuple(load_mesh(each.path, color=each.color, opacity=each.opacity) for each in choices)


def _checked_look(choice: MeshChoice) -> MeshChoice:
    if not 0 < choice.opacity <= 1:
        raise argparse.ArgumentTypeError(f"opacity must be over 0 and at most 1, got {choice.opacity:g}")
    if choice.color is not None and not all(0 <= each <= 1 for each in choice.color):
        raise argparse.ArgumentTypeError(f"colour must be three numbers in [0, 1], got {choice.color}")
    return choice


def _file_and_look(text: str, look: str, form: str) -> tuple[str, dict[str, str]]:
    """Return the path that `text` begins with, and the named groups of the pattern `look` found behind the path."""
    if os.path.exists(text):  # a name may have colons
        return text, {}
    found = re.fullmatch(f"(?P<path>.+?){look}", text)
    if not found:
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    parts = found.groupdict()
    return parts.pop("path"), {name: part for name, part in parts.items() if part}
