"""ND2 files as Nikon's NIS-Elements lays them out, version 3: chunks, and a map of them at the end.

A chunk is a mark, the lengths of its name and of its data, and both; the room for names is such that pixels begin
4096 bytes after the chunk. Descriptions are trees of named values, whose types a byte tells. A frame has the pixels of
all channels, in rows that are multiples of four bytes, behind the time of the frame.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

MARK = 0x0ABECEDA
_ALIGNMENT, _ROOM = 4096, 4072
_MAP, _MAP_END = b"ND2 FILEMAP SIGNATURE NAME 0001!", b"ND2 CHUNK MAP SIGNATURE 0000001!"
_TIME, _POSITION, _STACK, _CUSTOM = 1, 2, 4, 7  # kinds of loops


class Told(NamedTuple):
    """Metadata that a file is written with; steps are micrometres along x, y and z."""

    steps: tuple[float, float, float] = (2.0, 2.0, 4.0)
    calibrated: bool = True
    names: Sequence[str] = ("DAPI", "GFP")
    colors: Sequence[int] = (0xFF8000, 0x00FF00)  # blue, green, red, from the highest byte
    downwards: bool = False  # frames of a stack are taken from its top to its bottom
    packed: bool = False  # by zlib
    rgb: bool = False  # the channels are the colours of one camera
    missing: Sequence[int] = ()  # numbers of frames that are not in the file
    custom_loop: bool = False  # the first axis is a loop of the user's own


def nd2(values: NDArray, told: Told | None = None) -> bytes:
    """Return a file of values of shape (T, P, Z, C, Y, X): time steps, positions, slices, channels."""
    told = told or Told()
    *loops, channels, _, _ = values.shape
    frames = values.reshape(-1, *values.shape[-3:])
    chunks = {
        "ImageAttributesLV!": _tree(SLxImageAttributes=_attributes(frames, told)),
        "ImageMetadataSeqLV|0!": _tree(SLxPictureMetadata=_picture(channels, told)),
        "ImageMetadataLV!": _tree(SLxExperiment=_experiment(loops, told)),
        "ImageTextInfoLV!": _tree(SLxImageTextInfo={"TextInfoItem_13": "Plan Apo 60x"}),
        "ImageCalibrationLV|0!": _tree(SLxCalibration={"bValid": told.calibrated, "dCalibration": told.steps[0]}),
        "CustomData|AcqTimesCache!": np.arange(len(frames), dtype="f8").tobytes(),
    }
    for number, frame in enumerate(frames):
        if number not in told.missing:
            pixels = _rows(frame)
            content = zlib.compress(pixels) if told.packed else pixels
            chunks[f"ImageDataSeq|{number}!"] = struct.pack("<d", number) + content
    return _laid_out(chunks)


def _laid_out(chunks: Mapping[str, bytes]) -> bytes:
    """Return chunks behind the file's signature, and the map of where they are."""
    content = _aligned(_chunk(b"ND2 FILE SIGNATURE CHUNK NAME01!", b"Ver3.0".ljust(64, b"\0")))
    places = b""
    for name, data in chunks.items():
        places += name.encode() + struct.pack("<QQ", len(content), len(data))
        content += _aligned(_chunk(name.encode().ljust(_ROOM, b"\0"), data))
    end = _MAP_END + struct.pack("<Q", len(content))
    return content + _chunk(_MAP, places + end)


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack("<IIQ", MARK, len(name), len(data)) + name + data


def _aligned(content: bytes) -> bytes:
    return content + bytes(-len(content) % _ALIGNMENT)


def _rows(frame: NDArray) -> bytes:
    """Return the pixels of a frame (C, Y, X), each with all channels."""
    rows = frame.transpose(1, 2, 0).reshape(frame.shape[1], -1)
    return b"".join(row.tobytes() + bytes(-row.nbytes % 4) for row in rows)


def _attributes(frames: NDArray, told: Told) -> dict[str, Any]:
    count, channels, height, width = frames.shape
    size = frames.dtype.itemsize
    return {
        "uiWidth": width,
        "uiWidthBytes": -(-width * channels * size // 4) * 4,
        "uiHeight": height,
        "uiComp": channels,
        "uiBpcInMemory": 8 * size,
        "uiBpcSignificant": 8 * size,
        "uiSequenceCount": count,
        "uiTileWidth": width,
        "uiTileHeight": height,
        "eCompression": 0 if told.packed else 2,
        "dCompressionParam": 0.0,
        "ePixelType": 1,
        "uiVirtualComponents": channels,
    }


def _picture(channels: int, told: Told) -> dict[str, Any]:
    planes = 1 if told.rgb else channels
    spectrum = {"uiCount": 0, "bPoints": False, "pPoint": {}}
    described = {
        f"a{number}": {
            "uiCompCount": channels // planes,
            "uiSampleIndex": 0,
            "uiModalityMask": 257,
            "sDescription": told.names[number],
            "uiColor": told.colors[number],
            "pFluorescentProbe": {"m_uiColor": 0, "m_ExcitationSpectrum": spectrum, "m_EmissionSpectrum": spectrum},
        }
        for number in range(planes)
    }
    return {
        "dTimeAbsolute": 2456827.0,
        "bCalibrated": told.calibrated,
        "dCalibration": told.steps[0],
        "dAspect": 1.0,
        "sPicturePlanes": {"uiCount": planes, "uiCompCount": channels, "uiSampleCount": 1, "sPlaneNew": described},
    }


def _experiment(loops: Sequence[int], told: Told) -> dict[str, Any]:
    """Return the loops of more than one step, each in the one before."""
    step = told.steps[2]
    points = [{"dPosX": 100.0 * number, "dPosY": 0.0, "dPosZ": 0.0} for number in range(loops[1])]
    stack = {"iType": 6 if told.downwards else 2, "dZStep": step, "bZInverted": False, "dZHome": 0.0, "dZLow": 0.0}
    described = (
        (_CUSTOM if told.custom_loop else _TIME, {"dStart": 0.0, "dPeriod": 5000.0, "dDuration": 0.0}),
        (_POSITION, {"bUseZ": False, "Points": points}),
        (_STACK, {**stack, "dZHigh": step * (loops[2] - 1), "wsZDevice": "Piezo"}),
    )
    inner: dict[str, Any] = {}
    for count, (kind, pars) in reversed(list(zip(loops, described, strict=True))):
        if count > 1:
            following = {"ppNextLevelEx": [inner]} if inner else {}
            inner = {"eType": kind, "uLoopPars": {"uiCount": count, **pars}, **following}
    return inner


def _tree(**levels: Any) -> bytes:
    return b"".join(_named(name, value) for name, value in levels.items())


def _named(name: str, value: Any) -> bytes:
    """Return one value of a tree behind its type and its name; a list is a level of nameless values."""
    label = (name + "\0").encode("utf-16-le")
    kind, content = _value(value)
    if kind == 11:  # of a level: how many values it has, how long it is, and after it where they begin
        items = [_named(*each) for each in content]
        length = 2 + len(label) + 12 + sum(map(len, items))
        head = struct.pack("<IQ", len(items), length)
        content = head + b"".join(items) + bytes(8 * len(items))
    return struct.pack("<BB", kind, len(label) // 2) + label + content


def _value(value: Any) -> tuple[int, Any]:
    """Return the type of a value of a tree and its bytes, or the named values of a level."""
    match value:
        case bool():
            return 1, struct.pack("<?", value)
        case int():
            return 3, struct.pack("<I", value)
        case float():
            return 6, struct.pack("<d", value)
        case str():
            return 8, (value + "\0").encode("utf-16-le")
        case dict():
            return 11, list(value.items())
        case list():
            return 11, [("", each) for each in value]
    raise TypeError(f"no value of a tree: {value!r}")
