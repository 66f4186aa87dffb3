"""Files that a window in a browser may use: those in its folders, whatever path leads to them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import tifffile

from texvol import TransferFunction, geometry, load
from texvol.util import reach, writing
from texvol.util.errors import InputError


@pytest.fixture
def inside(tmp_path: Path) -> Iterator[Path]:
    """The only allowed folder, with a volume; beside it are another one, and links to that."""
    for name in ("in", "in-other"):
        (tmp_path / name).mkdir()
        np.save(tmp_path / name / "a.npy", np.zeros((4, 4, 4), np.float32))
    (tmp_path / "in/link.npy").symlink_to(tmp_path / "in-other/a.npy")
    (tmp_path / "in/links").symlink_to(tmp_path / "in-other")
    (tmp_path / "in-other/points.ply").write_text("ply")
    (tmp_path / "in-other/tf.json").write_text("{}")
    (tmp_path / "own").mkdir()
    reach.limit([str(tmp_path / "in")], [str(tmp_path / "own")])
    yield tmp_path / "in"
    reach.limit(None)


def test_a_volume_is_read_from_within_only(inside: Path) -> None:
    assert load(inside / "a.npy").size == 64
    for path in ("../in-other/a.npy", "link.npy", "links/a.npy", "/etc/passwd", "../nothing.npy"):
        with pytest.raises(InputError, match=r"is outside .*in; texvol view --files FOLDER"):
            load(inside / path)
    with pytest.raises(InputError, match="is outside"):
        load("http://127.0.0.1:1/a.zarr")


@pytest.mark.parametrize("kind", ["link", "external", "virtual"])
def test_a_dataset_whose_samples_another_file_holds_is_read_from_within_only(inside: Path, kind: str) -> None:
    def write(path: Path, name: str) -> Path:
        with h5py.File(path, "w") as file:
            if kind == "link":
                file["v"] = h5py.ExternalLink(name + ".h5", "/v")
            elif kind == "external":
                file.create_dataset("v", (4, 4, 4), "f4", external=[(name + ".raw", 0, 256)])
            else:
                layout = h5py.VirtualLayout((4, 4, 4), "f4")
                layout[:] = h5py.VirtualSource(name + ".h5", "v", (4, 4, 4))
                file.create_virtual_dataset("v", layout)
        return path

    for folder in (inside, inside.parent / "in-other"):
        (folder / "b.raw").write_bytes(np.ones(64, np.float32).tobytes())
        with h5py.File(folder / "b.h5", "w") as file:
            file["v"] = np.ones((4, 4, 4), np.float32)
    beside = str(inside / "b") if kind == "external" else "b"  # raw files lie in the working directory
    assert load(write(inside / "good.h5", beside), variable="/v").values.sum() == 64
    with pytest.raises(InputError, match="in-other.*is outside"):
        load(write(inside / "bad.h5", str(inside.parent / "in-other/b")), variable="/v")


def test_slices_and_meshes_are_read_from_within_only(inside: Path) -> None:
    other = inside.parent / "in-other"
    (inside / "series").mkdir()
    for number in range(3):
        tifffile.imwrite(other / f"{number}.tif", np.full((4, 4), number, np.uint8))
        (inside / f"series/{number}.tif").symlink_to(other / f"{number}.tif")
    with pytest.raises(InputError, match="in-other/0.tif.*is outside|series/0.tif.*is outside"):
        load(inside / "series")
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    mesh = meshio.Mesh(points, [("tetra", np.array([[0, 1, 2, 3]]))], point_data={"p": np.arange(4.0)})
    for data_format, ending in (("HDF", "h5"), ("Binary", "bin")):
        path = inside / f"{ending}.xdmf"
        meshio.xdmf.write(path, mesh, data_format=data_format)
        for file in [each for each in inside.iterdir() if each.suffix == f".{ending}"]:
            file.rename(other / file.name)
            text = path.read_text().replace(file.name, f"../in-other/{file.name}")
            path.write_text(text)
        with pytest.raises(InputError, match="is outside"):
            load(path, resolution=(4, 4, 4))


def test_nothing_else_is_read_or_written_outside(inside: Path) -> None:
    other = inside.parent / "in-other"
    with pytest.raises(InputError, match="is outside"):
        geometry.load_mesh(other / "points.ply")
    with pytest.raises(InputError, match="is outside"):
        TransferFunction.load(other / "tf.json")
    for path in (other / "new", inside / "links/new", inside / "../new"):
        with pytest.raises(InputError, match="is outside"):
            writing.write_files({path: b""})
        with pytest.raises(InputError, match="is outside"):
            writing.check_writable(path)
    writing.write_files({inside / "new": b"", inside.parent / "own/new": b""})
    assert reach.folders() == (str(inside),)
    assert sorted(each.name for each in other.iterdir()) == ["a.npy", "points.ply", "tf.json"]


def test_a_url_reaches_what_is_below_it_and_nothing_above() -> None:
    reach.limit(["https://user:word@example.org/data"])
    try:
        assert reach.holds("https://user:word@example.org/data/a.zarr")
        for path in ("data/../a", "data/%2e%2e/a", "database", ""):
            assert not reach.holds(f"https://user:word@example.org/{path}")
        assert not reach.holds("https://example.com/data")
        assert not reach.holds("/data")
        with pytest.raises(InputError) as raised:
            reach.check("/etc/passwd")
        assert "word" not in str(raised.value)
    finally:
        reach.limit(None)
    assert reach.holds("/etc/passwd"), "without a limit, all"
