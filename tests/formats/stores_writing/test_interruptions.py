"""Conversions that end in the middle: killed, interrupted, a full disk, a damaged chunk, an input that changes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import zarr
from numpy.testing import assert_allclose, assert_array_equal
from support.large import statistics_of
from support.stores import damage, field, write_ome

from texvol import InputError, load
from texvol.__main__ import main

pytest.importorskip("tensorstore")
SMALL = ["--chunk", "8", "--shard", "16"]
SHARDS = 27  # of each time step and channel


def steps() -> np.ndarray:
    """Different samples of three time steps and two channels, of 3 x 3 x 3 shards each."""
    one = field(44, "uint16")
    return np.array([[one + 7 * t + 100 * c for c in range(2)] for t in range(3)], np.uint16)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_ome(tmp_path_factory.mktemp("source") / "v.ome.zarr", steps(), axes="tczyx", levels=1, chunk=32)


def done_in(store: Path) -> int:
    """Number of shards of level 0 that are written."""
    journal = store / ".texvol-convert.json"
    return int(json.loads(journal.read_text())["done"].get("0", 0)) if journal.exists() else 0


def begun(source: Path, store: Path, shards: int) -> subprocess.Popen[str]:
    """A conversion that has written so many shards, in a process."""
    line = [sys.executable, "-m", "texvol", "convert", str(source), str(store), *SMALL]
    running = subprocess.Popen(line, stderr=subprocess.PIPE, text=True)
    while running.poll() is None and done_in(store) <= shards:
        time.sleep(0.01)
    return running


def check(store: Path) -> None:
    """Compare samples and statistics of every time step and channel."""
    values = steps()
    assert_array_equal(zarr.open(f"{store}/0")[:], values)
    for step, channel in np.ndindex(3, 2):
        level = load(store, time=step, channel=channel).levels[0]  # type: ignore[attr-defined]
        truth = statistics_of(values[step, channel], 8)
        assert_allclose(level.statistics.variance, truth.variance, rtol=1e-6)
        assert_allclose(level.statistics.lowest_around, truth.lowest_around)
    assert not list(store.glob(".texvol*"))


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_what_ends_in_the_second_time_step_goes_on_there(source: Path, tmp_path: Path, how: signal.Signals) -> None:
    store = tmp_path / "out.zarr"
    running = begun(source, store, 2 * SHARDS + 5)
    running.send_signal(how)
    _, told = running.communicate()
    if how == signal.SIGINT:
        assert (running.returncode, told.splitlines()) == (130, ["texvol: interrupted"])
    before = done_in(store)
    assert 2 * SHARDS < before < 6 * SHARDS
    with pytest.raises(InputError, match="is no Zarr store"):
        load(store)
    assert main(["convert", str(source), str(store), *SMALL, "--time", "1"]) == 2  # another conversion
    stamps = [os.stat(store / f"0/c/{place}").st_mtime_ns for place in ("0/0/0/0/0", "0/1/2/2/2", "1/0/0/0/0")]
    assert main(["convert", str(source), str(store), *SMALL]) == 0
    assert stamps == [os.stat(store / f"0/c/{place}").st_mtime_ns for place in ("0/0/0/0/0", "0/1/2/2/2", "1/0/0/0/0")]
    check(store)


def test_an_input_that_has_changed_is_not_gone_on_with(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", steps()[:, 0], axes="tzyx", levels=1, chunk=32)
    store = tmp_path / "out.zarr"
    running = begun(path, store, SHARDS + 5)
    running.kill()
    running.communicate()
    changed = zarr.open(f"{path}/0", mode="r+")
    changed[1] = 3
    assert main(["convert", str(path), str(store), *SMALL]) == 2
    assert "unfinished conversion of another volume or with other options" in capsys.readouterr().err
    assert main(["convert", str(path), str(store), *SMALL, "--overwrite"]) == 0
    assert_array_equal(zarr.open(f"{store}/0")[1], 3)


def test_two_arrays_of_one_shape_are_two_conversions(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", steps()[:, 0])
    np.save(tmp_path / "b.npy", steps()[:, 1])
    store = tmp_path / "out.zarr"
    running = begun(tmp_path / "a.npy", store, 5)
    running.kill()
    running.communicate()
    assert main(["convert", f"{tmp_path}/b.npy", str(store), *SMALL]) == 2


def test_a_full_disk_in_a_later_time_step(source: Path, tmp_path: Path) -> None:
    """The largest file allowed is one that the first shards do not reach: those of random samples do."""
    values = np.full((3, 48, 48, 48), 7, np.float64)
    values[1] = np.random.default_rng(0).random((48, 48, 48))
    np.save(tmp_path / "v.npy", values)
    store = tmp_path / "v.zarr"
    line = f"{sys.executable} -m texvol convert {tmp_path}/v.npy {store} --chunk 16 --shard 48 --time all"
    full = subprocess.run(f"ulimit -f 100; {line}", shell=True, capture_output=True, text=True, check=False)
    assert full.returncode == 2 and len(full.stderr.splitlines()) == 1, full.stderr
    assert f"{store}: cannot be written" in full.stderr
    assert done_in(store) == 1
    assert subprocess.run(line, shell=True, check=False).returncode == 0
    assert_array_equal(zarr.open(f"{store}/0")[:], values)


@pytest.mark.parametrize("missing", [False, True])
def test_a_damaged_chunk_of_a_later_time_step_is_named(
    tmp_path: Path, missing: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", steps(), axes="tczyx", levels=1, chunk=32)
    damage(path / "0/c/1/1/0/1/0")
    status = main(["convert", str(path), f"{tmp_path}/out.zarr", *SMALL, *(["--missing-chunks"] if missing else [])])
    told = capsys.readouterr().err.splitlines()
    if not missing:
        assert (status, len(told)) == (2, 1)
        assert f"{path}: level 0: chunk 1, 1, 0, 1, 0 (t, c, z, y, x) cannot be read" in told[0]
        assert 3 * SHARDS <= done_in(tmp_path / "out.zarr") < 4 * SHARDS
        return
    wanted = steps().astype(np.float32)
    wanted[1, 1, :32, 32:, :32] = np.nan
    assert status == 0
    assert_array_equal(zarr.open(f"{tmp_path}/out.zarr/0")[:], wanted)


def test_memory_stays_within_its_bounds(tmp_path: Path) -> None:
    """Peak of a process that converts 100 MB of four time steps with 40 MB, against one that converts hardly any."""
    import h5py

    peaks = []
    for name, shape in (("small", (4, 8, 8, 8)), ("large", (4, 128, 192, 256))):
        with h5py.File(tmp_path / f"{name}.h5", "w") as file:
            made = file.create_dataset("a", shape, "f4", chunks=(1, 8, 8, 8) if name == "small" else (1, 64, 64, 64))
            for step in range(4):
                made[step] = np.random.default_rng(step).random(shape[1:], np.float32)
        line = ["convert", f"{tmp_path}/{name}.h5", f"{tmp_path}/{name}.zarr", "--memory", "40MB", "--time", "all"]
        code = (
            "import resource, sys; from texvol.__main__ import main; status = main(sys.argv[1:]); "
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss); sys.exit(status)"
        )
        line = [sys.executable, "-c", code, *line, "--chunk", "32", "--shard", "64"]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        peaks.append(int(done.stdout.splitlines()[-1]) << 10)
    assert peaks[1] - peaks[0] < 60e6, peaks  # a volume has 25 MB, all 100


@pytest.mark.parametrize("within", ["", "/0"])
def test_an_input_is_never_overwritten_by_its_own_conversion(tmp_path: Path, within: str) -> None:
    path = write_ome(tmp_path / "v.zarr", field(12), levels=1)
    (tmp_path / "link.zarr").symlink_to(path)
    for output in ("v.zarr", "link.zarr"):
        assert main(["convert", f"{path}{within}", f"{tmp_path}/{output}", "--overwrite"]) == 2
    assert_array_equal(load(path).values, field(12))
