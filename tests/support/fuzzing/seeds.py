"""Small sound files of every kind that texvol reads, as bytes, for `fuzz.py` to damage.

A seed is a set of files, one of which is opened; the reader's name says by what. Volumes are 3 x 4 x 5 samples unless
their coding wants more.
"""

from __future__ import annotations

import gzip
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

VALUES = np.arange(60, dtype="i2").reshape(3, 4, 5)
STEPS = np.arange(120, dtype="i2").reshape(2, 3, 4, 5)
_TIMES = re.compile(
    rb"\d{4}:\d\d:\d\d \d\d:\d\d:\d\d|# on \d{4}-\d\d-\d\d \d\d:\d\d:\d\d"
    rb"|uuid:[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}"
)
TURN = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, -1.0]])


@dataclass(frozen=True)
class Seed:
    """Files by name, the one that is opened ("" is their folder), and how."""

    kind: str
    files: Mapping[str, bytes]
    opened: str
    reader: str = "volume"
    options: Mapping[str, Any] = field(default_factory=dict)
    text: bool = False  # all of it is tokens


def seeds(*, files: bool = True, stores: bool = True) -> list[Seed]:
    """All seeds, those of pictures, meshes and texts included; those of Zarr stores alone, or none of them."""
    from support.fuzzing import seeds_dicom as fuzz_seeds_dicom
    from support.fuzzing import seeds_grids as fuzz_seeds_grids
    from support.fuzzing import seeds_meshes as fuzz_seeds_meshes
    from support.fuzzing import seeds_sciences as fuzz_seeds_sciences
    from support.fuzzing import seeds_stores as fuzz_seeds_stores
    from support.fuzzing import seeds_texts as fuzz_seeds_texts
    from support.fuzzing import seeds_zarr as fuzz_seeds_zarr

    of_stores = fuzz_seeds_zarr.seeds
    makers = (_nrrd, _nifti, _metaimage, _tiff, _mrc, _plain, _masks)
    makers += (fuzz_seeds_dicom.seeds, fuzz_seeds_grids.seeds, fuzz_seeds_meshes.seeds)
    makers += (fuzz_seeds_texts.seeds, fuzz_seeds_stores.seeds, of_stores, fuzz_seeds_sciences.seeds)
    found = (seed for make in makers if (stores if make is of_stores else files) for seed in make())
    return [replace(seed, files={name: _undated(each) for name, each in seed.files.items()}) for seed in found]


def _undated(content: bytes) -> bytes:
    """Content without the time at which it was made, and names made of it, so that it is the same whenever it is."""
    if content.startswith(b"\x1f\x8b"):
        return content[:4] + bytes(4) + content[8:]
    return _TIMES.sub(lambda found: re.sub(rb"[0-9a-f]", b"0", found.group()), content)


def written(name: str, write: Callable[[Path], object]) -> bytes:
    """Bytes of what `write` writes into a file of that name."""
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / name)
        return (Path(folder) / name).read_bytes()


def of(
    kind: str, name: str, write: Callable[[Path], object], reader: str = "volume", *, text: bool = False, **options: Any
) -> Seed:
    """A seed of one file."""
    return Seed(kind, {name: written(name, write)}, name, reader, options, text)


def _nrrd() -> Iterator[Seed]:
    import nrrd

    header = {"space": "left-posterior-superior", "space directions": TURN * [2, 3, 4], "space origin": [1, 2, 3]}
    for encoding in ("raw", "gzip", "bzip2", "ascii"):

        def write(path: Path, encoding: str = encoding) -> None:
            nrrd.write(str(path), VALUES.T, header | {"encoding": encoding})

        yield of("nrrd", "v.nrrd", write, text=encoding == "ascii")
    plain = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nspacings: 1 2 3\nendian: little\nencoding: {}\n"
    lines = plain.format("hex").encode() + b"\n" + VALUES.tobytes().hex().encode() + b"\n"
    yield Seed("nrrd", {"v.nrrd": lines}, "v.nrrd", text=True)
    slices = {f"s{number}.raw": each.tobytes() for number, each in enumerate(VALUES)}
    for data in ("data file: s%d.raw 0 2 1 2", "data file: LIST 2\ns0.raw\ns1.raw\ns2.raw", "data file: all.raw"):
        files = slices if "all" not in data else {"all.raw": bytes(7) + b"a line\n" + VALUES.tobytes()}
        skips = "" if "all" not in data else "byte skip: -1\n"
        head = plain.format("raw") + skips + 'axis mins: 0 0 0\nkinds: space space space\nunits: "mm" "mm" "mm"\n'
        yield Seed("nrrd", {"v.nhdr": f"{head}{data}\n".encode(), **files}, "v.nhdr", text=True)
    text = plain.format("raw").replace("dimension: 3", "dimension: 4").replace("5 4 3", "5 4 3 2")
    text = text.replace("1 2 3", "1 2 3 0.5") + "line skip: 1\nbyte skip: 2\nkey:=value\n\n"
    series = text.encode() + b"x\nab" + STEPS.tobytes()
    yield Seed("nrrd", {"v.nrrd": series}, "v.nrrd", "series")
    color = plain.format("raw").replace("dimension: 3", "dimension: 4").replace("5 4 3", "3 5 4 3")
    color = color.replace("short", "uchar").replace("spacings: 1 2 3", "kinds: RGB-color domain domain domain") + "\n"
    yield Seed("nrrd", {"v.nrrd": color.encode() + bytes(range(180))}, "v.nrrd")


def _nifti() -> Iterator[Seed]:
    import nibabel

    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = TURN * [2, 3, 4], [1, 2, 3]
    for name, make in (("v.nii", nibabel.Nifti1Image), ("v2.nii", nibabel.Nifti2Image)):
        yield of("nifti", name, lambda path, make=make: nibabel.save(make(VALUES.T, affine), path))
    yield of("nifti", "v.nii.gz", lambda path: nibabel.save(nibabel.Nifti1Image(VALUES.T, affine), path))
    yield of("nifti", "t.nii", lambda path: nibabel.save(nibabel.Nifti1Image(STEPS.T, affine), path), "series")
    with tempfile.TemporaryDirectory() as folder:
        image = nibabel.Nifti1Pair(VALUES.T, affine)
        image.header.set_slope_inter(2.5, -3)
        nibabel.save(image, Path(folder) / "p.hdr")
        pair = {path.name: path.read_bytes() for path in Path(folder).iterdir()}
    yield Seed("nifti", pair, "p.hdr")
    colors = np.zeros((5, 4, 3), [("R", "u1"), ("G", "u1"), ("B", "u1")])
    yield of("nifti", "c.nii", lambda path: nibabel.save(nibabel.Nifti1Image(colors, affine), path))


def _metaimage() -> Iterator[Seed]:
    head = "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
    head += "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 1 2 3\nCenterOfRotation = 0 0 0\n"
    head += "AnatomicalOrientation = RAI\nElementSpacing = 2 3 4\nDimSize = 5 4 3\nElementType = MET_SHORT\n"
    local = "ElementDataFile = LOCAL\n"
    yield Seed("metaimage", {"v.mha": (head + local).encode() + VALUES.tobytes()}, "v.mha")
    import zlib

    packed = zlib.compress(VALUES.tobytes())
    told = head.replace("CompressedData = False", f"CompressedData = True\nCompressedDataSize = {len(packed)}")
    yield Seed("metaimage", {"z.mha": (told + local).encode() + packed}, "z.mha")
    skips = "HeaderSize = -1\nElementDataFile = d.raw\n"
    yield Seed("metaimage", {"v.mhd": (head + skips).encode(), "d.raw": b"ab" + VALUES.tobytes()}, "v.mhd", text=True)
    slices = {f"s{number}.raw": each.tobytes() for number, each in enumerate(VALUES)}
    for data in ("s%d.raw 0 2 1\n", "LIST\ns0.raw\ns1.raw\ns2.raw\n"):
        files = {"v.mhd": f"{head}ElementDataFile = {data}".encode(), **slices}
        yield Seed("metaimage", files, "v.mhd", text=True)
    color = head.replace("MET_SHORT", "MET_UCHAR") + "ElementNumberOfChannels = 3\n" + local
    yield Seed("metaimage", {"c.mha": color.encode() + bytes(range(180))}, "c.mha")


def _tiff() -> Iterator[Seed]:
    import tifffile

    def tiff(values: NDArray, name: str = "v.tif", reader: str = "volume", **how: Any) -> Seed:
        how = {"photometric": "minisblack"} | how
        return of("tiff", name, lambda path: tifffile.imwrite(path, values, **how), reader)

    yield tiff(VALUES)
    for coding in ("zlib", "lzw", "packbits", "jpeg", "lzma", "zstd", "jpeg2000", "jpegxl", "lerc", "png"):
        values = VALUES.astype("u1") if coding in ("jpeg", "png", "jpegxl") else VALUES.astype("u2")
        yield tiff(np.kron(values, np.ones((1, 4, 4), values.dtype)), compression=coding)
    yield tiff(VALUES.astype("f4"), compression="zlib", predictor=3, bigtiff=True)
    yield tiff(np.kron(VALUES, np.ones((1, 8, 8), "i2")), tile=(16, 16), compression="deflate")
    yield tiff(VALUES, imagej=True, resolution=(2, 3), metadata={"spacing": 2.5, "unit": "um", "axes": "ZYX"})
    yield tiff(STEPS, "t.tif", "series", imagej=True, metadata={"spacing": 2.5, "axes": "TZYX", "finterval": 0.5})
    sizes = {"PhysicalSizeX": 0.5, "PhysicalSizeXUnit": "um", "PhysicalSizeZ": 2.0, "axes": "TZYX"}
    yield tiff(STEPS, "t.ome.tif", "series", ome=True, metadata=sizes)
    colors = np.arange(180, dtype="u1").reshape(3, 4, 5, 3)
    yield tiff(colors, "c.tif", photometric="rgb")
    pages = {f"p{number}.tif": tiff(each).files["v.tif"] for number, each in enumerate(VALUES)}
    yield Seed("tiff", pages, "")


def _mrc() -> Iterator[Seed]:
    import mrcfile

    for name, values in (
        ("v.mrc", VALUES),
        ("f.map", VALUES.astype("f4")),
        ("v.map.gz", VALUES),
        ("b.rec.bz2", VALUES),
    ):

        def write(path: Path, values: NDArray = values) -> None:
            packer = {".gz": "gzip", ".bz2": "bzip2"}.get(path.suffix)
            with mrcfile.new(path, compression=packer) as file:
                file.set_data(values)
                file.set_volume()
                file.voxel_size = (2, 3, 4)
                file.header.label[:] = b""  # would say when it was made

        yield of("mrc", name, write)


def _plain() -> Iterator[Seed]:
    yield of("npy", "v.npy", lambda path: np.save(path, VALUES))
    yield of("npy", "f.npy", lambda path: np.save(path, np.asfortranarray(VALUES.astype(">f8"))))
    yield of("npy", "t.npy", lambda path: np.save(path, STEPS.astype("f2")), "series")
    raw = {"shape": (5, 4, 3), "dtype": "int16", "spacing": (1, 2, 3)}
    yield Seed("raw", {"v.raw": VALUES.tobytes()}, "v.raw", options=raw)
    yield Seed("raw", {"v.raw.gz": gzip.compress(VALUES.tobytes(), mtime=0)}, "v.raw.gz", options=raw)
    floats = VALUES.astype(">f4").tobytes()
    yield Seed("raw", {"v.dat": floats}, "v.dat", options={"shape": (5, 4, 3), "dtype": ">f4"})


def _masks() -> Iterator[Seed]:
    import nrrd

    yield of("mask", "m.nrrd", lambda path: nrrd.write(str(path), (VALUES % 2).astype("u1").T), "mask")
    yield of("mask", "m.npy", lambda path: np.save(path, VALUES.astype("f4") / 60), "mask")
    yield of("mask", "f.npy", lambda path: np.save(path, VALUES), "mask", fade=(3, 20))
