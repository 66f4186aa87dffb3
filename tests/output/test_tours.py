"""Films along tours, and orbits about other axes: their pictures are the single pictures of their cameras."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from texvol.__main__ import main
from texvol.formats.pictures import image
from texvol.options.scene_options import SceneOptions
from texvol.scene import orbit
from texvol.scene.camera import Camera
from texvol.scene.orbit import AXES, Turn
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SCENE = 'volume = "v.npy"\ntf = "fog"\nsize = "32x24"\n'
SAVED = """
[[saved-view]]
projection = "perspective"
eye = [20, -15, 9]
target = [4, 5, 6]
up = [0, 0, 1]
fov = 50
seconds = 0.1
[[saved-view]]
eye = [-20, 3, 4]
target = [4, 5, 6]
up = [0, 0, 1]
height = 14
seconds = 0.2
[[saved-view]]
eye = [4, 5, 40]
target = [4, 5, 6]
up = [0, 1, 0]
height = 20
seconds = 0.1
"""
RATE = ["--sampling-rate", "1", "--classification", "post"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    (tmp_path / "s.toml").write_text(SCENE + SAVED)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*line: str) -> int:
    return main(["render", *line])


def camera_in(name: str) -> dict:
    source = oiio.ImageInput.open(name)
    metadata = json.loads(source.spec().get_string_attribute("texvol:scene"))
    source.close()
    return dict(metadata["camera"])


def test_pictures_of_a_tour_are_those_of_its_cameras(folder: Path) -> None:
    assert run("--scene", "s.toml", "--tour", "7", *RATE, "-o", "t_%d.exr", "--stats", "t.json") == 0
    cameras = SceneOptions.of(scene="s.toml").tour.cameras(7)
    assert json.loads(Path("t.json").read_text())["tour"]["views"] == 7
    # At 0.1 s of 0.3, the third of seven pictures is the second view: 2 / 6 of the time.
    assert cameras[2].projection == "orthographic" and cameras[2].height == 14
    for number, camera in enumerate(cameras):
        extent = (
            ["--fov", repr(camera.fov)] if camera.projection == "perspective" else ["--height", repr(camera.height)]
        )
        places = {"eye": camera.eye, "target": camera.target, "up": camera.up}
        line = [f"--{name}={','.join(map(repr, place))}" for name, place in places.items()]
        assert run("--scene", "s.toml", "--projection", camera.projection, *line, *extent, *RATE, "-o", "one.exr") == 0
        assert camera_in(f"t_{number}.exr") == camera_in("one.exr")
        assert np.array_equal(image.read(f"t_{number}.exr"), image.read("one.exr"))
    assert not Path("t_7.exr").exists()


@pytest.mark.parametrize("closed, count", [(False, 10), (True, 12)])
def test_the_number_of_pictures_is_that_of_the_seconds(folder: Path, closed: bool, count: int) -> None:
    Path("s.toml").write_text(f"{SCENE}{SAVED}[tour]\nclosed = {str(closed).lower()}\n")
    # 0.3 s at 30 a second, both ends; 0.4 s of a loop, without the first view again at the end.
    assert run("--scene", "s.toml", "--tour", "auto", *RATE, "-o", "t_%02d.png") == 0
    assert len(list(folder.glob("t_*.png"))) == count


@pytest.mark.parametrize(
    "line, message",
    [
        (["v.npy", "--tour", "3", "-o", "a_%d.png"], "--tour needs at least 2 saved views in --scene"),
        (["v.npy", "--tour", "0", "-o", "a_%d.png"], "must be a number of views, at least 1, got '0'"),
        (["--scene", "s.toml", "--tour", "3", "--orbit", "3", "-o", "a_%d.png"], "give one of them"),
        (["--scene", "s.toml", "--tour", "3", "--repeat", "2", "-o", "a_%d.png"], "--tour draws several views"),
        (["--scene", "s.toml", "--tour", "3", "--check", "9", "-o", "a_%d.png"], "leave --tour out"),
        (["--scene", "s.toml", "--tour", "3", "--time", "all", "-o", "a_%d.png"], "leave --orbit, --tour"),
        (["--scene", "s.toml", "--tour", "3", "-o", "a.png"], "the name for several pictures must have one %d"),
        (["v.npy", "--orbit-axis", "x", "-o", "a.png"], "need --orbit N"),
        (["v.npy", "--orbit", "3", "--orbit-turns", "0", "-o", "a_%d.png"], "turns must be a number other than 0"),
        (["v.npy", "--orbit", "3", "--orbit-axis", "head", "-o", "a_%d.png"], "axis head needs a file that says"),
    ],
)
def test_what_does_not_go_together(
    folder: Path, line: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        status = run(*line)
    except SystemExit as end:
        status = int(end.code or 0)
    said = capsys.readouterr().err
    assert status == 2 and message in said and len(said.strip().splitlines()[-1]) < 300
    assert not list(folder.glob("a*"))


def reach(camera: Camera, volume: Volume, aspect: float) -> float:
    """How far the box's corners get to the edge of the picture, which is at 1; infinite behind the eye."""
    right, up, depth = camera.in_eye_space(volume.corners_from_centre, volume.centre).T
    if depth.min() <= 0:
        return float("inf")
    scale = depth if camera.projection == "perspective" else 1.0
    return float(np.maximum(np.abs(up) / scale, np.abs(right) / scale / aspect).max() / camera.half_height)


BOX = Volume(np.zeros((5, 20, 9), np.float32), (1, 1.7, 2.5), (100, -7, 0), space="left-posterior-superior")


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_box_stays_in_the_picture_about_every_axis(axis: str, projection: str) -> None:
    turn = Turn(axis)
    first = orbit.framing(BOX, projection, aspect=0.7, turn=turn)  # type: ignore[arg-type]
    about = turn.direction(first, BOX)
    reaches = [reach(orbit.turned(first, float(angle), about), BOX, 0.7) for angle in np.arange(0, 360, 0.7)]
    # The margin of a picture is a twentieth; between two angles that were looked at, 1e-4 may be lost.
    assert 0.95 < max(reaches) < 0.953


@pytest.mark.parametrize("axis, vector", [("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1)), ("head", (0, 0, 1))])
def test_the_picture_turns_as_a_whole_about_the_axis(axis: str, vector: tuple[int, int, int]) -> None:
    camera = Camera.perspective((3, -4, 2), (0.5, 1, 0.25), (0.1, 0.2, 1))
    turned = orbit.turned(camera, 90, Turn(axis).direction(camera, BOX))
    k = np.array(vector, float)

    def by_rodrigues(v: np.ndarray) -> np.ndarray:
        return np.cross(k, v) + k * (k @ v)

    np.testing.assert_allclose(
        np.subtract(turned.eye, turned.target), by_rodrigues(np.subtract(camera.eye, camera.target))
    )
    for name in ("right", "upward", "forward"):
        np.testing.assert_allclose(getattr(turned, name), by_rodrigues(getattr(camera, name)), atol=1e-14)
    assert turned.target == camera.target and orbit.turned(camera, 0, k) == camera


def test_turns_of_a_film(folder: Path) -> None:
    line = ["v.npy", "--tf", "fog", "--size", "24x16", *RATE, "--orbit", "4"]
    assert run(*line, "--orbit-turns", "-0.5", "-o", "half_%d.exr") == 0
    assert run(*line, "--orbit-axis", "picture", "-o", "up_%d.exr") == 0
    eyes = [np.subtract(camera_in(f"half_{n}.exr")["eye"], camera_in("half_0.exr")["target"]) for n in range(4)]
    for number, eye in enumerate(eyes):
        angle = np.radians(-45 * number)  # clockwise: half a turn in four steps
        assert eye[0] == pytest.approx(np.cos(angle) * eyes[0][0] - np.sin(angle) * eyes[0][1])
    first, other = (camera_in(f"up_{n}.exr") for n in (0, 2))  # half a turn about what points up shows the back
    np.testing.assert_allclose(np.add(first["eye"], other["eye"]) / 2, first["target"], atol=1e-9)


def test_a_turn_says_what_it_must_be() -> None:
    with pytest.raises(InputError, match="axis must be one of up, picture, head, x, y, z, got 'w'"):
        Turn("w")
