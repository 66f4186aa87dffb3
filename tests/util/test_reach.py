"""Files that a window in a browser may use: those in its folders, whatever path leads to them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import meshio
import nibabel
import numpy as np
import pytest
import tifffile
import zarr
from scipy.io import savemat
from support.fuzzing.seeds_sciences import seeds

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
    with h5py.File(inside / "good.h5") as file, h5py.File(inside / "far.h5", "w") as far:
        assert file["v"].shape == (4, 4, 4)
        far["v"] = h5py.ExternalLink("bad.h5", "/v")  # a file within that names one outside
    with pytest.raises(InputError, match="in-other.*is outside"):
        load(inside / "far.h5", variable="/v")


@pytest.mark.parametrize("ending", ["nc", "mnc", "med", "ims", "e"])
def test_other_formats_in_hdf5_name_files_within_only(inside: Path, ending: str) -> None:
    with h5py.File(inside / f"b.{ending}", "w") as file:
        file["/a/b"] = h5py.ExternalLink("../in-other/b.h5", "/v")
    with h5py.File(inside.parent / "in-other/b.h5", "w") as file:
        file["v"] = np.ones((4, 4, 4), np.float32)
    with pytest.raises(InputError, match="in-other/b.h5: is outside"):
        load(inside / f"b.{ending}")


def test_names_of_parts_with_numbers_are_held_too(inside: Path) -> None:
    other = inside.parent / "in-other"
    with h5py.File(other / "b-0.h5", "w") as file:
        file["v"] = np.ones((4, 4, 4), np.float32)
    many = h5py.h5s.UNLIMITED
    space, made = h5py.h5s.create_simple((4, 4, 4), (many, 4, 4)), h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    space.select_hyperslab((0, 0, 0), (many, 1, 1), (4, 4, 4), (4, 4, 4))
    made.set_virtual(space, b"../in-other/b-%b.h5", b"v", h5py.h5s.create_simple((4, 4, 4)))
    with h5py.File(inside / "b.h5", "w") as file:
        h5py.h5d.create(file.id, b"v", h5py.h5t.IEEE_F32LE, space, made)
    with pytest.raises(InputError, match="in-other/b-0.h5: is outside"):
        load(inside / "b.h5", variable="/v")


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("linked", ["chunk", "folder of chunks", "array", "metadata"])
def test_chunks_and_metadata_of_a_store_are_read_from_within_only(inside: Path, version: Any, linked: str) -> None:
    def write(folder: Path) -> Path:
        group = zarr.open_group(folder, mode="w", zarr_format=version)
        chunks: dict[str, Any] = {"chunk_key_encoding": {"name": "default", "separator": "/"}} if version == 3 else {}
        array = group.create_array("v", shape=(4, 4, 4), chunks=(2, 2, 2), dtype="f4", **chunks)
        array[:] = 1
        return folder

    good, other = write(inside / "good.zarr"), write(inside.parent / "in-other/a.zarr")
    places = ["v/c/1/1/1", "v/c/1", "v", "v/zarr.json"] if version == 3 else ["v/1.1.1", "v", "v", "v/.zarray"]
    place = places[["chunk", "folder of chunks", "array", "metadata"].index(linked)]
    moved = good / place
    moved.rename(inside / "moved")
    moved.symlink_to(inside / "moved")
    assert load(good, variable="v").values.sum() == 64, "a link within the folders"
    moved.unlink()
    moved.symlink_to(other / place)
    with pytest.raises(InputError, match="is outside"):
        load(good, variable="v")


HEADERS = {
    "nrrd": "NRRD0004\ntype: float\ndimension: 3\nsizes: 4 4 4\nencoding: raw\nendian: little\ndata file: FILE\n",
    "mhd": "NDims = 3\nDimSize = 4 4 4\nElementType = MET_FLOAT\nElementDataFile = FILE\n",
}


@pytest.mark.parametrize("named", ["b.raw", "../in-other/b.raw", "ABSOLUTE", "links/b.raw"])
@pytest.mark.parametrize("kind", list(HEADERS))
def test_a_data_file_that_a_header_names_is_read_from_within_only(inside: Path, kind: str, named: str) -> None:
    other = inside.parent / "in-other/b.raw"
    other.write_bytes(np.ones(64, np.float32).tobytes())
    (inside / "b.raw").symlink_to(other)
    header = inside / f"b.{kind.replace('nrrd', 'nhdr')}"
    header.write_text(HEADERS[kind].replace("FILE", named.replace("ABSOLUTE", str(other))))
    with pytest.raises(InputError, match="outside|absolute"):
        load(header)


@pytest.mark.parametrize("linked", [0, 1])
@pytest.mark.parametrize("kind", ["NIfTI", "Analyze", "AFNI"])
def test_both_halves_of_a_pair_are_read_from_within_only(inside: Path, kind: str, linked: int) -> None:
    other = inside.parent / "in-other"
    if kind == "AFNI":
        names = ["v+orig.HEAD", "v+orig.BRIK"]
        for name, content in next(each.files for each in seeds() if each.kind == "afni").items():
            (inside / name).write_bytes(content)
    else:
        names = ["b.hdr", "b.img"]
        image = {"NIfTI": nibabel.Nifti1Pair, "Analyze": nibabel.AnalyzeImage}[kind]
        image(np.ones((4, 4, 4), np.float32), np.eye(4)).to_filename(inside / "b.img")
    assert load(inside / names[0]).size
    (inside / names[linked]).rename(other / names[linked])
    (inside / names[linked]).symlink_to(other / names[linked])
    for each in names:
        with pytest.raises(InputError, match="is outside"):
            load(inside / each)


def test_a_matrix_beside_analyze_is_read_from_within_only(inside: Path) -> None:
    nibabel.AnalyzeImage(np.ones((4, 4, 4), np.float32), np.eye(4)).to_filename(inside / "b.img")
    savemat(inside.parent / "in-other/b.mat", {"mat": np.eye(4)})
    (inside / "b.mat").symlink_to(inside.parent / "in-other/b.mat")
    with pytest.raises(InputError, match="b.mat: is outside"):
        load(inside / "b.hdr")


@pytest.mark.parametrize("name", ["../in-other/part.vtu", "link.vtu"])
def test_parts_of_a_pvtu_are_read_from_within_only(inside: Path, name: str) -> None:
    part = inside.parent / "in-other/part.vtu"
    part.write_text("<VTKFile type='UnstructuredGrid'/>")
    (inside / "link.vtu").symlink_to(part)
    (inside / "b.pvtu").write_text(
        "<?xml version='1.0'?><VTKFile type='PUnstructuredGrid' version='1.0' byte_order='LittleEndian'>"
        f"<PUnstructuredGrid><Piece Source='{name}'/></PUnstructuredGrid></VTKFile>"
    )
    with pytest.raises(InputError, match="is outside"):
        load(inside / "b.pvtu", resolution=(4, 4, 4))


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
        for written in (text, text.replace("../", "&#46;./"), text.replace("../", "<![CDATA[../]]>")):
            path.write_text(written)
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
