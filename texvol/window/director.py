"""The director: what is wanted goes in once per frame, the best picture of it comes out, whoever draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from numpy.typing import NDArray

from texvol.scene.scene import Scene
from texvol.window import quality
from texvol.window.jobs import Answer, Showing, Size
from texvol.window.quality import SETTLED, Coarseness, Pace, is_software, moving_accuracy, moving_scene


class Worker(Protocol):
    """What the director needs of a painter."""

    @property
    def busy(self) -> bool:
        """Whether the newest job has no final answer yet."""

    def ask(self, **job: Any) -> int:
        """Have this drawn; its number."""

    def drop(self) -> None:
        """Nothing is wanted any more."""

    def answers(self) -> list[Answer]:
        """What has come of the newest job."""


@dataclass(frozen=True)
class Wanted:
    """What is to be seen."""

    scene: Scene
    size: Size
    showing: Showing = field(default_factory=Showing)

    def same(self, other: Wanted | None) -> bool:
        """Whether it is the very same; scenes by identity, since whoever changes one makes another."""
        return other is not None and self.scene is other.scene and (self.size, self.showing) == (
            other.size, other.showing,
        )  # fmt: skip


@dataclass(frozen=True)
class Shown:
    """A picture to be seen, of the version of what is wanted.

    Attributes
    ----------
    state : str
        "moving", "refining" or "rest".
    """

    pixels: NDArray
    version: int
    state: str
    metadata: Mapping[str, Any] = field(default_factory=dict)
    coarseness: Coarseness | None = None


class Director:
    """Has the mover draw whatever is new, and the refiner what has stayed."""

    def __init__(self, mover: Worker, refiner: Worker, pace: Pace, max_error: float) -> None:
        self._mover, self._refiner, self.pace = mover, refiner, pace
        self.max_error = max_error
        self._wanted: Wanted | None = None
        self._version = 0
        self._changed_at = 0.0
        self._moving: tuple[int, Coarseness, Size] | None = None  # version, how, and in what size, at the mover
        self._moved = self._refined = 0  # newest version that each was asked for
        self.shown: Shown | None = None
        self.faults: list[str] = []
        self.pictures = 0  # that have come, of whatever kind

    @property
    def version(self) -> int:
        """How often something else was wanted."""
        return self._version

    @property
    def at_rest(self) -> bool:
        """Whether what is shown is what is wanted, as good as it gets."""
        if self._wanted is None:
            return True
        return self.shown is not None and self.shown.state == "rest" and self.shown.version == self._version

    @property
    def idle(self) -> bool:
        """Whether nothing more will come without a change."""
        quiet = not self._mover.busy and not self._refiner.busy
        return self._wanted is None or (quiet and self._refined == self._version)

    def want(self, wanted: Wanted | None, now: float) -> None:
        """What is to be seen from now on; the same again changes nothing."""
        if wanted is None or wanted.same(self._wanted):
            if wanted is None:
                self._wanted = self.shown = None
            return
        self._wanted = wanted
        self._version += 1
        self._changed_at = now
        if self._refiner.busy:
            self._refiner.drop()

    def again(self) -> None:
        """Refine once more, to another error."""
        self._refined = 0
        if self._refiner.busy:
            self._refiner.drop()

    def update(self, now: float) -> bool:
        """Take what has come and ask for what is next; whether there is a new picture."""
        new = False
        for answer in self._mover.answers():
            new |= self._hear_mover(answer)
        for answer in self._refiner.answers():
            new |= self._hear_refiner(answer)
        if self._wanted is None:
            return new
        if self._moved < self._version and not self._mover.busy:
            self._ask_mover(self._wanted)
        settled = now - self._changed_at >= SETTLED and self._moved == self._version and not self._mover.busy
        if settled and self._refined < self._version:
            self._refined = self._version
            self._refiner.ask(
                kind="rest", scene=self._wanted.scene, size=self._wanted.size, showing=self._wanted.showing,
                accuracy={"max_error": self.max_error},
            )  # fmt: skip
        return new

    def next_due(self, now: float) -> float:
        """Seconds until `update` has something to do although nothing comes."""
        if self._wanted is None or self._refined == self._version or self._mover.busy:
            return float("inf")
        return max(SETTLED - (now - self._changed_at), 0.0)

    def _ask_mover(self, wanted: Wanted) -> None:
        coarseness = self.pace.choose(wanted.size)
        self._moved = self._version
        self._moving = self._version, coarseness, wanted.size
        self._mover.ask(
            kind="move", scene=moving_scene(wanted.scene), size=coarseness.size(wanted.size), showing=wanted.showing,
            accuracy=moving_accuracy(coarseness),
        )  # fmt: skip

    def _hear_mover(self, answer: Answer) -> bool:
        if answer.kind == "failed":
            self._fault(answer)
            return False
        assert self._moving is not None and answer.pixels is not None
        version, coarseness, size = self._moving
        if self.pictures == 0 and not is_software(answer.metadata.get("renderer", "")):
            self.pace.ladder = quality.ON_CARD
        warm = self.pictures > 0
        self.pictures += 1
        if warm and answer.final:  # the first one compiles programs and uploads textures
            self.pace.learn(coarseness, size, answer.metadata["seconds"])
        if self.shown is not None and (self.shown.version, self.shown.state) >= (version, "refining"):
            return False  # the refiner was faster
        self.shown = Shown(answer.pixels, version, "moving", answer.metadata, coarseness)
        return True

    def _hear_refiner(self, answer: Answer) -> bool:
        if answer.kind == "failed":
            self._fault(answer)
            if self.shown is not None:
                self.shown = Shown(self.shown.pixels, self._version, "rest", self.shown.metadata)
            return False
        assert answer.pixels is not None
        self.pictures += 1
        state = "rest" if answer.final else "refining"
        self.shown = Shown(answer.pixels, self._refined, state, answer.metadata)
        return True

    def _fault(self, answer: Answer) -> None:
        if answer.text not in self.faults:
            self.faults.append(answer.text)
