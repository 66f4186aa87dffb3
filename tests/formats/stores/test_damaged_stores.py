"""Damaged OME-Zarr stores: each is drawn, or refused by one line with status 2; `scripts/fuzz.py` makes many more."""

from __future__ import annotations

import shutil
from collections import Counter
from pathlib import Path
from random import Random

import pytest
from support.fuzzing.campaign import put
from support.fuzzing.mutations_stores import damaged_store
from support.fuzzing.seeds import Seed
from support.fuzzing.seeds_zarr import NAME, seeds

from texvol.cli.command_line import main

COUNT = 60
SEED = 5


@pytest.fixture(scope="module")
def sound() -> list[Seed]:
    """Each store once."""
    return [each for each in seeds() if each.reader == "store"]


def test_sound_stores_are_drawn(sound: list[Seed], tmp_path: Path) -> None:
    for number, each in enumerate(sound):
        put(each, str(tmp_path / f"{number}"))
        options = [f"--{name}={value}" for name, value in each.options.items()]
        line = ["render", f"{tmp_path}/{number}/{NAME}", "-o", f"{tmp_path}/p.png", "--size", "16x16", *options]
        assert main(line) == 0, each.options


def test_damaged_stores_are_drawn_or_refused(
    sound: list[Seed], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    random, outcomes = Random(SEED), Counter[int]()
    for number in range(COUNT):
        one = sound[number % len(sound)]
        damaged = Seed(one.kind, damaged_store(one.files, random), NAME)
        folder = tmp_path / "damaged"
        put(damaged, str(folder))
        options = [f"--{name}={value}" for name, value in one.options.items()]
        line = [
            "render",
            f"{folder}/{NAME}",
            "-o",
            f"{tmp_path}/p.png",
            "--size",
            "16x16",
            "--memory",
            "64MB",
            *options,
        ]
        status = main(line)
        lines = capsys.readouterr().err.splitlines()
        told = [each for each in lines if not each.startswith(("texvol: note: ", "texvol: warning: "))]
        assert (status, len(told)) in ((0, 0), (2, 1)), f"{number}: {status} {told}"
        assert all(each.startswith("texvol: error: ") for each in told), told
        outcomes[status] += 1
        shutil.rmtree(folder)
    assert min(outcomes[0], outcomes[2]) > COUNT / 10, outcomes  # else the damage teaches nothing
