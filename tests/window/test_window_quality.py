"""How coarse pictures are while something moves, and who draws what when; with painters that only write down."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from texvol.scene.camera import Camera
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window import quality
from texvol.window.application import Application
from texvol.window.director import Director, Wanted
from texvol.window.jobs import Answer
from texvol.window.quality import Pace, moving_scene

FULL = (800, 600)
VOLUME = Volume(np.zeros((4, 4, 4), np.float32))
FOG = TransferFunction([0.0, 1.0], np.ones((2, 3)), [0.0, 1.0])
SCENE = Scene(VOLUME, FOG, Camera.framing(VOLUME), classification="slab")


class Sketcher:
    """A painter whose answers the test gives."""

    def __init__(self) -> None:
        self.jobs: list[dict[str, Any]] = []
        self.waiting: list[Answer] = []
        self.busy = False
        self.dropped = 0

    def ask(self, **job: Any) -> int:
        self.jobs.append(job)
        self.busy = True
        return len(self.jobs)

    def drop(self) -> None:
        self.dropped += 1
        self.busy = False

    @property
    def quiet(self) -> bool:
        return not self.waiting

    def answers(self) -> list[Answer]:
        taken, self.waiting = self.waiting, []
        return taken

    def answer(self, *, final: bool = True, **metadata: Any) -> None:
        width, height = self.jobs[-1]["size"]
        known = {"seconds": 0.01, "renderer": "llvmpipe"} | metadata
        self.waiting.append(Answer("picture", len(self.jobs), final, np.zeros((height, width, 3), np.uint8), known))
        self.busy = not final

    def timed(self, seconds: float) -> None:
        metadata = {"seconds": seconds, "shrink": 2}
        self.waiting.append(Answer("timed", len(self.jobs), metadata=metadata))
        self.busy = False


def directed() -> tuple[Director, Sketcher, Sketcher]:
    mover, refiner = Sketcher(), Sketcher()
    return Director(mover, refiner, Pace(), 1 / 255), mover, refiner


@pytest.mark.parametrize("speed", [1e-9, 2e-8, 1e-7, 3e-7])
def test_pictures_come_in_time_and_no_coarser_than_it_takes(speed: float) -> None:
    pace = Pace(30)
    for _ in range(20):
        chosen = pace.choose(FULL)
        pace.learn(chosen, FULL, speed * chosen.work(FULL))
    ladder = list(pace.ladder)
    position = ladder.index(chosen)
    assert speed * chosen.work(FULL) <= 1 / 30
    if position:
        # The next finer one would take more than the share of the time from which on it is left alone.
        finer = ladder[position - 1]
        assert speed * finer.work(FULL) > quality._FINER_BELOW / 30


def test_the_coarsest_picture_is_still_one() -> None:
    wide = (3480, 2160)
    for full, size in ((FULL, (114, 86)), (wide, (348, 216))):
        pace = Pace(30)
        for _ in range(10):
            pace.learn(pace.choose(full), full, 100.0)
        assert pace.choose(full).size(full) == size
    assert pace.choose(wide) == pace.ladder[-1]
    assert quality.Coarseness(8, 0.5).size((3, 1)) == (1, 1)


def test_one_picture_that_had_to_wait_changes_nothing() -> None:
    pace = Pace(30)
    for _ in range(10):
        chosen = pace.choose(FULL)
        pace.learn(chosen, FULL, 2e-8 * chosen.work(FULL))
    pace.learn(chosen, FULL, 3.0)
    assert pace.choose(FULL) == chosen


def test_every_step_of_a_ladder_is_less_work() -> None:
    for ladder in (quality.ON_CPU, quality.ON_CARD):
        works = [each.work(FULL) for each in ladder]
        assert works == sorted(works, reverse=True)


def test_what_moves_bakes_nothing_anew() -> None:
    lit = replace(SCENE, lighting=Lighting(shadows=True))
    moving = moving_scene(lit)
    assert moving.classification == "post"
    assert moving.lighting == Lighting(shadows=False)
    assert moving.camera is lit.camera and moving.transfer_function is FOG and moving.volume is VOLUME
    mip = replace(SCENE, mode="mip")
    assert moving_scene(mip) is mip
    names = Volume(np.ones((4, 4, 4), np.uint8), labels=True)
    assert moving_scene(Scene(names, FOG, SCENE.camera, classification="slab")).classification == "slab"


def test_what_is_new_is_moving_first_and_refined_when_it_stays() -> None:
    director, mover, refiner = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    assert [job["kind"] for job in mover.jobs] == ["move"] and not refiner.jobs
    mover.answer()
    assert director.update(0.01)
    assert director.shown is not None and director.shown.state == "moving"
    assert director.next_due(0.01) == pytest.approx(quality.SETTLED - 0.01)
    director.update(quality.SETTLED - 0.001)
    assert not refiner.jobs
    director.update(quality.SETTLED + 0.001)
    assert refiner.jobs[0]["kind"] == "rest" and refiner.jobs[0]["accuracy"] == director.accuracy
    assert refiner.jobs[0]["scene"] is SCENE and refiner.jobs[0]["size"] == FULL
    refiner.answer(final=False)
    assert director.update(0.2) and director.shown.state == "refining" and not director.at_rest
    refiner.answer()
    assert director.update(0.3) and director.at_rest and director.idle
    assert director.shown.wanted == Wanted(SCENE, FULL), "the window draws its annotation over slices"
    # And that is all, for as long as nothing changes.
    director.want(Wanted(SCENE, FULL), now=9.0)
    assert not director.update(9.0)
    assert len(mover.jobs) == len(refiner.jobs) == 1


def test_nothing_is_at_rest() -> None:
    director, mover, _ = directed()
    assert director.at_rest and not director.update(0.0) and not mover.jobs
    director.want(Wanted(SCENE, FULL), now=0.0)
    assert not director.at_rest
    director.want(None, now=0.1)
    assert director.at_rest and director.shown is None


def test_a_picture_before_the_one_that_was_asked_for_is_seen_and_teaches_nothing() -> None:
    director, mover, _ = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    mover.answer(final=False, seconds=1e9)  # neither does one for which programs were compiled
    mover.timed(0.01)
    director.update(0.0)
    quick = director.pace.choose(FULL)
    director.want(Wanted(replace(SCENE, lighting=Lighting()), FULL), now=0.1)
    director.update(0.1)
    mover.answer(final=False, seconds=1e9)
    assert director.update(0.2) and director.shown is not None and director.shown.version == director.version
    assert director.pace.choose(FULL) == quick
    mover.answer(seconds=1e9)
    assert director.update(0.3)
    assert director.pace._speeds[-1] > 1


def test_a_first_picture_is_timed_by_a_smaller_one_before_anything_turns() -> None:
    """The first turn of a slow scene would else stand still for as long as the first guess is wrong."""
    director, mover, _ = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    mover.answer(final=False)
    assert director.update(0.1) and director.shown is not None and director.shown.state == "moving"
    mover.timed(0.3)
    assert not director.update(0.4), "no new picture to be shown"
    assert director.pace.choose(FULL) == quality.Coarseness(7, 0.35)


def test_a_turn_does_not_wait_for_a_refinement() -> None:
    director, mover, refiner = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    mover.answer()
    director.update(1.0)
    director.update(1.0)
    assert refiner.busy
    turned = replace(SCENE, camera=replace(SCENE.camera, height=3.0))
    director.want(Wanted(turned, FULL), now=1.1)
    director.update(1.1)
    assert refiner.dropped == 1 and mover.jobs[-1]["scene"].camera is turned.camera
    # What the refiner may still say of the old view is not shown over the new one.
    mover.answer()
    director.update(1.15)
    assert director.shown is not None and director.shown.state == "moving"


class MouseBefore:
    """A screen before which a mouse moves every hundredth of a second; the mover's picture comes at `arrival`."""

    def __init__(self, mover: Sketcher, arrival: float) -> None:
        self.time, self._mover, self._arrival = 0.0, mover, arrival

    def wait(self, seconds: float) -> None:
        self.time += min(max(seconds, 1e-3), 0.01)
        if self.time >= self._arrival and self._mover.busy:
            self._mover.answer()


@pytest.mark.parametrize(("dragging", "arrival", "drawn"), [(True, 0.05, 0.05), (True, 9.0, 0.1), (False, 0.05, 0.01)])
def test_the_events_of_a_drag_wait_for_the_picture_of_the_last(dragging: bool, arrival: float, drawn: float) -> None:
    """Frames between two pictures would show nothing new, and take the time of the picture that is drawn."""
    director, mover, _ = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    window = Application.__new__(Application)
    window._screen = cast(Any, MouseBefore(mover, arrival))
    window._plan = cast(Any, SimpleNamespace(frames=None, player=None))
    still, steering = SimpleNamespace(motion=None), SimpleNamespace(dragging=dragging)
    times, others = SimpleNamespace(due=lambda _: 1.0), {"messages": (), "loading": None, "writing": None, "now": 0.0}
    window._desk = cast(Any, SimpleNamespace(director=director, steering=steering, moving=still, times=times, **others))
    window._last, window._lively = 0.0, 0
    window._wait()
    assert window._screen.time == pytest.approx(drawn, abs=0.0101)


def test_while_the_mover_draws_only_the_newest_view_waits() -> None:
    director, mover, _ = directed()
    heights = (1.0, 2.0, 3.0, 4.0)
    for number, height in enumerate(heights):
        scene = replace(SCENE, camera=replace(SCENE.camera, height=height))
        director.want(Wanted(scene, FULL), now=0.001 * number)
        director.update(0.001 * number)
    mover.answer()
    director.update(0.05)
    assert [job["scene"].camera.height for job in mover.jobs] == [1.0, 4.0]


def test_a_fault_is_said_once_and_the_last_picture_stays() -> None:
    director, mover, refiner = directed()
    director.want(Wanted(SCENE, FULL), now=0.0)
    director.update(0.0)
    mover.answer()
    director.update(0.5)
    director.update(0.5)
    refiner.waiting.append(Answer("failed", 1, text="no room for such a picture"))
    refiner.busy = False
    assert not director.update(0.6)
    assert director.faults == ["no room for such a picture"]
    assert director.shown is not None and director.at_rest
    assert director.why_not_final == "no room for such a picture", "it is told as long as the scene stays"
    director.want(Wanted(replace(SCENE, background=(1.0, 0.0, 0.0)), FULL), now=0.7)
    assert not director.why_not_final
    director.update(0.7)
    mover.waiting.append(Answer("failed", 2, text="no room for the quick one"))
    mover.busy = False
    director.update(0.8)
    assert director.why_not_final == "no room for the quick one"
    director.update(1.5)
    refiner.answer()
    director.update(1.6)
    assert not director.why_not_final


@pytest.mark.parametrize(
    "metadata, text",
    [
        ({"estimated_error": 0.003, "wanted_error": 1 / 255, "reached": True}, "error ≤ 1/255"),
        ({"estimated_error": 0.003, "wanted_error": 0.0041, "reached": True}, "error ≤ 0.0041"),
        ({"estimated_error": 0.02, "wanted_error": 1 / 255, "reached": False}, "error ≈ 0.02"),
        ({"estimated_error": 0.02, "wanted_error": 1 / 255, "reached": True}, "error ≈ 0.02"),
        ({}, "error not estimated"),
    ],
)
def test_an_error_is_claimed_only_where_it_was_reached(metadata: dict[str, Any], text: str) -> None:
    assert quality.error_text(metadata) == text
