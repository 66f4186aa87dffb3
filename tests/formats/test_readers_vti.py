"""VTI, held against VTK: what its writer writes is read, in every form that it writes."""

from __future__ import annotations

import base64
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from support import marked
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from texvol import InputError, load

EXTENT_BEGIN = (4, -2, 7)
POSITION = np.array(marked.ORIGIN) + marked.DIRECTION @ (
    np.array(marked.SPACING) * (np.array(marked.MARK) + EXTENT_BEGIN)
)
MODES = {"ascii": 0, "binary": 1, "appended": 2}
PACKERS = {"plain": 0, "zlib": 1, "lz4": 2, "lzma": 3}


def image_of(dtype: str = "i2", cells: bool = False, components: int = 1) -> vtkImageData:
    """The marked volume as VTK's image, at points or at cells; of several components the last one is it."""
    image = vtkImageData()
    ends = [begin + size - (0 if cells else 1) for begin, size in zip(EXTENT_BEGIN, marked.DIMENSIONS, strict=True)]
    image.SetExtent(EXTENT_BEGIN[0], ends[0], EXTENT_BEGIN[1], ends[1], EXTENT_BEGIN[2], ends[2])
    image.SetSpacing(marked.SPACING)
    image.SetOrigin(marked.ORIGIN)
    image.SetDirectionMatrix(marked.DIRECTION.ravel().tolist())
    samples = np.zeros((60, components), dtype)
    samples[:, -1] = marked.marked(dtype).ravel()
    array = numpy_to_vtk(samples, deep=True)
    array.SetName("values")
    (image.GetCellData() if cells else image.GetPointData()).SetScalars(array)
    return image


def written(path: Path, image: vtkImageData, mode: str = "binary", packer: str = "zlib", **more: int) -> Path:
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.SetDataMode(MODES[mode])
    writer.SetCompressorType(PACKERS[packer])
    writer.SetEncodeAppendedData(more.get("base64", 1))
    writer.SetByteOrder(more.get("little", 1))
    writer.SetHeaderType(more.get("words", 32))
    writer.SetBlockSize(more.get("block", 32768))
    assert writer.Write()
    return path


@pytest.mark.parametrize("little", [0, 1])
@pytest.mark.parametrize("words", [32, 64])
@pytest.mark.parametrize("packer", PACKERS)
@pytest.mark.parametrize(("mode", "base64"), [("ascii", 1), ("binary", 1), ("appended", 1), ("appended", 0)])
def test_every_form_that_vtk_writes(
    tmp_path: Path, mode: str, base64: int, packer: str, words: int, little: int
) -> None:
    path = written(tmp_path / "v.vti", image_of(), mode, packer, base64=base64, words=words, little=little, block=56)
    volume = load(path)
    # VTK writes the direction with as many digits as a double needs, or six; the mark is 40 from the origin.
    marked.check(volume, position=POSITION, atol=1e-4)


@pytest.mark.parametrize("packer", ["plain", "zlib"])
@pytest.mark.parametrize("little", [0, 1])
@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"])
def test_every_type_and_byte_order(tmp_path: Path, dtype: str, little: int, packer: str) -> None:
    path = written(tmp_path / "v.vti", image_of(dtype), packer=packer, little=little)
    marked.check(load(path), dtype, position=POSITION, atol=1e-4)


def test_values_of_cells_lie_at_their_centres(tmp_path: Path) -> None:
    volume = load(written(tmp_path / "v.vti", image_of(cells=True)))
    half = marked.DIRECTION @ (np.array(marked.SPACING) / 2)
    marked.check(volume, position=POSITION + half, atol=1e-4)


def test_components_need_a_choice(tmp_path: Path) -> None:
    path = written(tmp_path / "v.vti", image_of(components=2))
    marked.check(load(path, channel=1), position=POSITION, atol=1e-4)
    with pytest.raises(InputError, match=r"--channel 0\.\.1"):
        load(path)


def test_the_array_marked_as_scalars_is_read(tmp_path: Path) -> None:
    image = image_of()
    for name in ("another", "third"):
        other = numpy_to_vtk(np.zeros(60, "f4"), deep=True)
        other.SetName(name)
        image.GetPointData().AddArray(other)
    path = written(tmp_path / "v.vti", image)
    marked.check(load(path), position=POSITION, atol=1e-4)
    path.write_text(path.read_text().replace(' Scalars="values"', ""))
    with pytest.raises(InputError, match="Scalars; it has values, another, third"):
        load(path)


PIECES = """<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian"><ImageData WholeExtent="0 4 0 3 0 2">
<Piece Extent="0 2 0 3 0 2"><PointData><DataArray type="Int16" format="ascii">{}</DataArray></PointData></Piece>
<Piece Extent="{} 4 0 3 0 2"><PointData><DataArray type="Int16" format="ascii">{}</DataArray></PointData></Piece>
</ImageData></VTKFile>"""


def as_text(values: np.ndarray) -> str:
    return " ".join(map(str, values.ravel().tolist()))


def test_pieces_are_put_together(tmp_path: Path) -> None:
    values = marked.marked()
    path = tmp_path / "v.vti"
    path.write_text(PIECES.format(as_text(values[:, :, :3]), 2, as_text(values[:, :, 2:])))
    marked.check(load(path), position=marked.MARK)
    path.write_text(PIECES.format(as_text(values[:, :, :3]), 4, as_text(values[:, :, 4:])))
    with pytest.raises(InputError, match="do not cover"):
        load(path)


@pytest.mark.parametrize(
    ("pattern", "replacement", "reason"),
    [
        (r'WholeExtent="[^"]*"', 'WholeExtent="0 1 0 1"', "extent"),
        (r'WholeExtent="[^"]*"', 'WholeExtent="0 9999999 0 9999999 0 9999999"', "this machine has"),
        (r'WholeExtent="[^"]*"', 'WholeExtent="5 0 0 1 0 1"', "positive"),
        (r'Extent="4 8 ', 'Extent="4 9 ', "need 144"),
        (r'Spacing="[^"]*"', 'Spacing="1 -1 1"', "spacing must be positive"),
        (r'Spacing="[^"]*"', 'Spacing="1 nan 1"', "spacing must be finite"),
        (r'Direction="[^"]*"', 'Direction="1 0 0 1 0 0 0 0 1"', "singular"),
        (r'type="Int16"', 'type="String"', "String"),
        (r'type="Int16"', 'type="Int32"', "need"),
        (r'format="binary"', 'format="appended" offset="9"', "no data"),
        (r"vtkZLibDataCompressor", "vtkFancyCompressor", "vtkFancyCompressor"),
        (r'type="ImageData"', 'type="RectilinearGrid"', "named VTI"),
        (r"</Piece>", "", "VTI"),
        (r"<VTKFile", "<!DOCTYPE x><VTKFile", "document type"),
    ],
)
def test_a_header_that_makes_no_sense_is_refused(tmp_path: Path, pattern: str, replacement: str, reason: str) -> None:
    path = written(tmp_path / "v.vti", image_of())
    text, count = re.subn(pattern, replacement, path.read_text())
    assert count
    path.write_text(text)
    with pytest.raises(InputError, match=rf"v\.vti: .*{reason}"):
        load(path)


def test_a_block_that_unpacks_to_more_is_not_unpacked(tmp_path: Path) -> None:
    """A bomb: 60 samples are wanted, and the block holds 100 MB of zeros."""
    bomb = zlib.compress(bytes(10**8), 9)
    head = np.array([1, 120, 0, len(bomb)], "<u4").tobytes()
    text = written(tmp_path / "v.vti", image_of()).read_text()
    data = base64.b64encode(head).decode() + base64.b64encode(bomb).decode()
    text = re.sub(r"(<DataArray[^>]*>)[^<]*", lambda match: match.group(1) + data, text)
    (tmp_path / "v.vti").write_text(text)
    with pytest.raises(InputError, match="unpacks to 121 bytes of 120"):
        load(tmp_path / "v.vti")
