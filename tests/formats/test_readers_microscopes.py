"""Microscopes' formats: CZI as Zeiss' library writes it, ND2 and LIF made by hand."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from pylibCZIrw import czi
from support import marked
from support.missing_library import check_asked_for
from support.nd2_files import Told, nd2

from texvol import InputError, load
from texvol.__main__ import main
from texvol.formats.readers import TimeSeries
from texvol.formats.readers.microscopy import chosen_image
from texvol.formats.readers.samples import Choice, FileFault
from texvol.util.color import linear_from_srgb

# One channel and time step has the marked values, the others nothing.
CHANNELS, STEPS, CHANNEL, STEP = 2, 3, 1, 2


def planes(dtype: str = "u2") -> NDArray:
    """Values of shape (T, C, Z, Y, X)."""
    values = np.zeros((STEPS, CHANNELS, *marked.marked().shape), dtype)
    values[STEP, CHANNEL] = marked.marked(dtype)
    return values


def check_samples(path: Path, dtype: str = "uint16", spacing: tuple[float, ...] = marked.SPACING) -> Any:
    """Compare the samples of a channel and time step with those of others."""
    volume = load(path, channel=CHANNEL, time=STEP)
    np.testing.assert_array_equal(volume.values, marked.marked(dtype))
    assert volume.values.dtype == np.dtype(dtype)
    np.testing.assert_allclose(volume.spacing, spacing, rtol=1e-6)
    assert volume.unit == "µm" and not volume.origin.any()
    assert load(path, channel=0, time=STEP).values.max() == 0
    assert load(path, channel=CHANNEL, time=0).values.max() == 0
    return volume


def check(
    path: Path, dtype: str = "uint16", *, channels: int = CHANNELS, spacing: tuple[float, ...] = marked.SPACING
) -> Any:
    volume = check_samples(path, dtype, spacing)
    assert len(TimeSeries(path, channel=CHANNEL)) == STEPS
    with pytest.raises(InputError, match=rf"--time 0\.\.{STEPS - 1}"):
        load(path)
    with pytest.raises(InputError, match=rf"--channel must be in 0\.\.{channels - 1}"):
        load(path, channel=channels, time=STEP)
    first = load(path, time=STEP)  # as of other images with channels
    assert first.channel == volume.channels[0] and len(volume.channels) == channels
    assert any(f"channel 0 {first.channel.name}".rstrip() in each for each in first.notes)
    return volume


def written_czi(path: Path, dtype: str = "u2", scenes: int = 1, missing: tuple[tuple[int, int, int], ...] = ()) -> Path:
    with czi.create_czi(str(path)) as file:
        for t, c, z in (each for each in np.ndindex(planes().shape[:3]) if each not in missing):
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


def test_slices_that_a_czi_lacks_are_told(tmp_path: Path) -> None:
    path = written_czi(tmp_path / "v.czi", missing=((2, 1, 1), *((1, 0, z) for z in range(planes().shape[2]))))
    lacking = load(path, channel=1, time=2)
    assert not lacking.values[1].any() and lacking.values[0].any()
    assert any("1 of 3 slices are not in the file and are 0: 1" in note for note in lacking.notes)
    assert not any("not in the file" in note for note in load(path, channel=0, time=2).notes)
    with pytest.raises(InputError, match="has no pixels of this scene, channel and time"):
        load(path, channel=0, time=1)


def test_of_images_with_one_name_a_number_chooses() -> None:
    choice = Choice(image="Series001")
    with pytest.raises(FileFault, match="has 2 images of the name Series001: --image N chooses one of 0, 2"):
        chosen_image(["Series001", "Series002", "Series001"], choice)
    assert chosen_image(["Series001", "Series002", "Series001"], choice._replace(image=2)) == 2


# Lengths are those from the first to the last sample, in metres.
LENGTHS = {"X": 2e-6 * 4, "Y": 3e-6 * 3, "Z": 4e-6 * 2, "T": 5.0}


def lif(dtype: str = "u2", name: str = "Series001", order: str = "TZCYX", **changed: str) -> bytes:
    """A file of one image: an XML text in UTF-16, then a block of samples, each behind marks.

    Its axes, slowest first, are in the `order`; other arguments replace attributes of the text.
    """
    values = np.ascontiguousarray(planes(dtype).transpose(["TCZYX".index(axis) for axis in order]))
    steps = dict(zip(order, values.strides, strict=True))
    dimensions = "".join(
        f'<DimensionDescription DimID="{"XYZT".index(axis) + 1}" Origin="0" Unit="m" BitInc="0" '
        f'NumberOfElements="{changed.get(axis, size)}" BytesInc="{steps[axis]}" '
        f'Length="{changed.get(f"length_{axis}", LENGTHS[axis])}"/>'
        for axis, size in zip(order[::-1], values.shape[::-1], strict=True)
        if axis != "C"
    )
    bits = changed.get("bits", values.dtype.itemsize * 8)
    channels = "".join(
        f'<ChannelDescription DataType="0" ChannelTag="0" Resolution="{bits}" NameOfMeasuredQuantity="" Min="0" '
        f'Max="1" Unit="" LUTName="{table}" IsLUTInverted="0" BytesInc="{steps["C"] * number}" BitInc="0"/>'
        for number, table in enumerate(("Green", "Sunset"))
    )
    text = (
        '<LMSDataContainerHeader Version="2"><Element Name="own"><Children>'
        f'<Element Name="{name}"><Memory Size="{values.nbytes}" MemoryBlockID="MemBlock_1"/><Data><Image>'
        f"<ImageDescription><Channels>{channels}</Channels><Dimensions>{dimensions}</Dimensions></ImageDescription>"
        "</Image></Data></Element></Children></Element></LMSDataContainerHeader>"
    ).encode("utf-16-le")
    label = "MemBlock_1".encode("utf-16-le")
    head = struct.pack("<IIBI", 0x70, len(text) + 5, 0x2A, len(text) // 2) + text
    block = struct.pack("<IIBQBI", 0x70, 18 + len(label), 0x2A, values.nbytes, 0x2A, len(label) // 2) + label
    return head + block + values.tobytes()


@pytest.mark.parametrize(("dtype", "name"), [("u1", "uint8"), ("u2", "uint16")])
def test_lif(tmp_path: Path, dtype: str, name: str) -> None:
    (tmp_path / "v.lif").write_bytes(lif(dtype))
    volume = check(tmp_path / "v.lif", name)
    assert "image Series001" in volume.notes
    assert [(each.name, each.color) for each in volume.channels] == [("Green", (0.0, 1.0, 0.0)), ("Sunset", None)]


@pytest.mark.parametrize("order", ["ZTCYX", "CTZYX", "TCZYX", "TZYCX", "TCYZX"])
def test_lif_of_other_orders_of_the_axes(tmp_path: Path, order: str) -> None:
    (tmp_path / "v.lif").write_bytes(lif(order=order))
    check_samples(tmp_path / "v.lif")


def test_lif_whose_slices_run_downwards(tmp_path: Path) -> None:
    (tmp_path / "v.lif").write_bytes(lif(length_Z=str(-LENGTHS["Z"])))
    volume = load(tmp_path / "v.lif", channel=CHANNEL, time=STEP)
    np.testing.assert_allclose(volume.world_from_index, np.diag([2.0, 3.0, -4.0]), rtol=1e-6)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (lif()[:-100], "truncated"),
        (lif()[:900], "."),
        (lif(T="100000000"), "more than 10000 times"),
        (lif(Z="0"), "positive"),
        (lif(bits="32"), "up to 16 bits or float32, got uint32"),
        (b"\x70\0\0\0" + bytes(50), "."),
    ],
)
def test_a_lif_that_makes_no_sense(tmp_path: Path, content: bytes, reason: str) -> None:
    (tmp_path / "v.lif").write_bytes(content)
    with pytest.raises(InputError, match=rf"v\.lif: .*({reason})"):
        load(tmp_path / "v.lif", channel=CHANNEL, time=STEP)


# As NIS-Elements, both lengths of a pixel are one number.
ND2_STEPS = (2.0, 2.0, 4.0)


def frames(dtype: str = "u2", positions: int = 1) -> NDArray:
    """Values of shape (T, P, Z, C, Y, X); those of the positions before the last are 0."""
    found = planes(dtype).transpose(0, 2, 1, 3, 4)[:, np.newaxis]
    return np.concatenate([0 * found] * (positions - 1) + [found], axis=1)


def written_nd2(path: Path, values: NDArray | None = None, **told: Any) -> Path:
    path.write_bytes(nd2(frames() if values is None else values, Told(**told)))
    return path


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(("dtype", "name"), [("u1", "uint8"), ("u2", "uint16"), ("f4", "float32")])
def test_nd2(tmp_path: Path, dtype: str, name: str, packed: bool) -> None:
    volume = check(written_nd2(tmp_path / "v.nd2", frames(dtype), packed=packed), name, spacing=ND2_STEPS)
    assert [each.name for each in volume.channels] == ["DAPI", "GFP"]
    azure = linear_from_srgb(np.array([0, 128 / 255, 1])).tolist()
    np.testing.assert_allclose([each.color for each in volume.channels], [azure, [0, 1, 0]])


def test_nd2_by_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written_nd2(tmp_path / "v.nd2", frames(positions=2))
    assert main(["info", str(path)]) == 2
    assert "has 2 images: 0 position 0, 1 position 1; --image N or NAME chooses one" in capsys.readouterr().err
    assert main(["info", str(path), "--image", "1", "--time", "2", "--channel", "1"]) == 0
    told = capsys.readouterr().out
    assert "5 x 4 x 3  (60 samples of uint16)" in told and "2 x 2 x 4 µm" in told
    assert "channel 1 GFP of 2: 0 DAPI, 1 GFP" in told and "0 to 100" in told
    assert main(["info", str(path), "--image", "0", "--time", "2", "--channel", "1"]) == 0
    assert "0 to 0" in capsys.readouterr().out
    picture = tmp_path / "p.png"
    scene = ["--image", "position 1", "--time", "2", "--channel", "1", "--size", "20x20"]
    assert main(["render", str(path), *scene, "-o", str(picture)]) == 0
    shown = Image.open(picture).convert("RGB")
    red, green, blue = (high for _, high in shown.getextrema())
    assert green > 50 and red == blue == 0  # the colour of its channel


def test_slices_of_nd2_that_run_downwards(tmp_path: Path) -> None:
    volume = load(written_nd2(tmp_path / "v.nd2", downwards=True), channel=CHANNEL, time=STEP)
    np.testing.assert_array_equal(volume.world_from_index, np.diag([2.0, 2.0, -4.0]))
    np.testing.assert_array_equal(volume.values, marked.marked("u2"))


def test_one_slice_of_nd2_without_lengths_or_with_one_row(tmp_path: Path) -> None:
    path = written_nd2(tmp_path / "v.nd2", frames()[STEP:, :, :1, :, :1], calibrated=False)
    volume = load(path, channel=CHANNEL)
    np.testing.assert_array_equal(volume.values, marked.marked("u2")[:1, :1])
    assert volume.unit == "" and volume.spacing.tolist() == [1, 1, 1]


@pytest.mark.parametrize("packed", [False, True])
def test_slices_that_an_nd2_lacks_are_told(tmp_path: Path, packed: bool) -> None:
    first = STEP * planes().shape[2]  # frame of the step that has values
    path = written_nd2(tmp_path / "v.nd2", missing=(0, 1, 2, first + 1), packed=packed)
    lacking = load(path, channel=CHANNEL, time=STEP)
    assert not lacking.values[1].any() and lacking.values[0].any()
    assert any("1 of 3 slices are not in the file and are 0: 1" in note for note in lacking.notes)
    assert not any("not in the file" in note for note in load(path, channel=CHANNEL, time=1).notes)
    with pytest.raises(InputError, match="has no pixels of this position and time"):
        load(path, channel=CHANNEL, time=0)


def beyond_the_end(content: bytes) -> bytes:
    """A file whose map says that its last frame begins where the file ends."""
    name = f"ImageDataSeq|{STEPS * planes().shape[2] - 1}!".encode()
    place = content.rindex(name) + len(name)
    return content[:place] + struct.pack("<Q", len(content) - 8) + content[place + 8 :]


def test_a_frame_of_nd2_that_lies_beyond_the_end_is_told(tmp_path: Path) -> None:
    (tmp_path / "v.nd2").write_bytes(beyond_the_end(nd2(frames())))
    volume = load(tmp_path / "v.nd2", channel=CHANNEL, time=STEP)
    assert any("1 of 3 slices are not in the file and are 0: 2" in note for note in volume.notes)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (nd2(frames())[:-3000], "is truncated: it lacks the map of its parts"),
        (nd2(frames())[:5000], "is truncated: it lacks the map of its parts"),
        (nd2(frames())[:112], "is truncated: it lacks the map of its parts"),
        (nd2(frames(), Told(custom_loop=True)), "has the axis U, which texvol does not read"),
        (nd2(np.repeat(frames(), 2, 3)[:, :, :, :3], Told(rgb=True)), "has colours in each pixel"),
        (nd2(frames(), Told(packed=True)).replace(b"\x78\x9c", b"\x78\0"), "cannot be read"),
        (nd2(frames()).replace("uiHeight".encode("utf-16-le"), "uiHeighs".encode("utf-16-le")), "uiHeight"),
    ],
    ids=["end", "most", "all but its head", "loop of its own", "colours", "packed", "no height"],
)
def test_an_nd2_that_makes_no_sense(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes, reason: str
) -> None:
    (tmp_path / "v.nd2").write_bytes(content)
    assert main(["info", str(tmp_path / "v.nd2"), "--channel", str(CHANNEL), "--time", str(STEP)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and reason in lines[0], lines


def test_an_nd2_or_czi_that_makes_no_sense(tmp_path: Path) -> None:
    for name, magic in (("v.nd2", b"\xda\xce\xbe\x0a"), ("v.czi", b"ZISRAWFILE")):
        (tmp_path / name).write_bytes(magic + bytes(99))
        with pytest.raises(InputError, match=rf"{name}: "):
            load(tmp_path / name)
    content = written_czi(tmp_path / "t.czi").read_bytes()
    (tmp_path / "t.czi").write_bytes(content[:1000])
    with pytest.raises(InputError, match=r"t\.czi: "):
        load(tmp_path / "t.czi", channel=0, time=0)


@pytest.mark.parametrize(("suffix", "library"), [("czi", "pylibCZIrw"), ("nd2", "nd2"), ("lif", "liffile")])
def test_a_missing_library_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, library: str
) -> None:
    path = tmp_path / f"v.{suffix}"
    if suffix == "czi":
        written_czi(path)
    else:
        path.write_bytes(lif() if suffix == "lif" else b"\xda\xce\xbe\x0a" + bytes(200))
    check_asked_for(monkeypatch, path, library, "microscopy")
