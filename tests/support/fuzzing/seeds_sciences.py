"""Sound files of brains, segmentations, the sky, the earth and microscopes, and other programs' transfer functions."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from support.fuzzing.seeds import STEPS, TURN, VALUES, Seed, of, written
from support.nd2_files import Told, nd2

_IDENTIFIER = re.compile(rb"<RetilingId>[0-9a-f-]{36}")
_HEAD = (VALUES > 20).astype("u1")


def seeds() -> Iterator[Seed]:
    """All of them."""
    yield from _brains()
    yield from _minc()
    yield from _segments()
    yield from _fits()
    yield from _segy()
    yield Seed("lif", {"v.lif": _lif()}, "v.lif")
    for packed in (False, True):
        told = Told(names=["own"], packed=packed)
        yield Seed("nd2", {"v.nd2": nd2(VALUES.astype("u2")[np.newaxis, np.newaxis, :, np.newaxis], told)}, "v.nd2")
    yield _czi()
    yield from _transfers()


def _brains() -> Iterator[Seed]:
    import nibabel
    import SimpleITK

    for ending in ("gipl", "gipl.gz"):
        image = SimpleITK.GetImageFromArray(VALUES)
        yield of("gipl", f"v.{ending}", lambda path, image=image: SimpleITK.WriteImage(image, str(path)))
    for ending in ("mgh", "mgz"):
        yield of("mgh", f"v.{ending}", lambda path: nibabel.save(nibabel.MGHImage(VALUES.T, np.eye(4)), path))
    header = nibabel.Spm2AnalyzeHeader()
    header.set_data_dtype(np.int16)
    header.set_data_shape(VALUES.shape[::-1])
    header["pixdim"][1:4] = [1, 2, 3]
    yield Seed("analyze", {"v.hdr": header.binaryblock, "v.img": VALUES.tobytes()}, "v.hdr")
    for count in (1, 2):
        samples = (VALUES if count == 1 else STEPS).tobytes()
        files = {"v+orig.HEAD": _afni(count).encode(), "v+orig.BRIK": samples}
        yield Seed("afni", files, "v+orig.HEAD", "volume" if count == 1 else "series", text=True)


def _afni(count: int) -> str:
    numbers = {
        "DATASET_RANK": f"3 {count} 0 0 0 0 0 0",
        "DATASET_DIMENSIONS": "5 4 3 0 0",
        "SCENE_DATA": "0 11 1 -999 -999 -999 -999 -999",
        "ORIENT_SPECIFIC": "1 2 5",
        "BRICK_TYPES": " ".join("1" * count),
    }
    if count > 1:
        numbers["TAXIS_NUMS"] = "2 0 77002"
    floats = {"ORIGIN": "10 -20 30.5", "DELTA": "-2 3 -4", "IJK_TO_DICOM_REAL": "-2 0 0 10 0 3 0 -20 0 0 -4 30.5"}
    floats |= {"BRICK_FLOAT_FACS": " ".join(["0.5"] * count), "TAXIS_FLOATS": "0 2.5 0 0 0"}
    parts = [("integer", name, text) for name, text in numbers.items()]
    parts += [("float", name, text) for name, text in floats.items()]
    text = "".join(
        f"\ntype  = {kind}-attribute\nname  = {name}\ncount = {len(value.split())}\n {value}\n"
        for kind, name, value in parts
    )
    for name, value in (("TYPESTRING", "3DIM_HEAD_ANAT"), ("BYTEORDER_STRING", "LSB_FIRST"), ("BRICK_LABS", "one~two")):
        text += f"\ntype  = string-attribute\nname  = {name}\ncount = {len(value) + 1}\n'{value}~\n"
    return text


def _minc() -> Iterator[Seed]:
    import h5py
    import netCDF4

    names = ("zspace", "yspace", "xspace")

    def one(path: Path) -> None:
        with netCDF4.Dataset(path, "w", format="NETCDF3_CLASSIC") as file:
            for axis, (name, size) in enumerate(zip(names, VALUES.shape, strict=True)):
                file.createDimension(name, size)
                variable = file.createVariable(name, "i4")
                variable.spacing, variable.step, variable.start = "regular__", 1.5 + axis, float(axis)
                variable.direction_cosines = TURN[:, axis]
            image = file.createVariable("image", "i2", names)
            image.signtype, image.valid_range = "signed__", np.array([0.0, 60.0])
            image[:] = VALUES
            for name, value in (("image-max", 50.0), ("image-min", 0.0)):
                file.createVariable(name, "f8", names[:1])[:] = value

    def two(path: Path) -> None:
        with h5py.File(path, "w", track_order=False) as file:
            for name, size in zip(names, VALUES.shape, strict=True):
                scale = file.create_dataset(f"minc-2.0/dimensions/{name}", data=np.int32(0))
                scale.attrs["spacing"], scale.attrs["step"] = np.bytes_("regular__"), 2.0
                scale.attrs["start"], scale.attrs["length"] = 7.0, np.int32(size)
            image = file.create_dataset("minc-2.0/image/0/image", data=VALUES, chunks=(1, 4, 5), compression=4)
            image.attrs["dimorder"], image.attrs["valid_range"] = np.bytes_(",".join(names)), np.array([0.0, 60.0])
            for name, value in (("image-max", 60.0), ("image-min", 0.0)):
                file.create_dataset(f"minc-2.0/image/0/{name}", data=value)

    yield of("minc", "v.mnc", one)
    yield of("minc", "h.mnc", two)


def _segments() -> Iterator[Seed]:
    import nrrd

    header = {
        "space": "left-posterior-superior",
        "space origin": [1, 2, 3],
        "kinds": ["list", "domain", "domain", "domain"],
    }
    header |= {"space directions": np.vstack([np.full(3, np.nan), TURN * [2, 3, 4]]), "encoding": "raw"}
    for number, name in enumerate(("Head", "Mass")):
        header |= {f"Segment{number}_LabelValue": "1", f"Segment{number}_Layer": str(number)}
        header |= {f"Segment{number}_Name": name, f"Segment{number}_Color": "0.5 0.25 1"}
    layers = np.stack([_HEAD, 1 - _HEAD]).T
    yield of("segments", "v.seg.nrrd", lambda path: nrrd.write(str(path), np.moveaxis(layers, 3, 0), header))
    table = "index\tname\tcolor\n1\tGray Matter\t#ff0000\n17\tOther\tn/a\n"
    yield Seed("segments", {"dseg.tsv": table.encode()}, "dseg.tsv", "segments", text=True)


def _fits() -> Iterator[Seed]:
    from astropy.io import fits

    header = fits.Header({"CTYPE1": "RA---TAN", "CTYPE2": "DEC--TAN", "CTYPE3": "VRAD", "CUNIT1": "deg", "BUNIT": "Jy"})
    for axis in (1, 2, 3):
        header[f"CRPIX{axis}"], header[f"CRVAL{axis}"], header[f"CDELT{axis}"] = 2.0, 10.0 * axis, 0.5
    yield of("fits", "v.fits", lambda path: fits.PrimaryHDU(VALUES, header).writeto(path))
    packed = [fits.PrimaryHDU(), fits.CompImageHDU(VALUES, header, name="SCI")]
    yield of("fits", "v.fits.fz", lambda path: fits.HDUList(packed).writeto(path))


def _segy() -> Iterator[Seed]:
    import segyio

    def write(path: Path) -> None:
        spec = segyio.spec()
        spec.sorting, spec.format, spec.samples = 2, 1, np.arange(3) * 4.0
        spec.ilines, spec.xlines = np.arange(4) + 1, np.arange(5) + 10
        with segyio.create(str(path), spec) as file:
            for number in range(20):
                inline, crossline = divmod(number, 5)
                fields = {segyio.su.iline: inline + 1, segyio.su.xline: crossline + 10, 71: -10}
                file.header[number] = fields | {181: 200 * crossline, 185: 300 * inline}
                file.trace[number] = VALUES[:, inline, crossline].astype("f4")
            file.bin.update(hdt=4000, hns=3)

    yield of("seg-y", "v.sgy", write)


def _lif() -> bytes:
    dimensions = "".join(
        f'<DimensionDescription DimID="{number}" NumberOfElements="{size}" Origin="0" Length="{1e-6 * size}" Unit="m" '
        f'BytesInc="{inc}" BitInc="0"/>'
        for number, size, inc in ((1, 5, 2), (2, 4, 10), (3, 3, 40))
    )
    text = (
        '<LMSDataContainerHeader Version="2"><Element Name="own"><Children><Element Name="Series001">'
        '<Memory Size="120" MemoryBlockID="MemBlock_1"/><Data><Image><ImageDescription><Channels>'
        '<ChannelDescription DataType="0" ChannelTag="0" Resolution="16" NameOfMeasuredQuantity="" Min="0" Max="1" '
        'Unit="" LUTName="Gray" IsLUTInverted="0" BytesInc="0" BitInc="0"/>'
        f"</Channels><Dimensions>{dimensions}</Dimensions></ImageDescription></Image></Data></Element>"
        "</Children></Element></LMSDataContainerHeader>"
    ).encode("utf-16-le")
    label = "MemBlock_1".encode("utf-16-le")
    head = struct.pack("<IIBI", 0x70, len(text) + 5, 0x2A, len(text) // 2) + text
    block = struct.pack("<IIBQBI", 0x70, 18 + len(label), 0x2A, 120, 0x2A, len(label) // 2) + label
    return head + block + VALUES.tobytes()


def _czi() -> Seed:
    from pylibCZIrw import czi

    def write(path: Path) -> None:
        with czi.create_czi(str(path)) as file:
            for number, plane in enumerate(VALUES.astype("u2")):
                file.write(np.ascontiguousarray(plane[..., np.newaxis]), plane={"T": 0, "C": 0, "Z": number}, scene=0)
            file.write_metadata("own", scale_x=2e-6, scale_y=3e-6, scale_z=4e-6)

    content = written("v.czi", write)
    # Its two identifiers, after a head of a segment and three numbers, are random, and one in the text of each plane.
    content = content[:48] + bytes(32) + content[80:]
    return Seed("czi", {"v.czi": _IDENTIFIER.sub(rb"<RetilingId>" + b"0" * 36, content)}, "v.czi")


def _transfers() -> Iterator[Seed]:
    colors, opacities = [0, 0, 0, 0, 60, 1, 0.5, 0], [0, 0, 0.5, 0, 40, 0.9, 0.3, 0.5, 60, 1, 0.5, 0]
    named = [{"Name": "own", "ColorSpace": "Diverging", "RGBPoints": colors, "Points": opacities, "HSVWrap": True}]
    points = [
        {"x": 0, "color": [0, 0, 0], "y": 0.1},
        {"x": 60, "color": [1, 0.5, 0], "y": 0.8, "midpoint": 0.3, "sharpness": 0.2},
    ]
    curve = {"points": points}
    component = {"rgbTransferFunction": curve, "scalarOpacity": curve, "scalarOpacityUnitDistance": 0.9, "shade": True}
    component |= {
        "lighting": {"ambient": 0.1, "diffuse": 0.9, "specular": 0.2, "specularPower": 10},
        "gradientOpacity": curve,
    }
    states = {
        "1": {"ClassName": "vtkVolumeProperty", "Id": 1, "ScalarOpacityUnitDistance": 2.5, "Shade": 1, "Ambient": 0.1,
              "Diffuse": 0.7, "Specular": 0.2, "SpecularPower": 10, "RGBTransferFunction": [{"Id": 2}],
              "ScalarOpacityFunction": [{"Id": 3}]},
        "2": {"ClassName": "vtkColorTransferFunction", "Id": 2, "Data": colors, "ColorSpace": 2},
        "3": {"ClassName": "vtkPiecewiseFunction", "Id": 3, "Data": [0, 0, 60, 0.7]},
    }  # fmt: skip
    for name, content in (
        ("m.json", named),
        ("v.vp.json", {"volumeProperties": [{"components": [component]}]}),
        ("s.json", states),
    ):
        yield Seed("foreign", {name: json.dumps(content).encode()}, name, "transfer", text=True)
    itf = '<?xml version="1.0" ?><InviwoWorkspace version="2"><maskMin content="0.1" /><maskMax content="1" /><Points>'
    itf += '<Point><pos content="0" /><rgba x="0" y="0" z="0" w="0.2" /></Point>'
    itf += '<Point><pos content="1" /><rgba x="1" y="1" z="1" w="0.9" /></Point></Points></InviwoWorkspace>'
    clut = "[FLT]\nmin=0\nmax=50\n[INT]\nnumnodes=2\n[BYT]\nnodeintensity0=0\nnodeintensity1=255\n[RGBA255]\n"
    clut += "nodergba0=0|0|0|0\nnodergba1=255|0|0|128\n"
    vp = "1\n1\n0.9\n0.1\n0.2\n10\n4 0 0 60 0.5\n4 0 0 255 1\n8 0 0 0 0 60 1 0.5 0\n"
    for name, text in (("t.itf", itf), ("t.clut", clut), ("t.vp", vp), ("t.1dt", "0 0 0 0\n1 1 1 0.5\n1 0 0 0.25\n")):
        yield Seed("foreign", {name: text.encode()}, name, "transfer", text=True)
