"""The option --mask: file of a mask, and the values between which the mask fades in."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from texvol.options import texts
from texvol.scene.mask import Mask
from texvol.scene.spaces import turned
from texvol.scene.volume import Volume
from texvol.util.shown_text import shown

_FADE = rf"(?::(?P<low>{texts.NUMBER}),(?P<high>{texts.NUMBER}))?"
_OFF = 0.5  # voxels; a mask that is farther off belongs to other samples


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
    path, fade = texts.file_and_look(text, _FADE, "FILE[:LOW,HIGH]")
    return _checked(MaskChoice(path, (float(fade["low"]), float(fade["high"])) if fade else None))


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
    return _checked(MaskChoice(value["file"], None if fade is None else (float(fade[0]), float(fade[1]))))


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
