"""Channels of an image, such as stains of a microscope: without a choice the first one is read, and all are described.

Components of vectors are no channels: which of them is meant, or their length, has to be chosen.
"""

from __future__ import annotations

from collections.abc import Sequence

from texvol.formats.readers.samples import Choice
from texvol.scene.channel import Channel

_MOST = 10_000  # channels: an axis that claims more is refused unless one is chosen


def with_first(axes: str, sizes: Sequence[int], choice: Choice) -> Choice:
    """Return the choice with the first channel, if the axes have several and none is chosen.

    Parameters
    ----------
    axes : str
        Letters as for `pick`. An unnamed axis of several samples could be channels as well: nothing is chosen then.
    """
    lengths = [(axis, int(size)) for axis, size in zip(axes, sizes, strict=True) if int(size) > 1]
    channels = [size for axis, size in lengths if axis == "C"]
    unnamed = any(axis == "?" for axis, _ in lengths)
    if choice.channel is not None or unnamed or len(channels) != 1 or channels[0] > _MOST:
        return choice
    return choice._replace(channel=0)


def described(axes: str, sizes: Sequence[int], told: Sequence[Channel] = ()) -> tuple[Channel, ...]:
    """Return the channels of the axes: as they are told, or by their numbers alone; none of a single one."""
    count = max((int(size) for axis, size in zip(axes, sizes, strict=True) if axis == "C"), default=1)
    if count < 2 or count > _MOST:
        return tuple(told)
    return tuple(told) or tuple(map(Channel, range(count)))


def note(channels: Sequence[Channel], chosen: int | None) -> tuple[str, ...]:
    """Return a note that names the channel that is read, if there are several."""
    if len(channels) < 2 or chosen is None:
        return ()
    listed = ", ".join(f"{each.number} {each.name}".rstrip() for each in channels)
    own = f"{chosen} {channels[chosen].name}".rstrip()
    return (f"channel {own} of {len(channels)}: {listed}; --channel N chooses",)
