"""On a terminal, `texvol render --check all` says how many pixels are done, and ctrl-C ends it and leaves nothing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.terminals import on_terminal, rippled_ball

from texvol import Scene, Volume
from texvol.rendering.checking import check_picture
from texvol.util import progress

SHOWN = re.compile(r"texvol: drawing and checking (\d+) %, \d+ s")


@pytest.fixture
def volume(tmp_path: Path) -> str:
    """A small volume; a check of many pixels takes a while."""
    return rippled_ball(tmp_path, 24)


def test_a_check_of_all_pixels_tells_how_many_are_checked() -> None:
    scene = Scene(Volume(np.random.default_rng(1).random((6, 6, 6))), classification="post")
    told: list[float] = []
    with progress.heard(told.append, 1.0):
        progress.expect(1.0)
        check_picture(np.zeros((64, 64, 4), np.float32), scene, "all")
    assert told == sorted(told) and len(set(told)) > 2
    few: list[float] = []
    with progress.heard(few.append, 1.0):
        progress.expect(1.0)
        check_picture(np.zeros((64, 64, 4), np.float32), scene, 20)
    assert few and few == sorted(few)


def test_ctrl_c_ends_a_check_at_once_and_leaves_nothing(volume: str, tmp_path: Path) -> None:
    words = ["render", volume, "--light", "head", "--size", "3000x2400", "--sampling-rate", "0.1", "--check", "all"]
    words += ["--classification", "post", "--tf", "fog", "-o", "p.png"]
    status, printed, seconds = on_terminal(tmp_path, words, lambda text: bool(SHOWN.search(text)))
    assert SHOWN.search(printed), "it was told how far it is"
    assert status == 130 and printed.rstrip().endswith("texvol: interrupted")
    assert [path.name for path in tmp_path.iterdir()] == [volume]
    # The pixels that a thread has begun with take some 0.1 s; all take a minute.
    assert seconds < 5
