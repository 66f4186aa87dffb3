"""Cube, sphere, saved views and their film in the window itself, by mouse and keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.windows import display, display_of_all, eight_bits, script, texvol, viewed  # noqa: F401 (a fixture)

from texvol.options.scene_options import SceneOptions
from texvol.scene.camera import Camera
from texvol.window import cube, light_sphere

SIZE = (300, 300)
SCALE = SIZE[0] / 480  # of the cube in so small a picture
MIDDLE = (SIZE[0] - 60 * SCALE, 60 * SCALE)  # of the cube, in the picture's corner
SPHERE = (SIZE[0] + 174.0, 191.0)  # middle of the sphere, beside a scroll bar
REST: dict[str, Any] = {"do": "rest"}


def clicked(t: float, x: float, y: float, *, to: tuple[float, float] | None = None) -> list[dict[str, Any]]:
    """A click with the left button, or a drag to another place."""
    button, (last_x, last_y) = {"kind": "button", "name": "left"}, to or (x, y)
    places = [(x + (last_x - x) * n / 6, y + (last_y - y) * n / 6) for n in range(1, 7)] if to else []
    moves = [{"t": t + 0.2 + 0.03 * n, "kind": "move", "x": px, "y": py} for n, (px, py) in enumerate(places)]
    return [
        {"t": t, "kind": "move", "x": x, "y": y},
        {"t": t + 0.1, **button, "down": True},
        *moves,
        {"t": t + 0.5, **button, "down": False},
    ]


def saved(t: float, name: str) -> list[dict[str, Any]]:
    return [{"t": t, **REST}, {"t": t, "do": "save", "file": f"{name}.toml"}]


def place_of(camera: Camera, picked: cube.Pick) -> tuple[float, float]:
    """Where a part of the cube is seen, in window coordinates."""
    face = next(each for each in reversed(cube.visible_faces(camera)) if picked[each[0]] == each[1])
    ((x, y),) = cube.positions(camera, cube.patch(face, picked).mean(axis=0, keepdims=True))
    return MIDDLE[0] + 25 * SCALE * float(x), MIDDLE[1] - 25 * SCALE * float(y)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of one window in which the cube and the sphere were used, with a scene file after each."""
    found = tmp_path_factory.mktemp("moving")
    z, y, x = np.mgrid[tuple(slice(-1, 1, 16j) for _ in range(3))]
    np.save(found / "v.npy", (200 * np.exp(-3 * (x**2 + 2 * y**2 + z**2))).astype(np.float32))
    place = {"eye": (30.0, -20.0, 20.0), "target": (7.5, 7.5, 7.5), "up": (0.0, 0.0, 1.0)}
    start = Camera.orthographic(**place, height=24.0)
    corner = Camera.orthographic((30, -20, 30), (7.5, 7.5, 7.5), (0, 0, 1), 24)
    steps: list[dict[str, Any]] = [REST, {"t": 0, "kind": "key", "name": "v", "down": True, "modifiers": []}]
    steps += [*clicked(0.2, *place_of(start, (0, -1, 0))), *saved(0.8, "front")]
    steps += [{"t": 0.8, "kind": "key", "name": "v", "down": True, "modifiers": []}]
    steps += [{"t": 0.9, "do": "command", "name": "go view 1"}, {"t": 1.0, **REST}]
    steps += [*clicked(1.1, *place_of(start, (1, -1, 1))), *saved(1.7, "corner")]
    right, down = place_of(corner, (0, -1, 0))
    steps += [*clicked(1.8, right, down, to=(right - 30, down)), *saved(2.5, "dragged")]
    steps += [{"t": 2.6, "do": "command", "name": "go view 1"}, {"t": 2.7, **REST}]
    steps += [{"t": 2.7, "do": "command", "name": "tab Light"}]
    # The sphere is 168 wide and stands 10 below the buttons; its middle is that of the panel.
    steps += [*clicked(3.2, *SPHERE, to=(SPHERE[0] + 42, SPHERE[1])), *saved(3.9, "light")]
    steps += [{"t": 4.0, "do": "screenshot", "file": "light.png"}]
    places = [f"--{name}={','.join(map(str, each))}" for name, each in place.items()]
    words = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--max-error", "0.5", "--script", script(found, steps)]
    done = viewed(display_of_all(), found, "v.npy", "--tf", "fog", *places, "--height=24", "--light", "head", *words)
    assert (done.returncode, done.stderr) == (0, "")
    return found


def scene(folder: Path, name: str) -> Any:
    options = SceneOptions.of(scene=str(folder / f"{name}.toml"))
    return options.scene(options.load())


def towards(folder: Path, name: str) -> np.ndarray:
    return np.asarray(-scene(folder, name).camera.forward)


@pytest.mark.usefixtures("display")
def test_a_click_on_the_cube_turns_to_a_face_and_to_a_corner(folder: Path) -> None:
    np.testing.assert_allclose(towards(folder, "front"), [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(towards(folder, "corner"), np.array([1, -1, 1]) / np.sqrt(3), atol=1e-12)
    assert scene(folder, "corner").camera.height == pytest.approx(24)


@pytest.mark.usefixtures("display")
def test_a_drag_of_the_cube_turns_the_scene_with_the_mouse(folder: Path) -> None:
    before, after = towards(folder, "corner"), towards(folder, "dragged")
    assert after[2] == pytest.approx(before[2]), "to the left only"
    angles = [np.arctan2(each[1], each[0]) for each in (before, after)]
    # A quarter of π for half of the cube's edge; the first moves are too short for a drag, and then count at once.
    assert angles[1] - angles[0] == pytest.approx(30 / (25 * SCALE) * np.pi / 4, abs=0.35)


@pytest.mark.usefixtures("display")
def test_the_views_that_v_has_saved_are_in_the_scene_file(folder: Path) -> None:
    options = SceneOptions.of(scene=str(folder / "light.toml"))
    assert [each.name for each in options.tour.views] == ["view 1", "view 2"]
    assert options.tour.views[1].camera == scene(folder, "front").camera


@pytest.mark.usefixtures("display")
def test_a_light_is_dragged_on_the_sphere(folder: Path) -> None:
    (light,) = scene(folder, "light").lighting.lights
    camera = scene(folder, "light").camera
    spot = light_sphere.spot_of(light, camera, scene(folder, "light").box)
    assert light.kind == "directional" and not spot.behind
    assert (spot.x, spot.y) == (pytest.approx(0.5, abs=0.02), pytest.approx(0, abs=0.02))


@pytest.mark.usefixtures("display")
def test_a_film_from_the_window_is_that_of_the_command_line(folder: Path) -> None:
    """The painting process writes what `render --tour` writes, bit for bit."""
    from dataclasses import replace

    from texvol.scene.tour import Tour
    from texvol.window.document import opened_file
    from texvol.window.jobs import Answer, Job
    from texvol.window.painting import JobRunner

    document = opened_file(str(folder / "light.toml"), (40, 30))
    course = Tour(document.tour.views, closed=True, stops=False)
    text = (folder / "light.toml").read_text().split("[tour]")[0]
    (folder / "path.toml").write_text(f"{text}[tour]\nclosed = true\nstops = false\n")
    answers: list[Answer] = []
    runner = JobRunner(answers.append, lambda: 1)
    job = Job(1, "film", document.scene, (40, 30), {"max_error": 0.1, "slicing": "stacks"}, document.showing)
    runner.paint(replace(job, path=str(folder / "window_%d.png"), views=5, course=course, name="v.npy"))
    runner.close()
    assert answers[-1].kind == "done", answers[-1].text
    line = ["--tour", "5", "--size", "40x30", "--max-error", "0.1", "-o", "line_%d.png"]
    texvol(folder, "render", "--scene", "path.toml", *line)
    pictures = [[eight_bits(folder / f"{name}_{n}.png") for n in range(5)] for name in ("window", "line")]
    # Of five on the way from one view to the other and back, two are seen again.
    assert np.array_equal(*pictures) and len({each.tobytes() for each in pictures[0]}) == 3
