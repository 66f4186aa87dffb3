"""Scenes written are the scenes that `texvol render --scene` reads, to the last bit."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import texvol
from texvol.__main__ import main
from texvol.annotation import Annotation
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata
from texvol.geometry import Lines, Mesh
from texvol.options import scene_options as options
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction, preset
from texvol.util.errors import InputError
from texvol.window import saving
from texvol.window.document import Document, Origin, opened_file
from texvol.window.jobs import Showing
from texvol.window.scene_writing import scene_files

SIZE = (40, 30)
THIRD = 1 / 3
FOG = TransferFunction([0.1, THIRD, THIRD, 1.0], np.full((4, 3), (0.1, THIRD, 0.7)), [0.0, THIRD, 2.0, np.inf])
SUN = Light("directional", (-THIRD, 1.0, 2.0), (1.0, 0.9, THIRD))
LAMP = Light("point", (3.0, THIRD, 1e3))


@pytest.fixture
def volume(tmp_path: Path) -> texvol.Volume:
    z, y, x = np.mgrid[tuple(slice(0, 1, 12j) for _ in range(3))]
    np.save(tmp_path / "a volume.npy", (x * y + z / 2).astype(np.float32))
    return texvol.load(str(tmp_path / "a volume.npy"))


def camera(projection: str) -> Camera:
    if projection == "perspective":
        return Camera.perspective((30 * THIRD, -20, 13), (5, 5 + THIRD, 5), (0, THIRD, 1), fov=31.7)
    return Camera.orthographic((30 * THIRD, -20, 13), (5, 5 + THIRD, 5), (0, 0, 1), height=17 * THIRD)


PARTS: dict[str, dict[str, Any]] = {
    "plain": {},
    "perspective": {"camera": camera("perspective")},
    "background": {"background": (THIRD, 0.0, 1.0), "classification": "integrated"},
    "light": {"lighting": Lighting((Light(), SUN, LAMP), ambient=THIRD, fade=1e-3, two_sided=False)},
    "shadows": {"lighting": Lighting((SUN,), shadows=True, specular=0.0), "classification": "extinction"},
    "smoothed": {"lighting": Lighting(), "gradient": Estimator("gaussian", 1.7)},
    "zucker-hummel": {"lighting": Lighting(), "gradient": Estimator("zucker-hummel")},
    "cue": {"depth_cue": DepthCue(THIRD, (0.1, 0.2, THIRD))},
    "cue, from": {"depth_cue": DepthCue(THIRD, near=10 * THIRD)},
    "cue, to": {"depth_cue": DepthCue(1.0, far=1e3 * THIRD)},
    "cue, between": {"depth_cue": DepthCue(0.5, (1.0, THIRD, 0.0), -THIRD, 40.0)},
    "ambient": {"lighting": Lighting((), ambient=THIRD, specular=0.0)},
    "isosurface, ambient": {"mode": "isosurface", "isovalue": THIRD, "lighting": Lighting((), ambient=THIRD)},
    "cut": {
        "clip": (ClipPlane((1, THIRD, 0), 2.7), ClipPlane((0, 0, -1), -9.1)),
        "crop": ((1.0, 8 * THIRD * 3), (-np.inf, 9.5), (0.5, np.inf)),
        "caps": True,
        "classification": "post",
    },
    "mip": {"mode": "mip"},
    "isosurface": {"mode": "isosurface", "isovalue": THIRD},
    "isosurface, lit": {"mode": "isosurface", "isovalue": THIRD, "lighting": Lighting((SUN,))},
    "isosurface, unlit": {
        "mode": "isosurface",
        "isovalue": THIRD,
        "lighting": Lighting((), ambient=1.0, diffuse=0.0, specular=0.0),
    },
}


def scene_of(volume: texvol.Volume, name: str) -> Scene:
    return replace(Scene(volume, FOG, camera("orthographic"), classification="slab"), **PARTS[name])


def document(scene: Scene, showing: Showing | None = None) -> Document:
    return Document(scene, Origin(str(scene.volume.source["absolute"])), showing)


def described(scene: Scene) -> dict[str, Any]:
    content = json.loads(scene_metadata("", scene)[ATTRIBUTE])
    content["source"] = {"absolute": content["source"]["absolute"]}  # how it is named depends on the folder
    return content


@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("folder", [".", "scenes"])
def test_a_scene_that_is_written_is_read_again(volume: texvol.Volume, tmp_path: Path, name: str, folder: str) -> None:
    (tmp_path / folder).mkdir(exist_ok=True)
    path = tmp_path / folder / "scene.toml"
    scene = scene_of(volume, name)
    saving.save_scene(str(path), document(scene), SIZE)
    read = options.SceneOptions.of(scene=str(path))
    again = read.scene(read.load())
    assert read.size == SIZE
    assert described(again) == described(scene)


def test_how_it_is_shown_is_written_too(volume: texvol.Volume, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    annotation = Annotation(box=True, scale_bar=True, title='a "title" \\ ü', value_name="HU")
    showing = Showing((THIRD, 2.0), False, annotation)
    saving.save_scene(str(path), document(scene_of(volume, "mip"), showing), SIZE)
    read = options.SceneOptions.of(scene=str(path))
    assert read.window == (THIRD, 2.0) and read.annotation == annotation and read.chose_view
    saving.save_scene(str(path), document(scene_of(volume, "plain"), Showing(transparent=True)), SIZE)
    assert options.SceneOptions.of(scene=str(path)).transparent


def test_files_of_a_saved_scene_that_no_longer_exist_are_named(tmp_path: Path) -> None:
    path = tmp_path / "gone.raw"
    path.write_bytes(bytes(range(60)))
    scene = Scene(texvol.load(str(path), shape=(3, 4, 5), dtype="uint8"), FOG, camera("orthographic"))
    opened = document(scene)
    assert saving.lost_files(opened) == []
    path.unlink()
    assert saving.lost_files(opened) == [str(path)]
    saving.save_scene(str(tmp_path / "s.toml"), opened, SIZE)


def test_how_the_volume_was_read_is_written_too(tmp_path: Path) -> None:
    (tmp_path / "v.raw").write_bytes(bytes(range(60)))
    how = {"shape": (3, 4, 5), "dtype": "uint8", "spacing": (THIRD, 1.0, 2.0)}
    scene = Scene(texvol.load(str(tmp_path / "v.raw"), **how), FOG, camera("orthographic"), classification="slab")
    saving.save_scene(str(tmp_path / "s.toml"), document(scene), SIZE)
    read = options.SceneOptions.of(scene=str(tmp_path / "s.toml")).load()
    assert (read.values == scene.volume.values).all() and (read.spacing == scene.volume.spacing).all()


@pytest.mark.parametrize("name", ["ct-materials", "contours", "boundaries", "grey", "viridis"])
def test_presets_are_written_as_what_they_became(volume: texvol.Volume, tmp_path: Path, name: str) -> None:
    scene = replace(scene_of(volume, "plain"), transfer_function=preset(name, volume))
    saving.save_scene(str(tmp_path / "s.toml"), document(scene), SIZE)
    read = options.SceneOptions.of(scene=str(tmp_path / "s.toml"))
    assert described(read.scene(read.load())) == described(scene)


@pytest.mark.parametrize("name", ["plain", "light", "cut"])
def test_the_command_line_draws_the_very_picture(
    volume: texvol.Volume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    scene = scene_of(volume, name)
    with Renderer() as renderer:
        picture = renderer.render(scene, SIZE, max_error=0.05)
        accuracy = renderer.settings
    words = saving.command_line(document(scene), SIZE, accuracy)
    assert shlex.split(shlex.join(words)) == words and words[:2] == ["texvol", "render"]
    assert main([*words[1:-1], "again.exr"]) == 0
    assert np.array_equal(image.read("again.exr"), picture)


def test_a_scene_that_is_saved_is_not_saved_again_for_its_command_line(
    volume: texvol.Volume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    opened = document(scene_of(volume, "plain"))
    saving.save_scene("mine.toml", opened, SIZE)
    assert opened.origin.scene_file is None, "that is for whoever saves it as that scene"
    before = sorted(tmp_path.iterdir())
    assert "mine.toml" in saving.command_line(opened, SIZE, {})
    assert sorted(tmp_path.iterdir()) == before
    opened.change(background=(0.5, 0.5, 0.5))
    assert "mine.toml" not in saving.command_line(opened, SIZE, {})
    (tmp_path / "mine.toml").unlink()
    assert "mine.toml" not in saving.command_line(opened, SIZE, {})


def test_a_command_line_that_is_copied_saves_nothing_in_the_file_of_the_scene(
    volume: texvol.Volume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    opened = document(scene_of(volume, "plain"))
    saving.save_scene("mine.toml", opened, SIZE)
    assert not opened.unsaved
    opened.change(background=(0.5, 0.5, 0.5))
    words = saving.command_line(opened, SIZE, {})
    assert opened.unsaved, "mine.toml does not have the background"
    assert saving.command_line(opened, SIZE, {}) == words, "one file for each scene"


def test_what_a_scene_file_has_no_word_for_is_refused(volume: texvol.Volume, tmp_path: Path) -> None:
    corners = [(0.0, 0.0, 0.0), (5.0, 0.0, 0.0), (0.0, 5.0, 0.0)]
    for shape in (Mesh(corners, [(0, 1, 2)]), Lines(corners, [(0, 1)])):  # type: ignore[arg-type]
        scene = replace(scene_of(volume, "plain"), geometry=(shape,))
        with pytest.raises(InputError, match="geometry that was not read from a file"):
            saving.save_scene(str(tmp_path / "s.toml"), document(scene), SIZE)
    assert not (tmp_path / "s.toml").exists() and not (tmp_path / "s.tf.json").exists()


def test_a_mask_from_nowhere_and_an_array_are_refused(volume: texvol.Volume, tmp_path: Path) -> None:
    plain = scene_of(volume, "plain")
    masked = replace(plain, mask=Mask(np.ones((12, 12, 12), bool)))
    for scene in (masked, replace(plain, volume=texvol.Volume(volume.values))):
        with pytest.raises(InputError, match="was not read from a file"):
            scene_files(tmp_path / "s.toml", scene, SIZE, Showing())


WITH_MORE = """
volume = "a volume.npy"
classification = "post"
eye = [10, -30, 7]
height = 20.5
transform = [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0.25]
mask = {file = "mask.npy", fade = [0.1, 0.9]}
mesh = [{file = "ball.ply", color = [0.2, 0.4, 0.6], opacity = 0.5}]

[[add]]
file = "head.nrrd"
tf = "inferno"
transform = [0.9, 0.1, 0, 3, -0.1, 0.9, 0, 1, 0, 0, 1, 2]

[[add]]
file = "head.nrrd"
"""


@pytest.mark.parametrize("folder", [".", "scenes"])
@pytest.mark.parametrize("space", ["left-posterior-superior", "right-anterior-superior"])
def test_further_volumes_masks_and_meshes_are_written_too(
    volume: texvol.Volume, tmp_path: Path, folder: str, space: str
) -> None:
    import nrrd
    import trimesh

    rng = np.random.default_rng(1)
    head = {"space": space, "space directions": np.diag([1.0, 2.0, 1.5]), "space origin": [1.0, 2.0, 3.0]}
    nrrd.write(str(tmp_path / "head.nrrd"), rng.random((6, 7, 8)), head)
    lps = {"space": "left-posterior-superior", "space directions": np.eye(3), "space origin": [0.0, 0.0, 0.0]}
    nrrd.write(str(tmp_path / "first.nrrd"), np.asarray(volume.values).T.copy(), lps)
    np.save(tmp_path / "mask.npy", rng.random((12, 12, 12)))
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / "ball.ply")
    (tmp_path / folder).mkdir(exist_ok=True)
    (tmp_path / "given.toml").write_text(WITH_MORE.replace("a volume.npy", "first.nrrd"))
    opened = opened_file(str(tmp_path / "given.toml"), SIZE)
    assert len(opened.scene.added) == 2 and opened.scene.mask is not None and opened.scene.geometry
    saving.save_scene(str(tmp_path / folder / "saved.toml"), opened, SIZE)
    again = opened_file(str(tmp_path / folder / "saved.toml"), SIZE)
    for one, other in zip(opened.scene.volumes, again.scene.volumes, strict=True):
        assert np.array_equal(one.values, other.values)
        # A matrix that was divided by another is as exact as float64 is.
        assert np.allclose(one.world_from_index, other.world_from_index, rtol=1e-14, atol=1e-14)
        assert np.allclose(one.origin, other.origin, rtol=1e-14, atol=1e-14)
    assert again.scene.mask is not None and np.array_equal(again.scene.mask.array, opened.scene.mask.array)
    for one, other in zip(opened.scene.added, again.scene.added, strict=True):
        assert one.transfer_function is not None and other.transfer_function is not None
        assert one.transfer_function.as_json() == other.transfer_function.as_json()
    (ball,), (same,) = opened.scene.geometry, again.scene.geometry
    assert np.array_equal(ball.vertices, same.vertices) and ball.opacity == same.opacity == 0.5
