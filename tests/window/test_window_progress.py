"""What is being written and refined is told truly, and writing is stopped where it is shown."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from imgui_bundle import imgui
from support.desks import desk_with, said
from support.panel_frames import dressed, headless, shown
from support.windows import PATIENCE

import texvol
from texvol.scene.lighting import Lighting
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.window.desk import Desk
from texvol.window.jobs import Answer
from texvol.window.painter import Painter
from texvol.window.panels import overlay, status
from texvol.window.transport import SharedArrays


@pytest.fixture(scope="module")
def painter() -> Iterator[Painter]:
    shared = SharedArrays()
    made = Painter(shared, lambda: None)
    yield made
    made.close()
    shared.close()


def lit(samples: int) -> Scene:
    """A ball with light, whose gradients have to be made."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, samples * 1j) for _ in range(3))].astype(np.float32)
    volume = Volume((200 * np.exp(-4 * (x**2 + y**2 + z**2))).astype(np.int16))
    return replace(texvol.Scene(volume).completed((64, 48)), lighting=Lighting(), classification="post")


def answers(painter: Painter, most: float = PATIENCE) -> Iterator[tuple[float, Answer]]:
    """Answers as they come, each with its time."""
    end = time.monotonic() + most
    while painter.busy and time.monotonic() < end:
        for answer in painter.answers():
            yield time.monotonic(), answer
        time.sleep(0.002)


def file_job(path: Path, scene: Scene, **accuracy: float) -> dict[str, Any]:
    return {"kind": "file", "scene": scene, "size": (400, 300), "path": str(path), "accuracy": accuracy}


def test_a_lit_picture_is_written_with_true_progress(painter: Painter, tmp_path: Path) -> None:
    start = time.monotonic()
    painter.ask(**file_job(tmp_path / "lit.png", lit(128), sampling_rate=16.0))
    told = list(answers(painter))
    assert told[-1][1].kind == "done" and (tmp_path / "lit.png").exists()
    done = [float(answer.metadata["done"]) for _, answer in told[:-1]]
    assert len(done) > 4 and done == sorted(done) and done[-1] > 0.8
    # Compared with time: half of the work is not told in the first tenth, nor in the last one, however busy others are.
    times = [(at - start) / (told[-1][0] - start) for at, _ in told[:-1]]
    half = times[int(np.searchsorted(done, 0.5))]
    assert 0.1 < half < 0.95


def test_writing_that_is_stopped_leaves_nothing(painter: Painter, tmp_path: Path) -> None:
    painter.ask(**file_job(tmp_path / "never.png", lit(100), max_error=1e-9))  # minutes of work
    assert next(answers(painter))[1].kind == "progress"
    painter.drop()
    assert not painter.busy
    # The process is free as soon as a piece of a few milliseconds is done: another file is written.
    painter.ask(**file_job(tmp_path / "next.png", lit(16), sampling_rate=1.0))
    assert [answer.kind for _, answer in answers(painter)][-1] == "done"
    assert [path.name for path in tmp_path.iterdir()] == ["next.png"]


def test_the_picture_at_rest_tells_how_far_it_is(painter: Painter) -> None:
    painter.ask(kind="rest", scene=lit(64), size=(200, 150), accuracy={"max_error": 1 / 255})
    found = [answer for _, answer in answers(painter)]
    done = [float(answer.metadata["done"]) for answer in found if answer.kind == "progress"]
    assert found[-1].kind == "picture" and done == sorted(done) and max(done) <= 1


class Clerk:
    """One who never ends."""

    alive = True

    def __init__(self) -> None:
        self.dropped = 0

    def ask(self, **job: Any) -> None:
        """Begin."""

    def drop(self) -> None:
        self.dropped += 1

    def answers(self) -> list[Answer]:
        return [Answer("progress", 1, final=False, metadata={"done": 0.42})]


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    """A desk whose clerk writes a picture."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    np.save("one.npy", np.random.default_rng(3).random((6, 7, 8)).astype(np.float32))
    desk = dressed(desk_with("one.npy"))
    desk.clerk = cast(Any, Clerk())
    assert desk.document is not None
    for name in ("first.png", "second.png"):
        desk.write(desk.document, kind="file", size=(60, 40), accuracy={}, path=name)
    desk.update()
    return desk


def test_the_progress_is_shown_with_a_button_that_stops_it(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []
    with headless():
        progress_bar, text = imgui.progress_bar, imgui.text_wrapped
        with monkeypatch.context() as patch:
            patch.setattr(imgui, "progress_bar", lambda *how: (written.append(how[2]), progress_bar(*how))[1])
            patch.setattr(imgui, "text_wrapped", lambda words: (written.append(words), text(words))[1])
            shown(desk, "File", 1)
            assert {"writing first.png, 1 more after it", "42 %"} <= set(written)
            button = imgui.button
            patch.setattr(imgui, "button", lambda label, *size: button(label, *size) or label == "stop")
            shown(desk, "Cut", 1)
    assert desk.writing is None and not desk.orders and cast(Any, desk.clerk).dropped == 1
    assert said(desk) == "stopped: first.png is not written"


def test_a_long_name_of_what_is_written_keeps_its_beginning(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.job["path"] = "folder/the beginning of a name that is" + " long" * 20 + " and ends.png"
    written: list[str] = []
    with headless():
        text = imgui.text_wrapped
        monkeypatch.setattr(imgui, "text_wrapped", lambda words: (written.append(words), text(words))[1])
        shown(desk, "File", 1)
    (words,) = (each for each in written if each.startswith("writing"))
    assert words.startswith("writing the beginning") and "ends.png" in words and "…" in words and len(words) < 80


@pytest.mark.parametrize(
    "state, refining, refined, words",
    [
        ("rest", False, 1.0, "final"),
        ("refining", True, 0.604, "refining 60 %"),
        ("refining", True, 0.0, "refining"),
        ("moving", True, 0.1, "refining 10 %"),
        ("moving", False, 0.9, "moving"),
        ("before", False, 0.9, "moving"),  # the final picture of what was shown before
    ],
)
def test_the_status_says_in_plain_words_how_far_it_is(
    desk: Desk, state: str, refining: bool, refined: float, words: str
) -> None:
    director: Any = desk.director
    director.shown = replace(director.shown, state="rest" if state == "before" else state)
    director.refining, director.refined, director.at_rest = refining, refined, state == "rest"
    assert status.state(desk) == words


def test_why_there_is_no_final_picture_is_told_as_long_as_there_is_none(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    reason = "30 volumes are too many"
    cast(Any, desk.director).why_not_final = reason
    written: list[str] = []
    monkeypatch.setattr(imgui, "text_unformatted", written.append)
    with headless():
        desk.messages.clear()
        for _ in range(2):
            imgui.new_frame()
            overlay.messages(desk)
            imgui.end_frame()
            desk.say(reason, fault=True)
    assert written == [reason] * 2 and status.state(desk) == "no final picture"


def test_the_status_keeps_its_height(desk: Desk) -> None:
    director: Any = desk.director
    first = director.shown
    with headless():
        for details in (False, True):
            desk.preferences.details = details
            heights = []
            known = {"rest": first.metadata, "moving": {}, "refining": {"modelled": ["light"]}}
            for state, metadata in (*known.items(), ("rest", first.metadata)):
                director.shown = replace(first, state=state, metadata=metadata)
                imgui.new_frame()
                imgui.set_next_window_size(imgui.ImVec2(360, 900))
                imgui.begin("panels")
                heights.append(status.height(desk))
                imgui.end()
                imgui.end_frame()
            assert len(set(heights)) == 1 and heights[0] > 20


def test_parts_of_the_status_do_not_overlap_in_a_narrow_panel(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    director: Any = desk.director
    director.refining, director.refined, director.at_rest = True, 0.404, False
    desk.panel_state["rate"] = 24.0
    parts: list[tuple[float, float]] = []
    for place, name in ((imgui, "text_unformatted"), (imgui, "text_disabled"), (status.parts, "pressed_toggle")):
        made = getattr(place, name)

        def noted(*words: Any, made: Any = made) -> Any:
            answer = made(*words)
            parts.append((imgui.get_item_rect_min().x, imgui.get_item_rect_max().x))
            return answer

        monkeypatch.setattr(place, name, noted)
    counts = []
    with headless():
        for width in range(200, 400, 10):
            parts.clear()
            imgui.new_frame()
            imgui.set_next_window_size(imgui.ImVec2(width, 900))
            imgui.begin("panels")
            status.show(desk)
            imgui.end()
            imgui.end_frame()
            assert all(one[1] <= other[0] for one, other in pairwise(parts)), (width, parts)
            counts.append(len(parts))
    assert counts[0] == 2 and counts[-1] == 3, "the rate is left out where it has no room"


def test_error_and_slabs_are_among_the_details(desk: Desk) -> None:
    text = " ".join(status.details(desk))
    assert "12 slabs" in text and "error" in text and "60 × 40 pixels" in text and "modelled: " in text
