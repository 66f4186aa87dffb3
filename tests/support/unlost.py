"""A folder with three volumes, and a window's desk that is asked, answered by keys, and writes when it is told to."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from texvol.window.desk import Desk
from texvol.window.events import Event
from texvol.window.jobs import Answer
from texvol.window.questions import Question

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three volumes, in the current folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    for name in ("one", "two", "three"):
        np.save(tmp_path / f"{name}.npy", np.random.default_rng(3).random((6, 7, 8)).astype(np.float32))
    return tmp_path


class Clerk:
    """One who writes nothing before he is told to."""

    alive = True

    def __init__(self) -> None:
        self.jobs: list[dict[str, Any]] = []
        self.said: list[Answer] = []

    def ask(self, **job: Any) -> None:
        self.jobs.append(job)

    def drop(self) -> None:
        self.jobs.clear()

    def answers(self) -> list[Answer]:
        said, self.said = self.said, []
        return said

    def done(self, desk: Desk, kind: Any = "done") -> None:
        """The first job is over."""
        job = self.jobs.pop(0)
        if kind == "done":
            Path(job["path"]).write_text("picture")
        self.said.append(Answer(kind, 1, text=job["path"]))
        desk.update()


def asked(desk: Desk, part: str) -> Question:
    """The question, in which a text occurs."""
    assert desk.question is not None and part in desk.question.text
    return desk.question


def writing(desk: Desk) -> Clerk:
    """The clerk of a desk, who is made when there is something to write."""
    clerk = Clerk()
    desk.make_painter = lambda: cast(Any, clerk)
    desk.director.accuracy, desk.director.shown = {}, None  # type: ignore[misc]
    return clerk


def keyed(desk: Desk, *names: str) -> None:
    """Keys that go to the dialog."""
    assert desk.hear([Event("key", name=name, down=True) for name in names], typing=False)
