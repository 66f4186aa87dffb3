"""Files made by hand for `fuzz.py`: bombs, loops, and numbers that do harm unless they are checked first."""

from __future__ import annotations

import gzip
import json
import struct
import zlib
from collections.abc import Iterator

import numpy as np

from support.fuzzing.seeds import VALUES, Seed, written

_HUGE = (10**12, 2**31 - 1, 2**31, 2**32, 2**63 - 1, 2**64, 10**30, -1, -(2**31), 0)
_DEEP = 100_000  # brackets within brackets


def cases() -> list[Seed]:
    """All of them."""
    makers = (
        _nrrd,
        _nifti,
        _metaimage,
        _tiff,
        _npy,
        _vtk,
        _unstructured,
        _netcdf,
        _dicom,
        _pictures,
        _meshes,
        _json,
        _toml,
        _others,
    )
    return [case for make in makers for case in make()]


def _one(kind: str, name: str, content: bytes | str, reader: str = "volume") -> Seed:
    return Seed(kind, {name: content.encode() if isinstance(content, str) else content}, name, reader)


_NRRD = "NRRD0004\ntype: short\ndimension: 3\nsizes: 5 4 3\nendian: little\nencoding: {}\n"


def _nrrd() -> Iterator[Seed]:
    samples = VALUES.tobytes()
    for number in _HUGE:
        for field in ("line skip", "byte skip", "dimension"):
            for encoding, content in (("raw", samples), ("gzip", gzip.compress(samples))):
                yield _one("nrrd", "v.nrrd", f"{_NRRD.format(encoding)}{field}: {number}\n\n".encode() + content)
        sizes = _NRRD.format("gzip").replace("5 4 3", f"{number} 4 3")
        yield _one("nrrd", "v.nrrd", f"{sizes}\n".encode() + gzip.compress(samples))
    patterns = ("f%099999d.raw 0 2 1", "f%d.raw 0 99999999999 1", "f%d.raw 0 2 0", "f%d.raw 0 -5 -1", "%s%s%n 0 2 1")
    patterns += (
        "f%*d.raw 0 2 1",
        "f%.99999999d.raw 0 2 1",
        "f%d.raw 2 0 1",
        "f%d.raw 0 2 1 99",
        "/dev/zero",
        "%d%d 0 2 1",
    )
    for data in (*patterns, "LIST 3", "LIST\n" + "v.nhdr\n" * 9999, "../../../etc/passwd", "v.nhdr", "a\0b.raw", "."):
        yield _one("nrrd", "v.nhdr", f"{_NRRD.format('raw')}data file: {data}\n\n")
    yield _one("nrrd", "v.nrrd", _NRRD.format("raw") + "key:=value\n" * 50_000 + "\n")
    yield _one("nrrd", "v.nrrd", _NRRD.format("gzip").encode() + b"\n" + gzip.compress(bytes(64 << 20)))
    yield _one("nrrd", "v.nrrd", _NRRD.format("ascii") + "\n" + "1 " * 2_000_000)
    yield _one("nrrd", "v.nrrd", _NRRD.format("ascii") + "\n" + "9" * 2_000_000)


def _nifti() -> Iterator[Seed]:
    import nibabel

    plain = written("v.nii", lambda path: nibabel.save(nibabel.Nifti1Image(VALUES.T, np.eye(4)), path))
    for at, form, numbers in (
        (40, "<8h", [(7, 9999, 9999, 9999, 9999, 1, 1, 1), (3, -1, 4, 3, 1, 1, 1, 1), (9, 5, 4, 3, 1, 1, 1, 1)]),
        (70, "<h", [(0,), (1,), (1536,), (2304,), (-1,)]),
        (108, "<f", [(1e30,), (-1.0,), (float("nan"),), (0.0,), (float("inf"),)]),
        (112, "<2f", [(float("nan"), 0), (1e38, 1e38), (0.0, float("inf")), (1e-45, 0)]),
        (348, "<2i", [(1, 2**31 - 1), (1, -8), (1, 0)]),  # begins extensions
    ):
        for each in numbers:
            some = struct.pack(form, *each)
            yield _one("nifti", "v.nii", plain[:at] + some + plain[at + len(some) :])
    yield _one("nifti", "v.nii.gz", gzip.compress(plain + bytes(64 << 20)))
    yield _one("nifti", "v.nii.gz", gzip.compress(gzip.compress(plain)))


def _metaimage() -> Iterator[Seed]:
    head = "ObjectType = Image\nNDims = {}\nBinaryData = True\nCompressedData = {}\nElementSpacing = 2 3 4\n"
    head += "DimSize = {}\nElementType = MET_SHORT\n{}ElementDataFile = {}\n"
    samples = VALUES.tobytes()
    for number in _HUGE:
        yield _one("metaimage", "v.mha", head.format(3, False, f"5 4 {number}", "", "LOCAL").encode() + samples)
        yield _one("metaimage", "v.mha", head.format(number, False, "5 4 3", "", "LOCAL").encode() + samples)
        told = f"CompressedDataSize = {number}\n"
        yield _one("metaimage", "v.mha", head.format(3, True, "5 4 3", told, "LOCAL").encode() + zlib.compress(samples))
        skip = f"HeaderSize = {number}\n"
        files = {"v.mhd": head.format(3, False, "5 4 3", skip, "d.raw").encode(), "d.raw": samples}
        yield Seed("metaimage", files, "v.mhd")
    for data in (
        "f%099999d.raw 0 2 1",
        "f%d.raw 0 99999999999 1",
        "LIST",
        "LIST 2\n" + "v.mhd\n" * 9999,
        "/dev/zero",
        "v.mhd",
    ):
        yield _one("metaimage", "v.mhd", head.format(3, False, "5 4 3", "", data))


def _tiff() -> Iterator[Seed]:
    import tifffile

    for sizes in ('SizeZ="100000000"', 'SizeZ="3" SizeT="100000000"', 'SizeC="2000000000" SizeZ="3"', 'SizeZ="-3"'):
        told = (
            '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
        )
        told += f'<Pixels DimensionOrder="XYZCT" ID="Pixels:0" Type="int16" SizeX="5" SizeY="4" {sizes} '
        told += 'PhysicalSizeZ="2"><TiffData/></Pixels></Image></OME>'
        content = written(
            "v.ome.tif", lambda path, t=told: tifffile.imwrite(path, VALUES, description=t, metadata=None)
        )
        yield _one("tiff", "v.ome.tif", content)
    entities = "".join(f'<!ENTITY e{n + 1} "{f"&e{n};" * 10}">' for n in range(9))
    bomb = f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY e0 "aaaaaaaaaa">{entities}]><OME>&e9;</OME>'
    content = written("v.ome.tif", lambda path: tifffile.imwrite(path, VALUES, description=bomb, metadata=None))
    yield _one("tiff", "v.ome.tif", content)
    for text in ("images=100000000\nslices=100000000\nhyperstack=true\n", "images=3\nspacing=nan\nslices=-3\n"):
        told = f"ImageJ=1.11a\n{text}"
        content = written("v.tif", lambda path, t=told: tifffile.imwrite(path, VALUES, description=t, metadata=None))
        yield _one("tiff", "v.tif", content)
    directory = struct.pack("<2sHI", b"II", 42, 8) + struct.pack("<H", 0) + struct.pack("<I", 8)
    yield _one("tiff", "v.tif", directory)  # a directory that follows itself


def _npy() -> Iterator[Seed]:
    for told in (
        "{'descr': '<i2', 'fortran_order': False, 'shape': (1000000000, 1000000000, 1000000000), }",
        "{'descr': '<i2', 'fortran_order': False, 'shape': (%s3, 4, 5), }" % ("1, " * 5000),
        "{'descr': '|O', 'fortran_order': False, 'shape': (3, 4, 5), }",
        "{'descr': '<i2', 'fortran_order': False, 'shape': (-3, 4, 5), }",
        "[" * 5000,
        "-" * 20_000 + "1",
        "1" + "+1" * 20_000,
    ):
        header = told.encode() + b"\n"
        yield _one(
            "npy", "v.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", min(len(header), 65535)) + header + bytes(120)
        )


_MESH = (("UnstructuredGrid", "vtu"),)


def _vtk() -> Iterator[Seed]:
    head = '<?xml version="1.0"?><VTKFile type="ImageData" byte_order="LittleEndian" header_type="UInt64">'
    extents = ("0 1000000000 0 1000000000 0 1000000000", "0 4 0 3 0 -1", "0 4 0 3", "a", "0 4 0 3 0 1e9", "5 0 0 3 0 2")
    for extent in extents:
        told = f'{head}<ImageData WholeExtent="{extent}" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="{extent}">'
        told += '<PointData Scalars="a"><DataArray type="Int16" Name="a" format="ascii">1 2 3</DataArray></PointData>'
        yield _one("vti", "v.vti", told + "</Piece></ImageData></VTKFile>")
    entities = "".join(f'<!ENTITY e{n + 1} "{f"&e{n};" * 10}">' for n in range(9))
    bomb = f'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY e0 "aaaaaaaaaa">{entities}]>'
    for kind, name in (("ImageData", "vti"), ("RectilinearGrid", "vtr"), ("StructuredGrid", "vts"), *_MESH):
        yield _one(name, f"v.{name}", f'{bomb}<VTKFile type="{kind}">&e9;</VTKFile>')
        yield _one(name, f"v.{name}", f'<VTKFile type="{kind}">' + "<a>" * _DEEP)
        yield _one(name, f"v.{name}", f'<VTKFile type="{kind}" ' + " ".join(f'a{n}="1"' for n in range(50_000)) + "/>")


def _unstructured() -> Iterator[Seed]:
    for number in _HUGE:
        for points, cells in ((number, 1), (4, number)):
            told = '<VTKFile type="UnstructuredGrid"><UnstructuredGrid>'
            told += f'<Piece NumberOfPoints="{points}" NumberOfCells="{cells}"><Points><DataArray type="Float32" '
            told += 'NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>'
            for name, numbers in (("connectivity", "0 1 2 3"), ("offsets", cells), ("types", 10)):
                told += f'<DataArray type="Int64" Name="{name}" format="ascii">{numbers}</DataArray>'
            told += '</Cells><PointData><DataArray type="Int8" Name="a" format="ascii">1 2 3 4</DataArray></PointData>'
            yield _one("vtu", "v.vtu", told + "</Piece></UnstructuredGrid></VTKFile>")
        legacy = f"# vtk DataFile Version 3.0\nv\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {number} float\n0 0 0\n"
        yield _one("vtk", "v.vtk", legacy)
        yield _one("vtk", "v.vtk", legacy.replace("ASCII", "BINARY"))
        yield _one("vtk", "v.vtk", legacy.replace(str(number), "1") + f"CELLS {number} {number}\n4 0 0 0 0\n")
        for form in ("4.1 0 8", "2.2 0 8", "4.1 1 8"):
            text = f"$MeshFormat\n{form}\n$EndMeshFormat\n$Nodes\n{number} {number} 1 {number}\n3 1 0 {number}\n"
            yield _one("gmsh", "v.msh", text)
        item = f'<DataItem Dimensions="{number} 3" Format="XML">0 0 0</DataItem>'
        geometry = f'<Geometry GeometryType="XYZ">{item}</Geometry>'
        yield _one("xdmf", "v.xdmf", f'<Xdmf Version="3.0"><Domain><Grid Name="g">{geometry}</Grid></Domain></Xdmf>')


def _netcdf() -> Iterator[Seed]:
    for magic in (b"CDF\x01", b"CDF\x02", b"CDF\x05"):
        for number in (2**31 - 1, 2**32 - 1, 1000):
            wide = struct.pack(">Q" if magic == b"CDF\x05" else ">I", number)
            yield _one("netcdf3", "v.nc", magic + wide + struct.pack(">I", 10) + wide + bytes(200))
            yield _one("netcdf3", "v.nc", magic + bytes(4) + struct.pack(">I", 10) + wide + wide + b"abcd" * 50)
    yield _one("netcdf4", "v.nc", b"\x89HDF\r\n\x1a\n" + bytes(2000))
    yield _one("netcdf4", "v.nc", b"\x89HDF\r\n\x1a\n" + b"\xff" * 2000)


def _dicom() -> Iterator[Seed]:
    from support.fuzzing.seeds_dicom import file_of, slice_of

    pixel = np.zeros((1, 1), "u1")
    for count in (200_000, 2**31 - 1):
        many = slice_of(0, pixel, NumberOfFrames=count)
        many.PixelData = bytes(min(count, 200_000))
        yield _one("dicom", "v.dcm", file_of(many))
    for field, number in (("Rows", 65535), ("Columns", 65535), ("BitsStored", 99), ("RescaleSlope", "1e400")):
        changed = slice_of(0, pixel)
        setattr(changed, field, number)
        yield _one("dicom", "v.dcm", file_of(changed))
    deep = b"\x08\x00\x40\x11SQ\x00\x00\xff\xff\xff\xff\xfe\xff\x00\xe0\xff\xff\xff\xff" * 5000
    sound = file_of(slice_of(0, pixel))
    yield _one("dicom", "v.dcm", sound[:132] + deep)
    at = sound.index(b"\x08\x00")
    yield _one("dicom", "v.dcm", sound[:at] + deep + sound[at:])


def _pictures() -> Iterator[Seed]:
    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    magic, end = b"\x89PNG\r\n\x1a\n", chunk(b"IEND", b"")
    for width, height in ((2**31 - 1, 2**31 - 1), (100_000, 100_000), (16_000, 16_000), (1, 2**31 - 1), (0, 5)):
        head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        yield _one("picture-png", "p.png", magic + head + chunk(b"IDAT", zlib.compress(b"")) + end, "picture")
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 2, 0, 0, 0))
    pixel = chunk(b"IDAT", zlib.compress(bytes(4)))
    bomb = chunk(b"zTXt", b"texvol:scene\0\0" + zlib.compress(b"[" * (64 << 20)))
    yield _one("picture-png", "p.png", magic + head + bomb + pixel + end, "picture")
    for text in ("[" * _DEEP, '{"format": ' + "9" * 5000 + "}", '{"volume": "\\u0000"}', "\x1b[31m"):
        told = chunk(b"tEXt", b"texvol:scene\0" + text.encode())
        yield _one("picture-png", "p.png", magic + head + told + pixel + end, "picture")
    sizes = struct.pack(">BHHBBBBBBBBBB", 8, 65535, 65535, 3, 1, 17, 0, 2, 17, 0, 3, 17, 0)
    yield _one("picture-jpg", "p.jpg", b"\xff\xd8\xff\xc0\x00\x11" + sizes + b"\xff\xd9", "picture")


def _meshes() -> Iterator[Seed]:
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    for face in (
        "0 1 2",
        "0/0/0 1/1/1 2/2/2",
        "1 2",
        "1",
        "1 2 4",
        "-4 -1 -2",
        "99999999999999999999 1 2",
        "1 2 3.5",
        "a b c",
    ):
        yield _one("mesh", "m.obj", f"{corners}f {face}\n", "mesh")
    yield _one("mesh", "m.obj", b"v \xff 0 0\n" + corners.encode() + b"f 1 2 3\n", "mesh")
    yield _one("mesh", "m.obj", corners.encode() + b"f 1 2 3\n# caf\xe9\n", "mesh")
    yield _one("mesh", "m.stl", b"solid caf\xe9\nfacet normal 0 0 1\nouter loop\nvertex 0 0 \xff\n", "mesh")
    head = "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
    body = "0 0 0\n1 0 0\n0 1 0\n"
    for faces in ("4 0 1 2\n", "3 0 1\n", "3 0 1 2 1\n", "2 0 1\n", "0\n", "-3 0 1 2\n", "255 0 1 2\n", "3 0 1 1e9\n"):
        yield _one("mesh", "m.ply", head.format(3, 1) + body + faces, "mesh")
        yield _one("mesh", "m.ply", head.format(3, 2) + body + "3 0 1 2\n" + faces, "mesh")
    for number in _HUGE:
        yield _one("mesh", "m.ply", head.format(number, 1) + body + "3 0 1 2\n", "mesh")
        yield _one("mesh", "m.ply", head.format(3, number).replace("ascii", "binary_little_endian") + body, "mesh")
    yield _one("mesh", "m.stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50), "mesh")
    head = '<?xml version="1.0"?><VTKFile type="PolyData"><PolyData><Piece NumberOfPoints="{0}" NumberOfPolys="{0}">'
    for number in _HUGE:
        yield _one("mesh", "m.vtp", head.format(number) + "</Piece></PolyData></VTKFile>", "mesh")


_TEXTS = (
    "[" * _DEEP,
    '{"a":' * _DEEP,
    "9" * 5000,
    "1" * 5000 + "e9",
    '"\\ud800"',
    '"\0"',
    "\ufeff{}",
    "NaN",
    "null",
    "",
)


def _json() -> Iterator[Seed]:
    points = '{"points": [{"value": 0, "color": [0, 0, 0], "extinction": %s}]}'
    for text in _TEXTS:
        for whole in (text, points % text, points.replace("points", f"p{text}"), f'{{"materials": [{text}]}}'):
            yield _one("transfer", "t.json", whole.encode("utf-8", "surrogatepass"), "transfer")
        yield _one("header", "h.json", text.encode("utf-8", "surrogatepass"), "header")
        yield _one("header", "h.json", f'{{"volume": "v.npy", "dimensions": {text}, "spacing": [1, 2, 3]}}', "header")
        step = json.dumps({"t": 0, "kind": "move"})[:-1] + f', "x": {text}}}'
        yield _one("script", "w.txt", step, "script")
        yield _one("recent", "recent.json", f"[{text}]", "recent")
        yield _one("recent", "recent.json", f'[{{"path": "v.npy", "spacing": {text}}}]', "recent")
    yield _one("transfer", "t.json", '{"points": [' + ",".join(['{"value": 0}'] * 50_000) + "]}", "transfer")


def _toml() -> Iterator[Seed]:
    values = (
        "[" * _DEEP,
        "{a=" * _DEEP,
        "9" * 5000,
        "0x" + "f" * 5000,
        "1e9999",
        "nan",
        '"a\\u0000b"',
        "1979-05-27",
        "[[]]",
    )
    values += ('"/dev/zero"', '"."', '""', '"\\u001b[31m"', "-9223372036854775809", "0o7" + "7" * 5000, "[1, [2, [3]]]")
    keys = (
        "volume",
        "tf",
        "eye",
        "size",
        "light",
        "mask",
        "transform",
        "add",
        "mesh",
        "clip",
        "crop",
        "isovalue",
        "title",
    )
    files = {"v.npy": written("v.npy", lambda path: np.save(path, VALUES))}
    for value in values:
        yield _one("limits", "l.toml", f"max-abs = {value}\n", "limits")
        yield _one("limits", "l.toml", f"base = {value}\n", "limits")
        for key in keys:
            told = "" if key == "volume" else 'volume = "v.npy"\n'
            yield Seed("scene", {"s.toml": f"{told}{key} = {value}\n".encode(), **files}, "s.toml", "scene")
    for text in (
        "a." * 50_000 + "a = 1\n",
        "[a" + ".a" * 50_000 + "]\n",
        "[[add]]\n" * 50_000,
        "a = 1\n" * 2,
        "\0",
        "'" * 99,
    ):
        yield _one("limits", "l.toml", text, "limits")
        yield Seed("scene", {"s.toml": text.encode(), **files}, "s.toml", "scene")


def _others() -> Iterator[Seed]:
    for text in (
        "1e309 " * 12,
        "nan " * 16,
        "1 " * 5_000_000,
        "9" * 5000 + " 0 0 0\n" * 3,
        "\0" * 99,
        "1_0 0 0 0\n" * 3,
    ):
        yield _one("transform", "t.txt", text, "transform")
    head = bytearray(1024)
    for number in (2**31 - 1, -1, 0, 70_000):
        struct.pack_into("<4i", head, 0, number, number, number, 2)
        head[208:212] = b"MAP "
        yield _one("mrc", "v.mrc", bytes(head) + bytes(120))
