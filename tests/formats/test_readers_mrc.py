"""MRC: modes, byte orders, axis orders, cells; written by mrcfile and patched."""

from __future__ import annotations

import bz2
import gzip
from pathlib import Path

import mrcfile
import numpy as np
import pytest
from support import marked

from texvol import InputError, load


def written(path: Path, dtype: str = "f4", values: np.ndarray | None = None, **fields: object) -> Path:
    """Write the marked volume with a cell of spacing 2, 3, 4, and set further fields of the header."""
    with mrcfile.new(path, overwrite=True) as file:
        file.set_data(marked.marked(dtype) if values is None else values)
        file.set_volume()
        file.voxel_size = marked.SPACING
        for key, value in fields.items():
            file.header[key] = value
    return path


@pytest.mark.parametrize("dtype", ["i1", "i2", "u2", "f2", "f4"])
def test_every_mode(tmp_path: Path, dtype: str) -> None:
    volume = load(written(tmp_path / "v.mrc", dtype, origin=(1, 2, 3)))
    marked.check(volume, dtype, position=np.array([1, 2, 3]) + np.multiply(marked.SPACING, marked.MARK), atol=1e-5)
    assert volume.unit == "Å"


@pytest.mark.parametrize("dtype", ["i2", "f4"])
def test_big_endian(tmp_path: Path, dtype: str) -> None:
    path = written(tmp_path / "v.mrc", dtype)
    content = path.read_bytes()
    header = np.frombuffer(content[:1024], mrcfile.dtypes.HEADER_DTYPE).astype(
        mrcfile.dtypes.HEADER_DTYPE.newbyteorder(">")
    )
    header["machst"] = [0x11, 0x11, 0, 0]
    path.write_bytes(header.tobytes() + marked.marked(f">{dtype}").tobytes())
    marked.check(load(path), dtype, position=np.multiply(marked.SPACING, marked.MARK), atol=1e-5)


@pytest.mark.parametrize(("ending", "pack"), [(".map.gz", gzip.compress), (".rec.bz2", bz2.compress), (".rec", bytes)])
def test_packed(tmp_path: Path, ending: str, pack: type[bytes]) -> None:
    content = written(tmp_path / "v.mrc").read_bytes()
    (tmp_path / f"v{ending}").write_bytes(pack(content))
    marked.check(load(tmp_path / f"v{ending}"), "f4", position=np.multiply(marked.SPACING, marked.MARK), atol=1e-5)


def test_an_extended_header_is_passed_over(tmp_path: Path) -> None:
    with mrcfile.new(tmp_path / "v.mrc") as file:
        file.set_data(marked.marked("f4"))
        file.set_extended_header(np.zeros(160, "u1"))
    marked.check(load(tmp_path / "v.mrc"), "f4", position=marked.MARK)


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 1, 2), (2, 1, 3), (3, 2, 1)])
@pytest.mark.parametrize("has_origin", [False, True])
def test_permuted_axes_are_put_in_order(tmp_path: Path, order: tuple[int, int, int], has_origin: bool) -> None:
    """Columns, rows and sections run along the axes that MAPC, MAPR and MAPS say; NSTART is in that order too."""
    starts_xyz = (5, -6, 7)
    sizes = marked.DIMENSIONS
    fields: dict[str, object] = dict(zip(("mapc", "mapr", "maps"), order, strict=True))
    for key, axis in zip(("nxstart", "nystart", "nzstart"), order, strict=True):
        fields[key] = starts_xyz[axis - 1]
    fields |= {"mx": sizes[0], "my": sizes[1], "mz": sizes[2], "cella": tuple(np.multiply(sizes, marked.SPACING))}
    fields["origin"] = (1, 2, 3) if has_origin else (0, 0, 0)
    # Axis 2 - a of the array is crystal axis a; the file's slowest axis is the last of `order`.
    stored = np.ascontiguousarray(marked.marked("f4").transpose([3 - axis for axis in order[::-1]]))
    volume = load(written(tmp_path / "v.mrc", values=stored, **fields))
    origin = (1, 2, 3) if has_origin else np.multiply(starts_xyz, marked.SPACING)
    marked.check(volume, "f4", position=origin + np.multiply(marked.SPACING, marked.MARK), atol=1e-5)


def test_a_slanted_cell_slants_the_axes(tmp_path: Path) -> None:
    volume = load(written(tmp_path / "v.mrc", cellb=(90, 120, 90)))
    a, b, c = volume.direction.T
    np.testing.assert_allclose(volume.spacing, marked.SPACING, rtol=1e-6)
    np.testing.assert_allclose((a @ b, b @ c, a @ c), (0, 0, -0.5), atol=1e-7)


def test_a_stack_of_volumes_needs_a_choice(tmp_path: Path) -> None:
    with mrcfile.new(tmp_path / "v.mrc") as file:
        file.set_data(np.stack([marked.marked("f4") * 0, marked.marked("f4")]))
    marked.check(load(tmp_path / "v.mrc", channel=1), "f4", position=marked.MARK)
    with pytest.raises(InputError, match=r"4 axes .*0\.\.1"):
        load(tmp_path / "v.mrc")


def test_imod_bytes_without_a_sign(tmp_path: Path) -> None:
    path = written(tmp_path / "v.mrc", "i1")
    content = bytearray(path.read_bytes())
    content[152:160] = (1146047817).to_bytes(4, "little") + bytes(4)
    content[1024] = 200
    path.write_bytes(content)
    assert load(path).values.max() == 200


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"mapc": 1, "mapr": 1}, "MAPC"),
        ({"mode": 4}, "complex"),
        ({"mode": 101}, "four bits"),
        ({"mode": 77}, "MRC"),
        ({"nz": 0}, "positive"),
        ({"nx": -4}, "positive"),
        ({"nz": 2}, "holds 240 bytes"),
        ({"nz": 2**30, "ny": 2**30}, "this machine has"),
        ({"nsymbt": -8}, "extended"),
        ({"nsymbt": 2**30}, "holds 0 bytes"),
        ({"cella": (10, -12, 12)}, "spacing must be positive"),
        ({"cella": (10, np.nan, 12)}, "spacing must be positive"),
        ({"cellb": (90, 90, 180)}, "singular"),
        ({"cellb": (30, 30, 90)}, "angles"),
        ({"origin": (np.inf, 0, 0)}, "origin must be finite"),
        ({"map": b"XYZ "}, "MRC"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(tmp_path: Path, fields: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=rf"v\.mrc: .*{reason}"):
        load(written(tmp_path / "v.mrc", **fields))
