"""Channels without a choice: the first one, but only where an axis is certainly one of channels."""

from __future__ import annotations

import pytest

from texvol.formats.readers.channels import described, note, with_first
from texvol.formats.readers.samples import Choice
from texvol.scene.channel import Channel


@pytest.mark.parametrize(
    ("axes", "sizes", "chosen"),
    [
        ("CZYX", [3, 4, 5, 6], 0),
        ("ZCYX", [4, 3, 5, 6], 0),
        ("TCZYX", [2, 3, 4, 5, 6], 0),
        ("CZYX", [1, 4, 5, 6], None),
        ("ZYX", [4, 5, 6], None),
        ("?CZYX", [2, 3, 4, 5, 6], None),  # which of the two is meant has to be said
        ("?CZYX", [1, 3, 4, 5, 6], 0),
        ("CZYX", [20_000, 4, 5, 6], None),
    ],
)
def test_the_first_channel_is_read_where_there_is_no_doubt(axes: str, sizes: list[int], chosen: int | None) -> None:
    assert with_first(axes, sizes, Choice()).channel == chosen
    assert with_first(axes, sizes, Choice(channel=2)).channel == 2


def test_channels_are_described_as_they_are_told() -> None:
    told = (Channel(0, "DAPI"), Channel(1, "GFP", (0.0, 1.0, 0.0)))
    assert described("CZYX", [2, 3, 3, 3], told) == told
    assert described("CZYX", [2, 3, 3, 3]) == (Channel(0), Channel(1))
    assert described("CZYX", [1, 3, 3, 3]) == described("ZYX", [3, 3, 3]) == ()
    assert note(told, 1) == ("channel 1 GFP of 2: 0 DAPI, 1 GFP; --channel N chooses",)
    assert note(told, None) == note(told[:1], 0) == ()
