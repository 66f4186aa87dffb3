"""Conversion to OME-Zarr: samples, pyramid and statistics against numpy; interruptions; what is refused."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.large import halved, statistics_of

from texvol import InputError, Volume, load
from texvol.cli.command_line import main
from texvol.formats.stores.writing.convert import Layout, convert
from texvol.formats.stores.writing.reducing import reduced

pytest.importorskip("tensorstore")
SMALL = Layout((8, 8, 8), (16, 16, 16))


def field(dtype: Any, shape: tuple[int, int, int] = (70, 67, 81), seed: int = 0) -> np.ndarray:
    """Random samples of odd sides."""
    rng = np.random.default_rng(seed)
    return (rng.random(shape) * 200).astype(dtype)


@pytest.mark.parametrize("zarr_format", [2, 3])
@pytest.mark.parametrize("dtype", ["u1", "i2", "f4", "f8", "u4"])
def test_samples_pyramid_and_statistics(tmp_path: Path, dtype: str, zarr_format: int) -> None:
    values = field(dtype, (22, 27, 81))
    if values.dtype.kind == "f":
        values[3:20, 5:9, 40:60] = np.nan
    volume = Volume(values, (2.0, 2.0, 2.0), (1.0, 2.0, 3.0), unit="mm")
    convert(volume, tmp_path / "v.zarr", layout=Layout(SMALL.chunk, SMALL.shard, zarr_format))
    read = load(tmp_path / "v.zarr")
    assert_array_equal(read.values, values)
    assert_allclose((read.spacing, read.origin), (volume.spacing, volume.origin))
    assert read.unit == "mm" and [level.factor for level in read.levels] == [(1, 1, 1), (2, 2, 2)]
    assert_allclose(read.levels[1].first, 0.5)
    if values.dtype.kind != "f":  # NaN aside is tested below
        assert_array_equal(read.at_level(1).values, halved_exactly(values))
    for level, array in zip(read.levels, (values, read.at_level(1).values), strict=True):
        truth = statistics_of(array, 8)
        for name in ("minimum", "maximum", "variance", "lowest_around", "highest_around"):
            assert_allclose(getattr(level.statistics, name), getattr(truth, name), rtol=1e-6, equal_nan=True)


@pytest.mark.parametrize("zarr_format", [2, 3])
def test_statistics_are_in_one_file_each(tmp_path: Path, zarr_format: int) -> None:
    """One for each shard makes thousands, which a distant store is asked for one by one."""
    values = field("u1", (22, 27, 81))
    convert(Volume(values), tmp_path / "v.zarr", layout=Layout(SMALL.chunk, SMALL.shard, zarr_format))
    shards = [each for each in (tmp_path / "v.zarr" / "0").rglob("*") if each.is_file() and "." not in each.name]
    assert len(shards) > 1, "too few shards to tell"
    metadata = {"zarr.json", ".zarray", ".zattrs", ".zgroup"}
    for folder in (tmp_path / "v.zarr" / "texvol-statistics" / "0").iterdir():
        if folder.is_dir():
            assert len([each for each in folder.rglob("*") if each.is_file() and each.name not in metadata]) == 1
    assert not (tmp_path / "v.zarr" / ".texvol-parts").exists()


def halved_exactly(values: np.ndarray) -> np.ndarray:
    """Means of the samples that are there: at an odd end that is those of one layer, as with the layer twice."""
    return halved(values)


def test_means_of_what_is_there_and_most_frequent_labels() -> None:
    values = np.array([[[1.0, np.nan], [np.nan, 3.0]], [[np.nan] * 2] * 2])
    assert reduced(values, (2, 2, 2), labels=False).tolist() == [[[2.0]]]
    assert np.isnan(reduced(np.full((2, 2, 2), np.nan), (2, 2, 2), labels=False)).all()
    assert reduced(np.array([[[1, 2, 4]]], np.uint8), (1, 1, 2), labels=False).tolist() == [[[2, 4]]]  # 1.5 to even
    labels = np.array([[[5, 5], [7, 7]], [[7, 9], [5, 3]]], np.uint16)
    assert reduced(labels, (2, 2, 2), labels=True).tolist() == [[[5]]]  # three of each: the smaller
    assert reduced(np.array([[[4, 4, 9]]], np.uint16), (1, 1, 2), labels=True).tolist() == [[[4, 9]]]
    largest = np.full((2, 2, 2), 2**64 - 1, np.uint64)
    assert reduced(largest, (2, 2, 2), labels=False).item() == 2**64 - 1


def test_the_finer_axes_are_halved_first(tmp_path: Path) -> None:
    volume = Volume(field("u1", (40, 150, 150)), (1.0, 1.0, 2.0))
    written = convert(volume, tmp_path / "v.zarr")
    assert written.shapes == [(40, 150, 150), (40, 75, 75), (20, 38, 38)]


def test_other_readers_read_it(tmp_path: Path) -> None:
    zarr, ngff_zarr = pytest.importorskip("zarr"), pytest.importorskip("ngff_zarr")
    values = field("u2")
    convert(Volume(values, (1.0, 1.0, 1.2), (5.0, 6.0, 7.0), unit="µm"), tmp_path / "v.ome.zarr")
    assert_array_equal(zarr.open(f"{tmp_path}/v.ome.zarr/0")[:], values)
    image = ngff_zarr.from_ngff_zarr(f"{tmp_path}/v.ome.zarr").images[1]
    assert image.scale == pytest.approx({"x": 2.0, "y": 2.0, "z": 2.4})
    assert image.translation == pytest.approx({"x": 5.5, "y": 6.5, "z": 7.6})


def test_turned_grids_and_labels(tmp_path: Path) -> None:
    turned = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    volume = Volume(field("u1", (20, 20, 20)) // 50, direction=turned, labels=True)
    convert(volume, tmp_path / "v.zarr")
    read = load(tmp_path / "v.zarr")
    assert_array_equal(read.direction, turned)
    assert read.labels


def test_a_killed_conversion_goes_on(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", field("u1", (64, 80, 80)))
    store = tmp_path / "v.ome.zarr"
    line = ["convert", f"{tmp_path}/v.npy", f"{store}", "--chunk", "8", "--shard", "16"]
    running = subprocess.Popen([sys.executable, "-m", "texvol", *line])
    journal = store / ".texvol-convert.json"
    while running.poll() is None and not (journal.exists() and done_in(journal) > 20):
        time.sleep(0.01)
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = done_in(journal)
    with pytest.raises(InputError, match="is no Zarr store"):
        load(store)
    assert main([*line, "--zarr-format", "2"]) == 2  # another store than the one that was begun
    stamp = os.stat(store / "0/c/0/0/0").st_mtime_ns
    assert main(line) == 0
    assert before > 20 and os.stat(store / "0/c/0/0/0").st_mtime_ns == stamp and not journal.exists()
    assert_array_equal(load(store).values, np.load(tmp_path / "v.npy"))
    assert main(line) == 2  # exists
    assert main([*line, "--overwrite"]) == 0


def test_statistics_survive_an_end_after_they_were_gathered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The parts that they were gathered from are gone then."""
    store, volume = tmp_path / "v.zarr", Volume(field("u1"))

    def interrupted(*arguments: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr("texvol.formats.stores.writing.levels.multiscale", interrupted)
        convert(volume, store, layout=SMALL)
    assert not (store / ".texvol-parts").exists()
    convert(volume, store, layout=SMALL)
    assert_allclose(load(store).levels[0].statistics.variance, statistics_of(volume.values, 8).variance, rtol=1e-6)


def done_in(journal: Path) -> int:
    """Number of shards of level 0 that are written."""
    return int(json.loads(journal.read_text())["done"].get("0", 0))


def test_what_is_refused(tmp_path: Path) -> None:
    volume = Volume(field("u1"))
    with pytest.raises(InputError, match="memory must have room for"):
        convert(volume, tmp_path / "v.zarr", memory=100_000)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/letter.txt").write_text("dear")
    for overwrite in (False, True):
        with pytest.raises(InputError, match=r"exists|deletes Zarr stores only"):
            convert(volume, tmp_path / "mine", overwrite=overwrite)
    assert (tmp_path / "mine/letter.txt").read_text() == "dear"
    with pytest.raises(InputError, match="whole numbers of chunks"):
        Layout((64, 64, 64), (100, 100, 100))


def test_a_full_disk_is_one_line_and_can_be_gone_on_from(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", field("f8", (64, 64, 64)))
    line = f"{sys.executable} -m texvol convert {tmp_path}/v.npy {tmp_path}/v.zarr --chunk 32 --shard 64"
    full = subprocess.run(f"ulimit -f 100; {line}", shell=True, capture_output=True, text=True, check=False)
    assert full.returncode == 2 and len(full.stderr.splitlines()) == 1, full.stderr
    assert "v.zarr: cannot be written" in full.stderr
    assert subprocess.run(line, shell=True, check=False).returncode == 0
