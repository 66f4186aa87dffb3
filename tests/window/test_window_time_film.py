"""Films over time that the window writes: the pictures that `texvol render --time all` writes of the saved scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.desks import SIZE, desk_with, done, said
from support.stores import write_ome
from support.windows import display, eight_bits, script, texvol, timings, viewed  # noqa: F401 (display is a fixture)

from texvol.window import playing, time_film
from texvol.window.jobs import Answer, Job
from texvol.window.painting import JobRunner
from texvol.window.stand_in import at_rest

STEPS, SIDE = 3, 16
ERROR = 0.02


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A ball that wanders, alone and beside a second channel, and in a store."""
    import tifffile

    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    z, y, x = np.mgrid[tuple(slice(-1, 1, SIDE * 1j) for _ in range(3))]
    steps = [200 * np.exp(-9 * ((x - a) ** 2 + y**2 + z**2)) for a in (-0.5, 0.0, 0.5)]
    values = np.stack(steps).astype(np.float32)
    np.save("ball.npy", values)
    both = np.stack([values, values[::-1]], axis=2).astype(np.uint16)
    tifffile.imwrite("both.tif", both, imagej=True, metadata={"axes": "TZCYX"})
    write_ome(tmp_path / "ball.ome.zarr", values, axes="tzyx", levels=1)
    return tmp_path


@pytest.fixture(scope="module")
def runner() -> Iterator[tuple[JobRunner, list[Answer]]]:
    answers: list[Answer] = []
    drawing = JobRunner(answers.append, lambda: 0)
    yield drawing, answers
    drawing.close()


def job_of(document: Any, **more: Any) -> Job:
    parts = {"kind": "steps", "size": SIZE, "accuracy": {"max_error": ERROR, "slicing": "stacks"}, "views": STEPS}
    parts |= {"scene": at_rest(document.scene), "showing": document.showing, "name": document.origin.volume}
    return Job(1, **(parts | more))


def test_a_film_over_time_is_that_of_render(folder: Path, runner: tuple[JobRunner, list[Answer]]) -> None:
    desk = desk_with("ball.npy")
    document = done(desk, "save kept.toml")
    painter, answers = runner
    answers.clear()
    painter.paint(job_of(document, path="window%d.png"))
    assert [answer.kind for answer in answers] == ["progress"] * STEPS + ["done"], answers[-1].text
    assert [round(answer.metadata["done"], 3) for answer in answers[:-1]] == [0.0, 0.333, 0.667]
    assert answers[-1].metadata["views"] == STEPS
    texvol(folder, "render", "--scene", "kept.toml", "--time", "all", "--max-error", str(ERROR), "-o", "line%d.png")
    pictures = [eight_bits(folder / f"window{number}.png") for number in range(STEPS)]
    for number, picture in enumerate(pictures):
        assert (picture == eight_bits(folder / f"line{number}.png")).all()
    assert (pictures[0] != pictures[2]).any()


def test_steps_of_a_store_are_filmed(folder: Path, runner: tuple[JobRunner, list[Answer]]) -> None:
    painter, answers = runner
    document = desk_with("ball.ome.zarr").document
    assert document is not None
    painter.paint(job_of(document, path="store%d.png"))
    painter.paint(job_of(document, path="still.png", kind="file"))
    assert answers[-1].kind == "done", answers[-1].text
    first, *others = (eight_bits(folder / f"store{number}.png") for number in range(STEPS))
    assert (first == eight_bits(folder / "still.png")).all()
    assert all((first != other).any() for other in others)


def test_all_channels_go_through_a_film(folder: Path, runner: tuple[JobRunner, list[Answer]]) -> None:
    document = desk_with("both.tif").document
    assert document is not None and len(document.scene.volumes) == 2
    painter, answers = runner
    painter.paint(job_of(document, path="both%d.png"))
    assert answers[-1].kind == "done", answers[-1].text
    texvol(folder, "render", "both.tif", "--time", "2", "--size", "60x40", "-o", "unused.png")
    first, last = (eight_bits(folder / f"both{number}.png").astype(int) for number in (0, STEPS - 1))
    # The channels change places, so that the first is seen where the second was.
    assert (first != last).any() and first.sum() == pytest.approx(last.sum(), rel=0.2)
    alone = replace(document.scene, added=())
    painter.paint(job_of(document, path="alone%d.png", scene=alone))
    assert (eight_bits(folder / "alone0.png") != first).any()


def test_a_film_is_asked_for_where_it_can_be_written(folder: Path) -> None:
    desk = desk_with("ball.npy")
    document = desk.document
    assert document is not None
    while desk.times.count == 1:
        playing.follow(desk)
    orders: list[dict[str, Any]] = []
    desk.write = lambda _, **job: orders.append(job)  # type: ignore[method-assign]
    desk.director.accuracy = {}  # type: ignore[misc]
    time_film.film(desk, document, "/nowhere/film.mp4", SIZE, 5.0)
    assert "/nowhere" in said(desk) and not orders
    time_film.film(desk, document, "film%d.png", SIZE, 5.0)
    time_film.film(desk, document, "film.gif", SIZE, 5.0)
    assert [(job["kind"], job["views"], job["fps"]) for job in orders] == [
        ("steps", STEPS, None),
        ("steps", STEPS, 5.0),
    ]


def test_time_is_played_and_stepped_by_keys(display: str, folder: Path) -> None:  # noqa: F811
    def tapped(t: float, name: str) -> list[dict[str, Any]]:
        return [{"t": t + 0.05 * up, "kind": "key", "name": name, "down": not up} for up in (False, True)]

    steps: list[dict[str, Any]] = [
        {"do": "rest"},
        {"t": 0.1, "do": "screenshot", "file": "first.png"},
        *tapped(0.2, "period"),
        {"t": 0.4, "do": "rest"},
        {"t": 0.4, "do": "save", "file": "second.toml"},
        {"t": 0.4, "do": "screenshot", "file": "second.png"},
        *tapped(0.5, "comma"),
        *tapped(0.6, "comma"),
        {"t": 0.8, "do": "rest"},
        {"t": 0.8, "do": "save", "file": "last.toml"},
        *tapped(0.9, "space"),
        {"t": 2.4, "do": "mark", "name": "played"},
        *tapped(2.5, "space"),
        {"t": 2.7, "do": "rest"},
        {"t": 2.7, "do": "command", "name": "step 0"},
        {"t": 2.8, "do": "rest"},
        {"t": 2.8, "do": "screenshot", "file": "again.png"},
    ]
    words = ["--size", "200x160", "--no-panels", "--max-error", "0.05", "--script", script(folder, steps)]
    ended = viewed(display, folder, "ball.npy", *words, "--timings", "t.csv")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "time = 1" in (folder / "second.toml").read_text() and "time = 2" in (folder / "last.toml").read_text()
    first, second, again = (eight_bits(folder / f"{name}.png") for name in ("first", "second", "again"))
    assert (first == again).all() and (first[:100] != second[:100]).any()
    bar = first[160:]
    assert bar.shape[0] > 20 and bar.std() > 10, "the time bar is shown without panels, and below the picture"
    drawn = {(frame["width"], frame["height"]) for frame in timings(folder / "t.csv") if frame["state"] == "rest"}
    assert drawn == {("200", "160")}, "the picture has the size that was asked for"
