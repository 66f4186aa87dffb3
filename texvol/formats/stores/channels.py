"""All active channels of an image, each with a transfer function of its colour and window."""

from __future__ import annotations

import os
from typing import Any

from texvol.formats.readers import load
from texvol.scene.transfer import TransferFunction, proposed_for
from texvol.scene.volume import Volume

MOST = 4  # channels that are drawn together; a driver has room for about 8 textures


def other_channels(volume: Volume) -> list[int]:
    """Return the numbers of the further channels that are drawn beside a volume of one of them."""
    if volume.channel is None:
        return []
    active = [each.number for each in volume.channels if each.active and each.number != volume.channel.number]
    return active[: MOST - 1]


def load_channels(path: str | os.PathLike[str], **options: Any) -> list[tuple[Volume, TransferFunction]]:
    """Return the active channels of an image, at most 4, each with its transfer function.

    Parameters
    ----------
    path : str or path
    options
        Those of `texvol.load`, except `channel`.

    Raises
    ------
    InputError, MissingExtraError
        As `texvol.load`.
    """
    first = load(path, **options)
    others = [load(path, **options, channel=number) for number in other_channels(first)]
    return [(each, proposed_for(each)) for each in (first, *others)]
