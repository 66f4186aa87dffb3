"""A turn around the scene: its cameras in closed form, its views as single pictures, its files whole or not there."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from support.scenes import FOG, orbiting, random_volume

from texvol.__main__ import main
from texvol.formats.films import film
from texvol.formats.pictures import image
from texvol.opengl.texture_store import TextureStore
from texvol.rendering.renderer import Renderer
from texvol.scene import orbit
from texvol.scene.camera import Camera, Projection
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.installation import install_command
from texvol.util.upward import upward

SCENE = ["v.npy", "--tf", "fog", "--size", "48x32", "--backend", "auto"]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume that is no cube."""
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*line: str) -> int:
    return main(list(line))


def files() -> list[str]:
    return sorted(set(os.listdir(".")) - {"v.npy"})


def read_film(name: str) -> tuple[dict, np.ndarray]:
    """What the file says of itself, and its frames, (views, height, width, 3) uint8."""
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="films need the extra: pip install '.[film]'")
    frames = imageio_ffmpeg.read_frames(name)
    metadata = next(frames)
    width, height = metadata["size"]
    return metadata, np.stack([np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in frames])


# Cameras.


def test_four_views_are_at_right_angles_counterclockwise_about_up() -> None:
    camera = Camera.perspective((3, 0, 1), (1, 0, 0), (0, 0, 2), fov=30)
    views = orbiting(camera, 4)
    assert views[0] == camera
    expected = [(3, 0, 1), (1, 2, 1), (-1, 0, 1), (1, -2, 1)]
    np.testing.assert_allclose([view.eye for view in views], expected, atol=1e-15)
    assert all((view.target, view.up, view.fov) == (camera.target, camera.up, camera.fov) for view in views)


def test_views_are_rotations_of_the_first_about_the_axis() -> None:
    camera = Camera.orthographic((3, -4, 2), (0.5, 1, 0.25), (0.1, 0.2, 1), height=5)
    axis = np.array(camera.up) / np.linalg.norm(camera.up)
    offset = np.subtract(camera.eye, camera.target)
    for i, view in enumerate(orbiting(camera, 7)):
        turned = np.subtract(view.eye, view.target)
        assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(offset), rel=1e-14)
        assert turned @ axis == pytest.approx(offset @ axis, rel=1e-14)
        across, before = turned - (turned @ axis) * axis, offset - (offset @ axis) * axis
        angle = np.degrees(np.arctan2(np.cross(before, across) @ axis, before @ across)) % 360
        assert angle == pytest.approx(360 * i / 7, abs=1e-11)


def test_the_first_view_is_the_camera_to_the_last_bit_far_from_the_origin() -> None:
    camera = Camera.perspective((1e9 + 1, 1e9, 3.3), (1e9, 1e9 + 0.1, 1e-3), (0.3, 0.1, 1))
    assert orbiting(camera, 3)[0] == camera


def reach(camera: Camera, volume: Volume, aspect: float) -> float:
    """How far the box's corners get to the edge of the picture, which is at 1; infinite behind the eye."""
    right, up, depth = camera.in_eye_space(volume.corners_from_centre, volume.centre).T
    if depth.min() <= 0:
        return float("inf")
    scale = depth if camera.projection == "perspective" else 1.0
    return float(np.maximum(np.abs(up) / scale, np.abs(right) / scale / aspect).max() / camera.half_height)


ASIDE, TILTED = (20.0, -3.0, 4.0), (0.3, -0.5, 1.0)


# Each pair of projection, aspect, target and direction upwards.
@pytest.mark.parametrize(
    "projection, aspect, target, up",
    [
        ("orthographic", 0.4, None, TILTED),
        ("perspective", 0.4, ASIDE, None),
        ("orthographic", 1.0, ASIDE, None),
        ("perspective", 1.0, None, TILTED),
        ("orthographic", 3.0, ASIDE, TILTED),
        ("perspective", 3.0, None, None),
    ],
)
def test_the_box_stays_in_the_picture_all_the_way_and_fills_it_somewhere(
    projection: Projection, aspect: float, target: tuple[float, float, float] | None, up: tuple[float, float, float]
) -> None:
    volume = Volume(np.zeros((5, 20, 9), np.float32), spacing=(1, 1.7, 2.5), origin=(100, -7, 0))
    first = orbit.framing(volume, projection, target=target, up=up, aspect=aspect)
    reaches = [reach(camera, volume, aspect) for camera in orbiting(first, 720)]
    # The margin of a single picture at the widest view; half a degree off it, a cosine is within 1e-5 of its top. Where
    # the box is far from the axis, the margin in the distance is less than that in the picture.
    assert max(reaches) <= 1
    if target is None:
        least = {"orthographic": 1 / 1.05 - 1e-4, "perspective": 0.9}[projection]
        assert max(reaches) >= least


def test_an_eye_and_a_height_that_are_given_are_kept() -> None:
    volume = random_volume(0)
    eye = (30.0, -20.0, 10.0)
    assert orbit.framing(volume, "perspective", eye=eye).eye == eye
    assert orbit.framing(volume, eye=eye).eye == eye
    assert orbit.framing(volume, height=3).height == 3


# Pictures.


def test_frames_are_the_single_pictures_of_their_cameras(folder: Path) -> None:
    assert run("render", *SCENE, "--orbit", "3", "-o", "view_%02d.exr", "--projection", "perspective") == 0
    assert files() == ["view_00.exr", "view_01.exr", "view_02.exr"]
    for i, name in enumerate(files()):
        source = oiio.ImageInput.open(name)
        metadata = json.loads(source.spec().get_string_attribute("texvol:scene"))
        source.close()
        angle = np.radians(120 * i)
        position = np.subtract(metadata["camera"]["eye"], metadata["camera"]["target"])
        if i == 0:
            first = position
        assert position[0] == pytest.approx(np.cos(angle) * first[0] - np.sin(angle) * first[1])
        eye, target = (",".join(map(repr, metadata["camera"][key])) for key in ("eye", "target"))
        line = ["--projection", "perspective", "--eye", eye, "--target", target]
        assert run("render", *SCENE, *line, "-o", "single.exr") == 0
        np.testing.assert_array_equal(image.read(name), image.read("single.exr"))


def test_with_the_camera_given_the_first_view_is_the_picture_without_orbit(folder: Path) -> None:
    camera = ["--eye", "40,-20,9", "--height", "14"]
    assert run("render", *SCENE, *camera, "--orbit", "2", "-o", "100%%_%d.png") == 0
    assert run("render", *SCENE, *camera, "-o", "single.png") == 0
    np.testing.assert_array_equal(image.read("100%_0.png"), image.read("single.png"))
    assert np.abs(image.read("100%_1.png") - image.read("single.png")).max() > 0.02


def test_a_film_has_the_views_in_order_and_their_colors(folder: Path) -> None:
    scene = ["v.npy", "--tf", "viridis", "--size", "64x48", "--background", "0.1,0.2,0.6"]
    assert run("render", *scene, "--orbit", "5", "-o", "film.mp4", "--fps", "12.5") == 0
    assert run("render", *scene, "--orbit", "5", "-o", "%d.png") == 0
    metadata, frames = read_film("film.mp4")
    assert (metadata["codec"], metadata["fps"], metadata["size"]) == ("h264", 12.5, (64, 48))
    assert metadata["pix_fmt"].startswith("yuv420p(tv, bt709")
    pictures = np.stack([image.read(f"{i}.png") * 255 for i in range(5)])
    assert frames.shape == pictures.shape
    distances = np.array([[np.abs(frame - picture).mean() for picture in pictures] for frame in frames.astype(float)])
    np.testing.assert_array_equal(distances.argmin(axis=1), np.arange(5))
    # Colour has half the resolution, and noise none of it: 8 levels in the mean. Where it is smooth, studio range and
    # the rounding to 8 bits of three mixed channels lose a level or two; BT.601 read as BT.709 would lose ten.
    assert distances.diagonal().max() < 8
    np.testing.assert_allclose(frames[:, 0, 0], pictures[:, 0, 0], atol=3)


def test_textures_are_uploaded_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    uploads: list[int] = []
    write = TextureStore._write
    monkeypatch.setattr(TextureStore, "_write", lambda *all_of: (uploads.append(1), write(*all_of))[1])
    assert run("render", *SCENE, "--classification", "slab", "--orbit", "6", "-o", "%d.png") == 0
    assert len(uploads) == 1


def test_stats_hold_the_last_view_and_the_orbit(folder: Path) -> None:
    assert run("render", *SCENE, "--orbit", "4", "-o", "%d.png", "--stats", "s.json") == 0
    stats = json.loads(Path("s.json").read_text())
    assert set(stats["orbit"]) == {"views", "seconds", "frames_per_second", "estimated_error_of_first_view"}
    assert stats["orbit"]["views"] == 4
    assert 0 < 3 / stats["orbit"]["frames_per_second"] < stats["orbit"]["seconds"]
    assert stats["estimated_error"] > 0
    assert set(stats["seconds"]) == {"load", "bake", "upload", "draw", "read"}
    assert stats["seconds"]["upload"] == 0
    assert run("render", *SCENE, "--orbit", "1", "-o", "%d.png", "--stats", "s.json") == 0
    assert json.loads(Path("s.json").read_text())["orbit"]["frames_per_second"] is None


@pytest.mark.parametrize("classification", ["slab", "post"])  # in the texels, and in the shader
def test_a_wanted_error_chooses_on_the_first_view_for_all(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], classification: str
) -> None:
    drawn = []
    render = Renderer.render

    def note(renderer: Renderer, scene: Scene, size: tuple[int, int], **accuracy: object) -> np.ndarray:
        picture = render(renderer, scene, size, **accuracy)
        drawn.append((accuracy["max_error"], renderer._last[2]))
        return picture

    monkeypatch.setattr(Renderer, "render", note)
    line = ["--max-error", "0.003", "--strict", "--stats", "s.json", "--classification", classification]
    assert run("render", *SCENE, *line, "--orbit", "3", "-o", "%d.png") == 0
    assert [wanted for wanted, _ in drawn] == [0.003, None, None]
    assert drawn[0][1] == drawn[1][1] == drawn[2][1]
    stats = json.loads(Path("s.json").read_text())
    assert 0 < stats["orbit"]["estimated_error_of_first_view"] <= 0.003
    estimate = upward(stats["orbit"]["estimated_error_of_first_view"])
    assert f", estimated error {estimate} of the first view, " in capsys.readouterr().out
    assert stats["estimated_error"] > 0
    assert stats["slab_thickness"] == drawn[0][1].slab_thickness


# What is wrong.

WRONG = [
    (["--orbit", "3", "-o", "a.png"], "a.png: the name for several pictures must have one %d"),
    (["--orbit", "3", "-o", "a_%d_%d.png"], "must have one %d"),
    (["--orbit", "3", "-o", "a_%s.png"], "must have one %d"),
    (["--orbit", "3", "-o", "a_%d%s.png"], "must have one %d"),
    (["--orbit", "3", "-o", "a_%%d.png"], "must have one %d"),
    (["--orbit", "3", "-o", "a_%099999999d.png"], "must have one %d"),
    (["--orbit", "3", "-o", "%d/a.png"], "must have one %d"),
    (["--orbit", "3", "-o", "no/a_%d.png"], "folder no does not exist"),
    (["--orbit", "3", "-o", "a_%d.bmp"], "the name of a picture must end with"),
    (["--orbit", "3", "-o", "x" * 249 + "%04d.png"], "File name too long"),
    (["-o", "a_%04d.png"], "%04d needs several pictures: give --orbit N or --time all"),
    (["-o", "a.mp4"], "a film needs several pictures: give --orbit N or --time all"),
    (["--orbit", "3", "-o", "a_%d.mp4"], "the name of a film must not have"),
    (
        ["--orbit", "3", "-o", "a.mp4", "--size", "33x32"],
        "size must be even along both sides for a film (H.264, 4:2:0), got 33x32",
    ),
    (["--orbit", "3", "-o", "no/a.mp4"], "folder no does not exist"),
    (["--orbit", "3", "-o", "a_%d.png", "--fps", "25"], "--fps needs a film"),
    (["--orbit", "3", "-o", "a.mp4", "--fps", "0"], "frames per second from 0.1 to 1000"),
    (["--orbit", "0", "-o", "a_%d.png"], "must be a number of views, at least 1"),
    (["--orbit", "-2", "-o", "a_%d.png"], "must be a number of views, at least 1"),
    (["--orbit", "2.5", "-o", "a_%d.png"], "must be a number of views, at least 1"),
    (["--orbit", "3", "-o", "a_%d.png", "--repeat", "3"], "--repeat draws one view"),
    (["--orbit", "3", "-o", "a_%d.png", "--size", "99999x4"], "this driver draws 1 to"),
]


@pytest.mark.parametrize("line, message", WRONG, ids=[" ".join(line)[:60] for line, _ in WRONG])
def test_what_is_wrong_is_said_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], line: list[str], message: str
) -> None:
    assert run("render", "v.npy", "--size", "8x8", *line) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("texvol: error: ")
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert files() == []


def test_a_missing_encoder_is_said_with_its_extra(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert run("render", *SCENE, "--orbit", "3", "-o", "a.mp4") == 2
    expected = f"a film needs imageio-ffmpeg, which is not installed: {install_command('film')}\n"
    assert capsys.readouterr().err == f"texvol: error: {expected}"


@pytest.mark.parametrize("name, most_bytes", [("a_%d.png", 2000), ("a.mp4", 1000)])
def test_a_full_disk_ends_with_one_line_and_nothing_half_written(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, name: str, most_bytes: int
) -> None:
    """A limit on the size of files stands for the full disk, set in the process that writes them."""
    start = subprocess.Popen

    def limited(line: list[str], **rest: Any) -> subprocess.Popen:
        if "film.serve" in line[-1]:
            limit = f"resource.setrlimit(resource.RLIMIT_FSIZE, ({most_bytes}, {most_bytes}))"
            line = [*line[:-1], f"import resource; {limit}; {line[-1]}"]
        return start(line, **rest)

    monkeypatch.setattr(subprocess, "Popen", limited)
    old = Path(name.replace("%d", "1"))
    old.write_text("old")
    assert run("render", *SCENE, "--orbit", "9", "-o", name) == 2
    errors = capsys.readouterr().err
    assert errors.startswith("texvol: error: a")
    assert "cannot be written" in errors
    assert errors.count("\n") == 1
    assert old.read_text() == "old"
    assert files() == [old.name]


def test_a_folder_that_goes_away_midway_leaves_the_frames_before(folder: Path) -> None:
    Path("a_2.png").mkdir()  # stands where the third view is to go
    with (
        film.Writer("a_%d.png", (8, 8), 5) as writer,
        pytest.raises(InputError, match="a_2.png: must be a file"),
    ):
        for _ in range(5):
            writer.add(np.zeros((8, 8, 4), np.float32))
        writer.finish()
    written = set(files())
    assert {"a_0.png", "a_1.png"} <= written <= {f"a_{i}.png" for i in range(5)}
    for name in written - {"a_2.png"}:
        assert image.read(name).shape == (8, 8, 3)


def test_a_film_that_is_not_finished_is_dropped(folder: Path) -> None:
    Path("a.mp4").write_text("old")
    with pytest.raises(RuntimeError, match="midway"), film.Writer("a.mp4", (64, 64), 50) as writer:
        for _ in range(20):
            writer.add(np.random.default_rng(0).random((64, 64, 4)).astype(np.float32))
        raise RuntimeError("midway")
    assert files() == ["a.mp4"]
    assert Path("a.mp4").read_text() == "old"


def test_a_process_that_dies_is_said(folder: Path) -> None:
    with film.Writer("a_%d.png", (8, 8), 9) as writer, pytest.raises(InputError, match="ended unexpectedly"):
        for process in writer._processes:
            process._process.kill()
        for _ in range(9):
            writer.add(np.zeros((8, 8, 4), np.float32))
        writer.finish()
    assert files() == []


@pytest.mark.parametrize(
    "name, stop", [("a_%05d.png", signal.SIGINT), ("a_%05d.png", signal.SIGKILL), ("a.mp4", signal.SIGKILL)]
)
def test_an_orbit_that_is_stopped_leaves_only_whole_files(folder: Path, name: str, stop: signal.Signals) -> None:
    line = [sys.executable, "-m", "texvol", "render", *SCENE, "--orbit", "100000", "-o", name]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    patience = time.monotonic() + 60
    begun = "a_00003" if "%" in name else ".texvol"
    while not any(each.startswith(begun) for each in files()) and time.monotonic() < patience:
        time.sleep(0.05)
    if stop == signal.SIGINT:
        os.killpg(process.pid, stop)  # a terminal's ctrl-C is for all that it started
    else:
        process.send_signal(stop)
    _, errors = process.communicate(timeout=60)  # waits for whoever holds the pipes, the other process included
    assert process.returncode == (130 if stop == signal.SIGINT else -signal.SIGKILL)
    assert errors == ("texvol: interrupted\n" if stop == signal.SIGINT else "")
    frames = files()
    assert all(each.startswith("a_") for each in frames)
    assert len(frames) >= 4 if "%" in name else not frames
    for frame in frames:
        assert image.read(frame).shape == (32, 48, 3)


def test_what_is_held_does_not_grow_with_the_number_of_views(folder: Path) -> None:
    """Views come as fast as they can, and each is 16 MB: the writer must make them wait."""
    size = (1024, 1024)
    picture = np.random.default_rng(0).random((*size, 4), np.float32)
    with film.Writer("a_%d.jpg", size, 24) as writer:
        for i in range(24):
            writer.add(picture)
            if i == 7:
                before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        writer.finish()
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert after - before < picture.nbytes / 1024  # KiB; sixteen more views are 256 MB
    assert len(files()) == 24


def test_the_scene_with_views_is_drawn_as_usual(renderer: Renderer) -> None:
    volume = random_volume(3)
    scene = Scene(volume, FOG, orbit.framing(volume), classification="slab")
    pictures = [renderer.render(replace(scene, camera=camera), (16, 16)) for camera in orbiting(scene.camera, 3)]
    assert "upload" not in renderer.seconds
    assert all(picture[..., 3].max() > 0.01 for picture in pictures)
