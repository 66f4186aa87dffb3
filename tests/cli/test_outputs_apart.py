"""No file that a command writes takes the place of another one, and each has a name."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from texvol.__main__ import main


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume and a transfer function."""
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    point = '{"value": 0, "color": [1, 1, 1], "extinction": 1}'
    (tmp_path / "tf.json").write_text(f'{{"points": [{point}]}}')
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("line", "lost"),
    [
        ("render v.npy -o a.png --stats v.npy", "v.npy"),
        ("render v.npy -o a.png --stats ./v.npy", "v.npy"),
        ("render v.npy -o a.png --tf tf.json --stats tf.json", "tf.json"),
        ("render --scene s.toml -o a.png --stats s.toml", "s.toml"),
        ("render --scene s.toml -o a.png --stats v.npy", "v.npy"),
        ("render v.npy -o a.png --stats a.png", "a.png"),
        ("render v.npy -o a.exr --mode isosurface --isovalue 0.5 --depth a.exr", "a.exr"),
        ("raycast v.npy -o a.exr --mode isosurface --isovalue 0.5 --depth ./a.exr", "a.exr"),
    ],
)
def test_no_file_takes_the_place_of_another(
    folder: Path, line: str, lost: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("s.toml").write_text('volume = "v.npy"\n')
    before = {path: path.read_bytes() for path in folder.iterdir()}
    assert main([*line.split(), "--size", "9x9"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and lost in said
    assert {path: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize(
    "line",
    [
        ("render", "v.npy", "-o", "a.png", "--size", "9x9", "--stats", ""),
        ("render", "v.npy", "-o", "a.png", "--size", "9x9", "--mode", "isosurface", "--isovalue", "0.5", "--depth", ""),
        ("report", "v.npy", "-o", ""),
        ("diff", "a.png", "b.png", "--html", ""),
    ],
)
def test_a_file_without_a_name_is_refused(
    folder: Path, line: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(os.listdir())
    assert main(line) == 2
    assert "must be the name of a file" in capsys.readouterr().err
    assert sorted(os.listdir()) == before
