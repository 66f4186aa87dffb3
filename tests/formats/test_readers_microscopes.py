"""Microscopes' formats: CZI as Zeiss' library writes it, LIF made by hand, and what is asked of the library for ND2."""

from __future__ import annotations

import struct
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pylibCZIrw import czi
from support import marked

from texvol import InputError, load
from texvol.formats.readers import TimeSeries

# One channel and time step has the marked values, the others nothing.
CHANNELS, STEPS, CHANNEL, STEP = 2, 3, 1, 2


def planes(dtype: str = "u2") -> NDArray:
    """Values of shape (T, C, Z, Y, X)."""
    values = np.zeros((STEPS, CHANNELS, *marked.marked().shape), dtype)
    values[STEP, CHANNEL] = marked.marked(dtype)
    return values


def check(path: Path, dtype: str = "uint16", *, channels: int = CHANNELS) -> Any:
    volume = load(path, channel=CHANNEL, time=STEP)
    np.testing.assert_array_equal(volume.values, marked.marked(dtype))
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_allclose(volume.spacing, marked.SPACING, rtol=1e-6)
    assert volume.unit == "µm" and not volume.origin.any()
    assert load(path, channel=0, time=STEP).values.max() == 0
    assert load(path, channel=CHANNEL, time=0).values.max() == 0
    assert len(TimeSeries(path, channel=CHANNEL)) == STEPS
    with pytest.raises(InputError, match=rf"--channel 0\.\.{channels - 1}|--time 0\.\.{STEPS - 1}"):
        load(path)
    return volume


def written_czi(path: Path, dtype: str = "u2", scenes: int = 1) -> Path:
    with czi.create_czi(str(path)) as file:
        for t, c, z in np.ndindex(planes().shape[:3]):
            for scene in range(scenes):
                plane = planes(dtype)[t, c, z] * (1 if scene == 0 else 0)
                place = {"T": t, "C": c, "Z": z}
                file.write(
                    np.ascontiguousarray(plane[..., np.newaxis]), plane=place, scene=scene, location=(scene * 9, 0)
                )
        names = {0: "DAPI", 1: "GFP"}
        file.write_metadata("own", channel_names=names, scale_x=2e-6, scale_y=3e-6, scale_z=4e-6)
    return path


@pytest.mark.parametrize(("dtype", "name"), [("u1", "uint8"), ("u2", "uint16"), ("f4", "float32")])
def test_czi(tmp_path: Path, dtype: str, name: str) -> None:
    check(written_czi(tmp_path / "v.czi", dtype), name)


def test_scenes_of_czi(tmp_path: Path) -> None:
    path = written_czi(tmp_path / "v.czi", scenes=2)
    with pytest.raises(InputError, match="has 2 images: 0 scene 0, 1 scene 1; --image N or NAME chooses one"):
        load(path, channel=1, time=2)
    assert load(path, image=0, channel=1, time=2).values.max() == marked.MARK_VALUE
    assert load(path, image="scene 1", channel=1, time=2).values.max() == 0
    with pytest.raises(InputError, match=r"has no image 2 \(--image\)"):
        load(path, image=2, channel=1, time=2)


def lif(dtype: str = "u2", name: str = "Series001", **changed: str) -> bytes:
    """A file of one image: an XML text in UTF-16, then a block of samples, each behind marks."""
    values = planes(dtype)
    bits, size = values.dtype.itemsize * 8, values.dtype.itemsize
    sizes = {"X": 5, "Y": 4, "Z": 3, "T": STEPS}
    # Bytes from a sample to the next one: channels are within a slice.
    inc = {"X": size, "Y": 5 * size, "Z": 20 * size * CHANNELS, "T": 60 * size * CHANNELS}
    length = {"X": 2e-6 * 4, "Y": 3e-6 * 3, "Z": 4e-6 * 2, "T": 5.0}
    dimensions = "".join(
        f'<DimensionDescription DimID="{number}" NumberOfElements="{changed.get(axis, sizes[axis])}" '
        f'Length="{length[axis]}" BytesInc="{inc[axis]}"/>'
        for number, axis in enumerate("XYZT", 1)
    )
    channels = "".join(
        f'<ChannelDescription Resolution="{changed.get("bits", bits)}" BytesInc="{20 * size * number}"/>'
        for number in range(CHANNELS)
    )
    text = (
        '<LMSDataContainerHeader Version="2"><Element Name="own"><Children>'
        f'<Element Name="{name}"><Memory Size="{values.nbytes}"/><Data><Image><ImageDescription>'
        f"<Channels>{channels}</Channels>"
        f"<Dimensions>{dimensions}</Dimensions></ImageDescription></Image></Data></Element>"
        "</Children></Element></LMSDataContainerHeader>"
    ).encode("utf-16")
    samples = np.ascontiguousarray(values.transpose(0, 2, 1, 3, 4)).tobytes()  # T, Z, C, Y, X
    head = struct.pack("<IIBI", 0x70, len(text) + 5, 0x2A, len(text) // 2) + text
    label = "MemBlock_1".encode("utf-16-le")
    block = struct.pack("<IIBIBI", 0x70, 14 + len(label), 0x2A, len(samples), 0x2A, len(label) // 2) + label
    return head + block + samples


@pytest.mark.parametrize(("dtype", "name"), [("u1", "uint8"), ("u2", "uint16")])
def test_lif(tmp_path: Path, dtype: str, name: str) -> None:
    (tmp_path / "v.lif").write_bytes(lif(dtype))
    volume = check(tmp_path / "v.lif", name)
    assert "image Series001" in volume.notes


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (lif()[:-100], "truncated"),
        (lif()[:900], "."),
        (lif(X="100000000"), "more than 10000 times|this machine has|pixels"),
        (lif(Z="0"), "positive"),
        (lif(bits="32"), "up to 16 bits, got 32"),
        (b"\x70\0\0\0" + bytes(50), "."),
    ],
)
def test_a_lif_that_makes_no_sense(tmp_path: Path, content: bytes, reason: str) -> None:
    (tmp_path / "v.lif").write_bytes(content)
    with pytest.raises(InputError, match=rf"v\.lif: .*({reason})"):
        load(tmp_path / "v.lif", channel=CHANNEL, time=STEP)


class StandIn:
    """Stand-in for a file of the library nd2: two positions, with all channels in each frame."""

    def __init__(self, path: str) -> None:
        self.sizes = {"T": STEPS, "P": 2, "Z": 3, "C": CHANNELS, "Y": 4, "X": 5}
        self.dtype = np.dtype("u2")
        self.loop_indices = [{"T": t, "P": p, "Z": z} for t, p, z in np.ndindex(STEPS, 2, 3)]
        channels = [SimpleNamespace(name=name, color=SimpleNamespace(r=255, g=0, b=0)) for name in ("DAPI", "GFP")]
        self.metadata = SimpleNamespace(channels=[SimpleNamespace(channel=each) for each in channels])

    def __enter__(self) -> StandIn:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def read_frame(self, number: int) -> NDArray:
        place = self.loop_indices[number]
        return planes()[place["T"], :, place["Z"]] * (1 if place["P"] == 1 else 0)

    def voxel_size(self) -> tuple[float, ...]:
        return marked.SPACING


def test_nd2_by_what_its_library_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No program here writes the format; the library has tests of its own against Nikon's files."""
    module = ModuleType("nd2")
    module.ND2File = StandIn  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "nd2", module)
    path = tmp_path / "v.nd2"
    path.write_bytes(b"\xda\xce\xbe\x0a" + bytes(99))
    with pytest.raises(InputError, match="has 2 images: 0 position 0, 1 position 1"):
        load(path, channel=1, time=2)
    volume = load(path, image=1, channel=CHANNEL, time=STEP)
    np.testing.assert_array_equal(volume.values, marked.marked("u2"))
    np.testing.assert_allclose(volume.spacing, marked.SPACING)
    assert load(path, image=0, channel=CHANNEL, time=STEP).values.max() == 0


def test_an_nd2_or_czi_that_makes_no_sense(tmp_path: Path) -> None:
    for name, magic in (("v.nd2", b"\xda\xce\xbe\x0a"), ("v.czi", b"ZISRAWFILE")):
        (tmp_path / name).write_bytes(magic + bytes(99))
        with pytest.raises(InputError, match=rf"{name}: "):
            load(tmp_path / name)
    content = written_czi(tmp_path / "t.czi").read_bytes()
    (tmp_path / "t.czi").write_bytes(content[:1000])
    with pytest.raises(InputError, match=r"t\.czi: "):
        load(tmp_path / "t.czi", channel=0, time=0)
