"""The option --mask: file of a mask, and the values between which the mask fades in."""

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
_OFF = 0.5  # voxels; a mask that is farther off belongs to other samples


class MaskChoice(NamedTuple):
    """File of a mask, and the two values between which weights rise from 0 to 1."""

    path: str
    fade: tuple[float, float] | None = None

    def beside(self, folder: str | os.PathLike[str]) -> MaskChoice:
        """Return the choice with its path relative to a folder."""
        return self._replace(path=str(Path(folder) / self.path))

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
    if os.path.exists(text):  # a name may have colons
        return MaskChoice(text)
    found = _FORM.fullmatch(text)
    if not found:
        raise argparse.ArgumentTypeError(f"must be FILE[:LOW,HIGH], got {text!r}")
    fade = (float(found["low"]), float(found["high"])) if found["low"] else None
    return _checked(MaskChoice(found["path"], fade))


def mask_table(table: Mapping[str, Any]) -> MaskChoice:
    """Return the choice of a scene file's {file = …, fade = [LOW, HIGH]}."""
    fade = table.get("fade")
    is_fade = fade is None or (isinstance(fade, list) and len(fade) == 2 and all(map(_is_number, fade)))
    if not isinstance(table.get("file"), str) or not is_fade or set(table) - {"file", "fade"}:
        raise argparse.ArgumentTypeError(f"must be {{file = FILE, fade = [LOW, HIGH]}}, got {dict(table)!r}")
    return _checked(MaskChoice(table["file"], None if fade is None else (float(fade[0]), float(fade[1]))))


def mask_value(value: Any) -> MaskChoice:
    """Return the choice of a scene file's text or table."""
    if isinstance(value, Mapping):
        return mask_table(value)
    if not isinstance(value, str):
        raise argparse.ArgumentTypeError(f"must be a file, or {{file = FILE, fade = [LOW, HIGH]}}, got {value!r}")
    return mask(value)


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


def _checked(choice: MaskChoice) -> MaskChoice:
    if choice.fade is not None and not (np.isfinite(choice.fade).all() and choice.fade[0] != choice.fade[1]):
        raise argparse.ArgumentTypeError(f"LOW,HIGH must be two different finite numbers, got {choice.fade}")
    return choice


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
