"""The option --mask: the file of a mask, and between which values it fades in."""

from __future__ import annotations

import argparse
import os
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from texvol.scene.mask import Mask
from texvol.scene.spaces import turned
from texvol.scene.volume import Volume
from texvol.util.shown_text import shown

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FORM = re.compile(rf"(?P<path>.+?)(?::(?P<low>{_NUMBER}),(?P<high>{_NUMBER}))?")
_OFF = 0.5  # voxels: a mask that lies farther off is drawn about another sample


class MaskChoice(NamedTuple):
    """A file, and the two values between which weights rise from 0 to 1."""

    path: str
    fade: tuple[float, float] | None = None

    def beside(self, folder: str | os.PathLike[str]) -> MaskChoice:
        """The same, its path relative to a folder."""
        return self._replace(path=str(Path(folder) / self.path))

    def load(self, volume: Volume) -> Mask:
        """The mask of `volume`, with a warning where its file says that it lies elsewhere.

        Raises
        ------
        InputError, MissingExtraError
            If it can't be read, or is of another size.
        """
        from texvol.formats.readers import load

        # What overrides the spacing of the volume does so of the mask, which is on the same grid.
        found = load(self.path, spacing=volume.source.get("spacing"))
        mask = Mask.of(found, self.fade)
        mask.check_fits(volume)
        _warn_if_elsewhere(found, volume)
        return mask


def mask(text: str) -> MaskChoice:
    """A mask from "FILE" or "FILE:LOW,HIGH"."""
    if os.path.exists(text):  # a name may have colons
        return MaskChoice(text)
    found = _FORM.fullmatch(text)
    if not found:
        raise argparse.ArgumentTypeError(f"FILE[:LOW,HIGH] is wanted, and not {text!r}")
    fade = (float(found["low"]), float(found["high"])) if found["low"] else None
    return _checked(MaskChoice(found["path"], fade))


def mask_table(table: Mapping[str, Any]) -> MaskChoice:
    """A mask from a scene file's {file = …, fade = [LOW, HIGH]}."""
    fade = table.get("fade")
    is_fade = fade is None or (isinstance(fade, list) and len(fade) == 2 and all(map(_is_number, fade)))
    if not isinstance(table.get("file"), str) or not is_fade or set(table) - {"file", "fade"}:
        raise argparse.ArgumentTypeError(f"a mask is {{file = FILE, fade = [LOW, HIGH]}}, and not {dict(table)!r}")
    return _checked(MaskChoice(table["file"], None if fade is None else (float(fade[0]), float(fade[1]))))


def mask_value(value: Any) -> MaskChoice:
    """A mask from a scene file: a text or a table."""
    if isinstance(value, Mapping):
        return mask_table(value)
    if not isinstance(value, str):
        raise argparse.ArgumentTypeError(f"a mask is a file, or {{file = FILE, fade = [LOW, HIGH]}}, and not {value!r}")
    return mask(value)


def _warn_if_elsewhere(found: Volume, volume: Volume) -> None:
    """A warning where the mask's outermost samples are farther than half a voxel from the volume's."""
    if _says_no_place(found):
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
                f"{found.name}: the mask lies up to {farthest:.3g} voxels away from {volume.name}, by what the two "
                "files say of their place; it is laid on the volume's samples all the same"
            ),
            stacklevel=2,
        )


def _says_no_place(volume: Volume) -> bool:
    """Whether it lies where volumes do whose file has nothing about that."""
    straight = np.array_equal(volume.direction, np.eye(3)) and not volume.origin.any()
    return straight and bool((volume.spacing == 1).all() or "spacing" in volume.source)


def _checked(choice: MaskChoice) -> MaskChoice:
    if choice.fade is not None and not (np.isfinite(choice.fade).all() and choice.fade[0] != choice.fade[1]):
        raise argparse.ArgumentTypeError(f"a mask fades between two finite numbers, and not {choice.fade}")
    return choice


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
