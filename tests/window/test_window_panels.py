"""Where panels and their parts are: the edge that is dragged, slices that use the room."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.windows import ball, display, eight_bits, script, timings, viewed  # noqa: F401 (display is a fixture)

from texvol.window.desk import NARROW, Preferences
from texvol.window.slices import tiled

lengths = st.floats(0.1, 10)
rooms = st.floats(50, 2000)


def test_panels_are_hidden_once_where_a_page_is_narrow() -> None:
    shown = Preferences()
    shown.suit(NARROW)
    assert shown.panels
    shown.suit(NARROW - 1)
    assert not shown.panels
    shown.panels = True  # by the key
    shown.suit(NARROW - 2)
    assert shown.panels, "the user has asked for them"
    shown.suit(NARROW)
    shown.suit(NARROW - 1)
    assert not shown.panels


@given(st.lists(st.tuples(lengths, lengths), min_size=1, max_size=3), rooms, rooms)
def test_slices_keep_their_proportions_in_the_room_and_do_not_overlap(
    extents: list[tuple[float, float]], width: float, height: float
) -> None:
    gap = 6.0
    tiles = tiled(extents, width, height, gap)
    scales = [tile.width / extent[0] for tile, extent in zip(tiles, extents, strict=True)]
    # A picture has at least a pixel: only where that is too much may it be larger than the others.
    if min(min(tile.width, tile.height) for tile in tiles) > 1:
        assert np.allclose([tile.height / extent[1] for tile, extent in zip(tiles, extents, strict=True)], scales)
        assert np.allclose(scales, scales[0])
        slack = 1e-6 * (width + height)
        for tile in tiles:
            assert -slack <= tile.x and tile.x + tile.width <= width + slack
            assert -slack <= tile.y and tile.y + tile.height <= height + slack
        for number, one in enumerate(tiles):
            for other in tiles[:number]:
                beside = one.x >= other.x + other.width or one.y >= other.y + other.height
                assert beside or other.x >= one.x + one.width - slack


@pytest.mark.parametrize("width, height, columns", [(300, 1000, 1), (300, 400, 2), (900, 300, 3)])
def test_slices_lie_as_they_are_largest(width: float, height: float, columns: int) -> None:
    assert tiled([(1.0, 1.0)] * 3, width, height, 6.0)[0].columns == columns


def test_slices_of_a_panel_that_scrolls_are_as_wide_as_it() -> None:
    tiles = tiled([(2.0, 1.0), (1.0, 1.0)], 300.0, np.inf, 6.0)
    assert [(tile.x, tile.width) for tile in tiles] == [(0, 300), (75, 150)]


def dragged(t: float, start: tuple[int, int], end: tuple[int, int]) -> list[dict[str, Any]]:
    """A drag with the left button."""
    return [
        {"t": t, "kind": "move", "x": start[0], "y": start[1]},
        {"t": t + 0.1, "kind": "button", "name": "left", "down": True},
        {"t": t + 0.2, "kind": "move", "x": (start[0] + end[0]) / 2, "y": end[1]},
        {"t": t + 0.3, "kind": "move", "x": end[0], "y": end[1]},
        {"t": t + 0.4, "kind": "button", "name": "left", "down": False},
    ]


def clicked_twice(t: float, x: float, y: float) -> list[dict[str, Any]]:
    clicks = [{"t": t + 0.1 + 0.05 * n, "kind": "button", "name": "left", "down": n % 2 == 0} for n in range(4)]
    return [{"t": t, "kind": "move", "x": x, "y": y}, *clicks]  # fmt: skip


def test_the_edge_of_the_panels_is_dragged_and_kept_within_bounds(display: str, tmp_path: Path) -> None:  # noqa: F811
    # The picture is 540 wide and the panels are 360: the edge moves to 400, and as far as it goes to either side.
    steps = [
        {"do": "rest"},
        {"t": 0.05, "do": "mark", "name": "start"},
        *dragged(0.1, (543, 150), (400, 150)),
        {"t": 0.7, "do": "rest"},
        {"t": 0.75, "do": "mark", "name": "wider"},
        *dragged(0.8, (403, 150), (50, 150)),
        {"t": 1.5, "do": "rest"},
        {"t": 1.55, "do": "mark", "name": "widest"},
        *dragged(1.6, (363, 150), (890, 150)),
        {"t": 2.2, "do": "rest"},
        {"t": 2.25, "do": "mark", "name": "narrowest"},
        *clicked_twice(2.3, 623, 150),
        {"t": 2.9, "do": "rest"},
        {"t": 2.95, "do": "mark", "name": "as before"},
        {"t": 3.1, "do": "rest"},
    ]
    words = ["--size", "540x300", "--max-error", "0.1", "--light", "none", "--zoom", "0.2"]
    words += ["--script", script(tmp_path, steps), "--timings", "t.csv"]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words)
    assert (done.returncode, done.stderr) == (0, "")
    widths = {frame["mark"]: int(frame["width"]) for frame in timings(tmp_path / "t.csv") if frame["mark"]}
    # Of 900, panels take at most 0.6, and at least 280.
    assert widths == {"start": 540, "wider": 400, "widest": 360, "narrowest": 620, "as before": 540}


def test_a_drag_with_the_right_button_changes_level_and_window(display: str, tmp_path: Path) -> None:  # noqa: F811
    def drag(t: float, by: tuple[int, int]) -> list[dict[str, Any]]:
        return [
            {"t": t, "kind": "move", "x": 420, "y": 180},
            {"t": t + 0.05, "do": "rest"},
            {"t": t + 0.1, "kind": "button", "name": "right", "down": True},
            {"t": t + 0.15, "do": "rest"},  # each in a frame of its own, however long that takes
            {"t": t + 0.2, "kind": "move", "x": 420 + by[0], "y": 180 + by[1]},
            {"t": t + 0.3, "do": "rest"},
            {"t": t + 0.4, "kind": "button", "name": "right", "down": False},
            {"t": t + 0.45, "do": "rest"},
        ]

    steps = [
        {"do": "rest"},
        {"t": 0.1, "do": "command", "name": "tab Slices"},
        {"t": 0.3, "do": "rest"},
        {"t": 0.5, "do": "screenshot", "file": "0.png"},
        *drag(0.6, (0, -60)),
        {"t": 1.2, "do": "screenshot", "file": "1.png"},
        *drag(1.3, (0, 120)),
        {"t": 1.9, "do": "screenshot", "file": "2.png"},
        *drag(2.0, (200, 0)),
        {"t": 2.6, "do": "screenshot", "file": "3.png"},
    ]
    words = ["--size", "240x800", "--light", "none", "--max-error", "0.1", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words)
    assert (done.returncode, done.stderr) == (0, "")
    # A quarter of the slice, without border and lines.
    seen = [eight_bits(tmp_path / f"{number}.png")[195:270, 432:500].mean(axis=2) for number in range(4)]
    # A level that is higher makes all darker; a window that is wider takes the contrast.
    assert seen[1].mean() < 0.8 * seen[0].mean() < 0.8 * seen[2].mean()
    assert seen[3].std() < 0.7 * seen[2].std()


def test_a_slice_that_is_clicked_twice_fills_the_panel_and_back(display: str, tmp_path: Path) -> None:  # noqa: F811
    steps = [
        {"do": "rest"},
        {"t": 0.1, "do": "screenshot", "file": "before.png"},
        {"t": 0.1, "do": "command", "name": "tab Slices"},
        {"t": 0.5, "do": "screenshot", "file": "all.png"},
        *clicked_twice(0.6, 420, 180),
        {"t": 1.2, "do": "screenshot", "file": "one.png"},
        *clicked_twice(1.3, 420, 180),
        {"t": 1.9, "do": "screenshot", "file": "again.png"},
    ]
    words = ["--size", "240x800", "--light", "none", "--max-error", "0.1", "--script", script(tmp_path, steps)]
    done = viewed(display, tmp_path, ball(tmp_path, 24), *words)
    assert (done.returncode, done.stderr) == (0, "")

    def across(name: str) -> int:
        """Pixels of the longest horizontal line of a crosshair in green, which is as long as its slice is wide."""
        red, green, blue = np.moveaxis(eight_bits(tmp_path / f"{name}.png")[150:600, 250:], 2, 0)
        return int(((green - red > 25) & (green - blue > 25)).sum(axis=1).max())

    # Within the panel's 360 and its margins one has 336, and a line is hard to see where the slice is bright.
    assert 250 < across("one") <= 336
    assert across("all") == across("again") < 250
    # The crosshair is in the picture, too: at first in the middle of the box, which is that of the picture.
    before, after = (eight_bits(tmp_path / f"{name}.png")[:, :240] for name in ("before", "all"))
    rows, columns = np.nonzero((before != after).any(axis=2))
    assert len(rows) > 20 and np.abs(rows - 400).max() <= 16 and np.abs(columns - 120).max() <= 16
