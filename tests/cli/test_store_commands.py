"""Commands on a store that is larger than the memory they may use: no step of them needs all samples."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.stores import field, write_ome

import texvol
from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.formats.stores.writing.convert import Layout, convert
from texvol.scene.transfer import units
from texvol.scene.volume import Volume

MEMORY = "--memory", "700kB"  # of 746


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A pyramid of 72³ samples of 16 bits."""
    folder = tmp_path_factory.mktemp("large") / "field.ome.zarr"
    volume = Volume(field(72), name="field")
    assert volume.values.nbytes > 7e5
    convert(volume, folder, layout=Layout((24,) * 3, (48,) * 3))
    return str(folder)


@pytest.mark.parametrize("mode", ["mip", "minip", "xray", "average"])
def test_pictures_of_numbers(store: str, tmp_path: Path, mode: str) -> None:
    line = ["render", store, "--mode", mode, "--size", "24x24"]
    assert main([*line, *MEMORY, "--check", "3", "-o", str(tmp_path / "picture.png")]) == 0
    stats = ["--stats", str(tmp_path / "stats.json")]
    assert main([*line, *MEMORY, "--level", "0", *stats, "-o", str(tmp_path / "picture.exr")]) == 0
    of_whole = ["--memory", "100MB", "--stats", str(tmp_path / "whole.json")]
    assert main([*line, *of_whole, "-o", str(tmp_path / "whole.exr")]) == 0
    assert "parts" not in json.loads((tmp_path / "whole.json").read_text())  # all samples fit in memory
    picture, whole = (image.read(tmp_path / name) for name in ("picture.exr", "whole.exr"))
    np.testing.assert_allclose(picture, whole, atol=2e-6 * whole.max())
    told = json.loads((tmp_path / "stats.json").read_text())
    assert told["parts"]["peak_bytes"] <= 7e5 and told["estimated_error"] > 0
    field_error = 0.05 * float(np.ptp(whole[..., 0]))
    assert main([*line, *MEMORY, "--max-error", f"{field_error}", "-o", str(tmp_path / "finer.exr")]) == 0
    assert main([*line, *MEMORY, "--progressive", "-o", str(tmp_path / "last.exr")]) == 0
    exact = ["raycast", store, *MEMORY, "--mode", mode, "--size", "24x24", "-o", str(tmp_path / "exact.exr")]
    assert main(exact) == 0
    np.testing.assert_allclose(image.read(tmp_path / "finer.exr"), image.read(tmp_path / "exact.exr"), atol=field_error)


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--tf", "fog"),
        ("--tf", "contours", "--light", "head"),
        ("--tf", "histogram", "--max-error", "0.1"),
        ("--tf", "viridis", "--depth-cue", "0.5", "--check", "2"),
        ("--tf", "grey", "--projection", "perspective", "--annotate", "axes,legend"),
    ],
)
def test_pictures_by_presets(store: str, tmp_path: Path, words: tuple[str, ...]) -> None:
    for name in ("picture.exr",) if words else ("picture.png", "picture.exr"):  # a preset is drawn the same into both
        line = ["render", store, *MEMORY, "--size", "24x24", *words, "-o", str(tmp_path / name)]
        assert main(line) == 0
    assert image.read(tmp_path / "picture.exr")[..., :3].max() > 0


def test_the_oracle_writes_its_picture(store: str, tmp_path: Path) -> None:
    line = ["raycast", store, *MEMORY, "--size", "4x4", "--tf", "fog", "-o", str(tmp_path / "exact.exr")]
    assert main(line) == 0
    assert np.isfinite(image.read(tmp_path / "exact.exr")).all()


def test_typical_samples_are_those_of_a_coarse_level(store: str) -> None:
    volume = texvol.load(store, memory=700 * 1000)
    assert volume.levels[0].bytes > volume.memory  # type: ignore[attr-defined]
    # Halved samples of a field that changes over tenths of its side: a fiftieth of its range of 240.
    found, fine = units.typical_samples(volume), units.typical_samples(Volume(field(72)))
    assert np.abs(np.percentile(found, [5, 50, 95]) - np.percentile(fine, [5, 50, 95])).max() < 5


def test_shifted_levels_are_told_when_they_have_been_drawn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The finest level alone says nothing of the others, and a plan reads no samples."""
    path = str(write_ome(tmp_path / "v.ome.zarr", field(64), shift=None))
    line = ["render", path, "--tf", "fog", "--size", "16x16"]
    output = ["-o", str(tmp_path / "picture.png")]
    told = []
    for words in ([*output], [*output, "--level", "1"], [*output, "--level", "0"], ["--plan"]):
        assert main([*line, *words]) == 0
        told.append("note: level 1 lies 0.5 samples of level 0 along x, y, z off" in capsys.readouterr().err)
    assert told == [True, True, False, False]
