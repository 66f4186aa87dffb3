"""A picture's header is enough to draw its scene again, bit for bit; and whatever is wrong with it is one line."""

from __future__ import annotations

import contextlib
import inspect
import json
import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.stored_scenes import SCENES, VOLUME

import texvol
from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata
from texvol.formats.readers import ARGUMENTS, load
from texvol.provenance.parts import SOURCE
from texvol.provenance.stored_scene import StoredScene, stored_scene_of
from texvol.rendering.renderer import Renderer
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (24, 20)


def stored(path: Path | str, **options: Any) -> StoredScene:
    """The scene of a picture file."""
    return stored_scene_of(read_picture(path).attributes, name=str(path), **options)


def one_line(caught: pytest.ExceptionInfo[InputError], *parts: str) -> None:
    """The message is one line, not too long, that begins with the first part and holds the others."""
    message = str(caught.value)
    assert "\n" not in message and len(message) < 500
    assert message.startswith(f"{parts[0]}: ")
    assert all(part in message for part in parts), message


def changed(attribute: str, **changes: Any) -> str:
    """A header with other values under some keys; without those that become None."""
    metadata = json.loads(attribute) | changes
    return json.dumps({key: value for key, value in metadata.items() if value is not None})


def test_every_part_of_a_scene_is_shown_in_one_of_them() -> None:
    """A part that a scene gets has to be put into its header, and into these."""
    usual = Scene(VOLUME, classification="slab")
    for part in fields(Scene):
        # test_mesh_options.py and test_depth_in.py have meshes and depths, which are in files of their own.
        if part.name not in ("volume", "geometry", "depth"):
            assert any(_differs(getattr(scene, part.name), getattr(usual, part.name)) for scene in SCENES.values()), (
                part
            )


def _differs(one: Any, other: Any) -> bool:
    return type(one) is not type(other) or repr(one) != repr(other)


@pytest.mark.parametrize("name", SCENES)
def test_the_scene_in_a_header_gives_the_same_picture_bit_for_bit(
    name: str, renderer: Renderer, tmp_path: Path
) -> None:
    scene = SCENES[name]
    picture = renderer.render(scene, SIZE, slab_thickness=0.37, texture_format="rgba16f")
    metadata = scene_metadata(scene.volume.name, scene, settings=renderer.settings, checksum=True)
    image.write(tmp_path / "picture.exr", picture, metadata)
    found = stored(tmp_path / "picture.exr", volume=scene.volume, mask=scene.mask, added=scene.added)
    assert picture.any()
    assert found.settings == renderer.settings
    assert found.settings["slab_thickness"] == 0.37
    again = renderer.render(found.scene, SIZE, **found.settings)
    np.testing.assert_array_equal(again, picture)


@pytest.mark.parametrize(
    "options",
    [
        [],
        ["--max-error", "0.05", "--target-format", "rgba16f", "--texture-format", "rgba8", "--spacing", "1,1.5,0.5"],
        ["--sampling-rate", "0.7", "--early-termination", "0.1", "--no-skip-empty", "--classification", "integrated"],
        ["--mode", "mip", "--window", "0.5,1"],
        ["--light", "head", "--shadows", "--projection", "perspective", "--background", "0.1,0.2,0.3"],
    ],
)
def test_a_picture_of_the_command_line_is_drawn_again(options: list[str], renderer: Renderer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values)
    assert main(["render", "noise.npy", "-o", "noise.exr", "--size", "24x20", *options]) == 0
    found = stored("noise.exr")
    np.testing.assert_array_equal(
        renderer.render(found.scene, SIZE, **found.settings), read_picture("noise.exr").pixels
    )
    assert found.window == ((0.5, 1.0) if "--window" in options else None)


def test_raw_samples_are_read_as_they_were(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (VOLUME.values * 1000).astype(">i2").tofile("noise.raw")
    line = ["--shape", "9,8,7", "--dtype", ">i2", "--spacing", "1,2,3", "--mode", "average"]
    assert main(["render", "noise.raw", "-o", "noise.exr", "--size", "24x20", *line]) == 0
    found = stored("noise.exr").scene.volume
    assert found.dimensions == (9, 8, 7)
    np.testing.assert_array_equal(found.spacing, (1, 2, 3))
    np.testing.assert_array_equal(found.values, (VOLUME.values * 1000).astype(np.int16))


def test_a_source_keeps_every_argument_of_load() -> None:
    arguments = set(inspect.signature(load).parameters) - {"path", "memory"}
    assert arguments == set(ARGUMENTS) == set(SOURCE) - {"path", "absolute", "built_in", "samples", "transform"}


def test_the_demo_is_drawn_again_without_a_file(renderer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["demo", "-o", "demo.exr"]) == 0
    picture = read_picture("demo.exr")
    found = stored("demo.exr")
    np.testing.assert_array_equal(renderer.render(found.scene, (512, 512), **found.settings), picture.pixels)


def test_an_orbit_knows_the_camera_of_each_view(renderer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values)
    assert (
        main(["render", "noise.npy", "-o", "view_%d.exr", "--size", "24x20", "--orbit", "3", "--max-error", "0.1"]) == 0
    )
    for view in range(3):
        found = stored(f"view_{view}.exr")
        again = renderer.render(found.scene, SIZE, **found.settings)
        np.testing.assert_array_equal(again, read_picture(f"view_{view}.exr").pixels)


def test_the_oracle_s_picture_has_a_scene_and_no_slabs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values)
    assert main(["raycast", "noise.npy", "-o", "noise.exr", "--size", "24x20"]) == 0
    found = stored("noise.exr")
    assert "slab_thickness" not in found.settings
    np.testing.assert_array_equal(
        texvol.raycast(found.scene, SIZE).astype(np.float32), read_picture("noise.exr").pixels
    )


def test_eight_bits_of_numbers_are_shown_as_they_were(renderer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values * 1000)
    xray = ["--mode", "xray", "--air", "500"]
    for options in ([], ["--window", "400,300"], ["--tf", "inferno"], ["--coloring", "tf"], xray):
        assert main(["render", "noise.npy", "-o", "noise.png", "--size", "24x20", "--mode", "mip", *options]) == 0
        found, picture = stored("noise.png"), read_picture("noise.png")
        shown = found.in_eight_bits(renderer.render(found.scene, SIZE, **found.settings))[..., :3]
        assert (np.abs(shown - picture.pixels[..., :3]) <= picture.rounding[..., :3] + 1e-6).all()


def test_only_a_picture_that_holds_all_digits_says_which_values_it_is_of(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values)
    for name, has_checksum in (("noise.exr", True), ("noise.png", False)):
        assert main(["render", "noise.npy", "-o", name, "--size", "8x8"]) == 0
        assert ("checksum" in json.loads(read_picture(name).attributes[ATTRIBUTE])) == has_checksum


# Where the volume is.


@pytest.fixture(scope="module")
def drawn_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a picture `noise.exr` of `noise.npy`, which no test changes."""
    folder = tmp_path_factory.mktemp("drawn once")
    np.save(folder / "noise.npy", VOLUME.values)
    with contextlib.chdir(folder):
        assert main(["render", "noise.npy", "-o", "noise.exr", "--size", "24x20"]) == 0
    return folder


@pytest.fixture
def drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a picture `noise.exr` of `noise.npy`, at the rate of texvol 0.3; the current one."""
    monkeypatch.chdir(tmp_path)
    np.save("noise.npy", VOLUME.values)
    assert main(["render", "noise.npy", "-o", "noise.exr", "--size", "24x20", "--sampling-rate", "1"]) == 0
    return tmp_path


def test_the_volume_is_looked_for_here_then_beside_the_picture_then_where_it_was(drawn: Path, monkeypatch) -> None:
    elsewhere, here = drawn / "elsewhere", drawn / "here"
    elsewhere.mkdir()
    here.mkdir()
    monkeypatch.chdir(here)
    assert stored("../noise.exr").scene.volume.name == str(drawn / "noise.npy")
    os.rename(drawn / "noise.npy", elsewhere / "noise.npy")
    assert stored("../noise.exr", folder=elsewhere).scene.volume.name == str(elsewhere / "noise.npy")
    np.save("noise.npy", VOLUME.values)
    assert stored("../noise.exr", folder=elsewhere).scene.volume.name == "noise.npy"


def test_another_file_of_the_same_name_is_passed_over(drawn: Path, monkeypatch) -> None:
    (drawn / "here").mkdir()
    monkeypatch.chdir(drawn / "here")
    np.save("noise.npy", VOLUME.values + 1)
    assert stored("../noise.exr").scene.volume.name == str(drawn / "noise.npy")


def test_a_volume_may_be_given(drawn: Path) -> None:
    os.rename("noise.npy", "moved.npy")
    with pytest.raises(InputError, match=r"noise\.exr: .*'noise\.npy', which is neither here"):
        stored("noise.exr")
    for volume in ("moved.npy", Path("moved.npy"), Volume(VOLUME.values)):
        np.testing.assert_array_equal(stored("noise.exr", volume=volume).scene.volume.values, VOLUME.values)


def test_a_volume_without_a_file_has_to_be_given() -> None:
    text = scene_metadata("noise", SCENES["slab"], checksum=True)[ATTRIBUTE]
    with pytest.raises(InputError, match="p: .*without a file, 'noise': give the volume"):
        stored_scene_of({ATTRIBUTE: text}, name="p")
    assert stored_scene_of({ATTRIBUTE: text}, name="p", volume=VOLUME).scene.volume is VOLUME


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (Volume(VOLUME.values[1:], VOLUME.spacing), "9 x 8 x 7 samples, got 9 x 8 x 6 in volume"),
        (Volume(VOLUME.values), "spacing 1, 1.3, 0.7, got 1, 1, 1 in volume"),
        (Volume(VOLUME.values, VOLUME.spacing, (0, 0, 1e-6)), "origin 0, 0, 0, got 0, 0, 1e-06 in volume"),
        (Volume(VOLUME.values, VOLUME.spacing, direction=np.diag([1, 1, -1])), "direction"),
        (Volume(np.nextafter(VOLUME.values, 2), VOLUME.spacing), "other values than those of volume"),
    ],
)
def test_another_volume_than_the_one_drawn_is_refused(other: Volume, message: str) -> None:
    text = scene_metadata("noise", SCENES["slab"], checksum=True)[ATTRIBUTE]
    with pytest.raises(InputError, match=f"^p: .*{message}"):
        stored_scene_of({ATTRIBUTE: text}, name="p", volume=other)


# Headers of texvol 0.3, which said less.


def test_a_header_of_texvol_0_3_still_serves(drawn: Path, renderer: Renderer) -> None:
    text = read_picture("noise.exr").attributes[ATTRIBUTE]
    new = ("format", "source", "origin", "direction", "type", "checksum", "settings")
    old = changed(text, **dict.fromkeys(new))
    found = stored_scene_of({ATTRIBUTE: old}, name="noise.exr")
    assert "slab_thickness" not in found.settings
    drawn_with = json.loads(text)["settings"]["texture_refinement"]  # pictures of texvol 0.3 had none
    again = renderer.render(found.scene, SIZE, texture_refinement=drawn_with)
    np.testing.assert_array_equal(again, read_picture("noise.exr").pixels)
    wide = stored_scene_of({ATTRIBUTE: changed(old, spacing=[2, 1, 1])}, name="noise.exr")  # what --spacing left in it
    np.testing.assert_array_equal(wide.scene.volume.spacing, (2, 1, 1))


# Whatever is wrong.

WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no volume": ({"volume": None}, "lacks volume"),
    "another format": ({"format": 3}, "format 3"),
    "an unknown key": ({"colour": 1}, "unknown key 'colour'"),
    "dimensions as text": ({"dimensions": "big"}, "dimensions: must be 3 numbers"),
    "hostile dimensions": ({"dimensions": [10**30, 10**30, 10**30]}, "1e+30 x 1e+30"),
    "no number": ({"dimensions": [10**400, 1, 1]}, "too large"),
    "nan": ({"spacing": [float("nan"), 1, 1]}, "spacing nan"),
    "a camera as text": ({"camera": "front"}, "camera: must be an object"),
    "half a camera": ({"camera": {"projection": "perspective"}}, "camera: eye is missing"),
    "a camera with more": ({"camera": {"projection": "perspective", "roll": 1}}, "camera: unknown key 'roll'"),
    "an eye as text": (
        {"camera": {"projection": "perspective", "eye": "me", "target": [0] * 3, "up": [0, 0, 1]}},
        "eye",
    ),
    "a fov as text": (
        {"camera": {"projection": "perspective", "eye": [9] * 3, "target": [0] * 3, "up": [0, 0, 1], "fov": "wide"}},
        "is not as texvol writes it",
    ),
    "a background as text": ({"background": "red"}, "background: must be 3 numbers"),
    "a dark background": ({"background": [-1, 0, 0]}, "background"),
    "a list for a mode": ({"mode": ["mip"]}, "mode must be one of"),
    "a classification": ({"classification": "none"}, "classification must be one of"),
    "an isovalue too many": ({"isovalue": 3}, "isovalue"),
    "an isovalue as text": ({"mode": "isosurface", "isovalue": "3"}, "isovalue: must be a number"),
    "a transfer function as text": ({"transfer_function": "bone"}, "transfer function"),
    "no points": ({"transfer_function": {"points": []}}, "transfer function"),
    "a light as number": ({"lighting": {"lights": [1]}}, "lighting"),
    "no lights": ({"lighting": {}}, "lighting"),
    "ambient as text": ({"lighting": {"lights": [], "ambient": "x"}}, "ambient"),
    "shadows as text": ({"lighting": {"lights": [], "shadows": "yes"}}, "shadows has the wrong type: 'yes'"),
    "a depth cue": ({"depth_cue": {"strength": "x"}}, "is not as texvol writes it"),
    "an estimator": ({"gradient": {"kind": "sobel"}}, "kind must be one of central"),
    "settings as list": ({"settings": [1]}, "settings: must be an object"),
    "a thickness of nothing": ({"settings": {"slab_thickness": 0}}, "slab_thickness"),
    "a thickness as text": ({"settings": {"slab_thickness": "1"}}, "slab_thickness has the wrong type: '1'"),
    "a target": ({"settings": {"target_format": "rgb565"}}, "target format"),
    "a texture": ({"settings": {"texture_format": "rgb565"}}, "rgba32f, got 'rgb565'"),
    "termination": ({"settings": {"early_termination": 1}}, "early termination"),
    "another argument": ({"settings": {"repeat": 1000000}}, "unknown key 'repeat'"),
    "a window": ({"window": [1]}, "window"),
    "a flat window": ({"window": [1, 0]}, "window"),
    "colours": ({"colors": "red"}, "colors"),
    "a source as text": ({"source": "noise.npy"}, "source"),
    "a shape of text": ({"source": {"path": "noise.npy", "shape": ["a", 1, 1]}}, "shape"),
    "a huge demo": ({"source": {"built_in": "demo", "samples": 100000}}, "built-in"),
    "another demo": ({"source": {"built_in": "teapot", "samples": 8}}, "built-in"),
    "a channel too many": ({"source": {"path": "noise.npy", "channel": 7}}, "can't be read: noise.npy"),
    "a checksum": ({"checksum": "crc32 0"}, "other values"),
    "a checksum as list": ({"checksum": [1]}, "other values"),
    "a clip plane": ({"clip": [[1, 0, 0, 2]]}, "clip: must be an object with normal"),
    "a clip plane without a normal": ({"clip": [{"normal": [0, 0, 0], "offset": 1}]}, "clip plane: normal must"),
    "a normal of text": ({"clip": [{"normal": "x", "offset": 1}]}, "is not as texvol writes it"),
    "clip planes as text": ({"clip": "x"}, "clip: must be a list"),
    "a crop box": ({"crop": [[1, 0], [0, 1], [0, 1]]}, "crop box: x must go from"),
    "caps as text": ({"caps": "yes", "crop": [[0, 1], [0, 1], [0, 1]]}, "caps: must be true or false"),
    "a folder of nothing": ({"source": {"path": "/proc/self/fd", "absolute": "/dev/zero"}}, "volume"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_header_that_was_tampered_with_is_one_clear_line(
    what: str, drawn_once: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(drawn_once)
    changes, message = WRONG[what]
    text = changed(read_picture("noise.exr").attributes[ATTRIBUTE], **changes)
    with pytest.raises(InputError) as caught:
        stored_scene_of({ATTRIBUTE: text}, name="noise.exr", folder=drawn_once)
    one_line(caught, "noise.exr", message)


@pytest.mark.parametrize(
    "text", ["", "no", "[1]", "null", "{", "[" * 100_000, '{"a": 1}', '{"dimensions": ' + "9" * 5000]
)
def test_a_header_that_is_none_is_one_clear_line(text: str) -> None:
    with pytest.raises(InputError) as caught:
        stored_scene_of({ATTRIBUTE: text}, name="noise.exr")
    one_line(caught, "noise.exr", "the scene in its header")


def test_a_picture_without_a_scene_is_said() -> None:
    with pytest.raises(InputError, match=r"photo\.png: has no scene in its header"):
        stored_scene_of({"Software": "a camera"}, name="photo.png")
