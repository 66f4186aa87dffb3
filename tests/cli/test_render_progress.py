"""On a terminal, `texvol render` says how much of a picture is drawn, and ctrl-C ends it at once."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from support.terminals import on_terminal, rippled_ball

SHOWN = re.compile(r"texvol: drawing (\d+) %, \d+ s")


@pytest.fixture
def volume(tmp_path: Path) -> str:
    """A volume that takes a while."""
    return rippled_ball(tmp_path, 110)


def test_the_fraction_that_is_drawn_never_falls(volume: str, tmp_path: Path) -> None:
    words = ["render", volume, "--light", "head", "--size", "360x280", "--sampling-rate", "16", "-o", "p.png"]
    status, printed, _ = on_terminal(tmp_path, words, lambda _: False)
    assert status == 0 and (tmp_path / "p.png").exists()
    told = [int(each) for each in SHOWN.findall(printed)]
    # A fast machine is done before anything is shown.
    assert told == sorted(told) and all(0 < each < 100 for each in told)


def test_ctrl_c_ends_a_picture_at_once_and_leaves_nothing(volume: str, tmp_path: Path) -> None:
    # Hours of work.
    words = ["render", volume, "--light", "head", "--size", "1500x1200", "--max-error", "1e-7", "-o", "p.png"]
    status, printed, seconds = on_terminal(tmp_path, words, lambda text: bool(SHOWN.search(text)))
    assert SHOWN.search(printed), "it was told how far it is"
    assert status == 130 and printed.rstrip().endswith("texvol: interrupted")
    assert [path.name for path in tmp_path.iterdir()] == [volume]
    # A piece takes some 15 ms; the rest is for a busy machine. The picture itself takes far longer.
    assert seconds < 10
