"""Choice of the picture to draw next: it takes the wanted scene once per frame, and returns the best picture of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from numpy.typing import NDArray

from texvol.annotation import Annotation
from texvol.scene.scene import Scene
from texvol.window import quality
from texvol.window.jobs import Answer, Showing, Size
from texvol.window.painter import Painter
from texvol.window.quality import MOVING_TERMINATION, SETTLED, Coarseness, Pace, is_software, moving_scene
from texvol.window.stand_in import at_rest


@dataclass(frozen=True)
class Wanted:
    """Scene to be drawn, with its size in pixels and its presentation."""

    scene: Scene
    size: Size
    showing: Showing = field(default_factory=Showing)


@dataclass(frozen=True)
class Shown:
    """Picture to be shown.

    Attributes
    ----------
    version : int
        Version of the wanted scene that the picture shows.
    state : str
        "moving", "refining" or "rest".
    """

    pixels: NDArray
    version: int
    state: str
    metadata: Mapping[str, Any] = field(default_factory=dict)
    coarseness: Coarseness | None = None
    wanted: Wanted | None = None

    @property
    def surroundings(self) -> tuple[float, float, float]:
        """Colour of the picture beside its filled part, in sRGB."""
        red, green, blue = (self.pixels[0, 0, :3] / 255).tolist()
        return red, green, blue

    @property
    def lacks_annotation(self) -> bool:
        """True if the window has to draw the annotation over the picture, whose pixels have four channels then."""
        return self.pixels.shape[2] == 4


class Director:
    """Sends each new scene to the mover, and a scene that has stayed unchanged to the refiner."""

    def __init__(self, mover: Painter, refiner: Painter, pace: Pace, max_error: float, slicing: str = "stacks") -> None:
        self._mover, self._refiner, self.pace = mover, refiner, pace
        self.max_error, self.slicing = max_error, slicing  # of the picture at rest
        self._wanted: Wanted | None = None
        self.version = 0  # number of changes of the wanted scene
        self._changed_at = 0.0
        self._moving: tuple[int, Coarseness, Wanted] | None = None  # job of the mover: version, coarseness, its scene
        self._refining: Wanted | None = None  # of the refiner's job
        self._moved = self._refined = 0  # newest version that was sent to each painter
        self.shown: Shown | None = None
        self.faults: list[str] = []
        self._failed = (0, "")  # version of the wanted scene whose picture has failed, and why
        self.refined = 0.0  # fraction of the work of the picture at rest that is done
        self.pictures = 0  # number of pictures received
        self._aside: Callable[[NDArray], None] | None = None  # receiver of the mover's current picture, if asked aside

    @property
    def accuracy(self) -> dict[str, Any]:
        """Accuracy of the picture at rest, as arguments of `Renderer.render`."""
        return {"max_error": self.max_error, "slicing": self.slicing}

    @property
    def at_rest(self) -> bool:
        """True if the shown picture is the final picture of the wanted scene."""
        if self._wanted is None:
            return True
        return self.shown is not None and self.shown.state == "rest" and self.shown.version == self.version

    @property
    def why_not_final(self) -> str:
        """Reason why there is no final picture of the wanted scene; "" if there is one, or may be."""
        version, reason = self._failed
        return reason if version == self.version else ""

    @property
    def refining(self) -> bool:
        """True while a better picture of the unchanged scene is being drawn."""
        return self._wanted is not None and self._refined == self.version and self._refiner.busy

    @property
    def moving(self) -> bool:
        """True until the picture of a change that is being drawn has arrived."""
        return self._mover.busy and self._mover.quiet

    @property
    def idle(self) -> bool:
        """True if no further picture will arrive until the scene changes."""
        quiet = not self._mover.busy and not self._refiner.busy
        return self._wanted is None or (quiet and self._refined == self.version)

    def want(self, wanted: Wanted | None, now: float) -> None:
        """Set the scene to be drawn; an unchanged scene has no effect."""
        if wanted is None:
            self.shown = None
        elif wanted != self._wanted:
            self.version += 1
            self._changed_at = now
            self.again()
        self._wanted = wanted

    def again(self) -> None:
        """Refine the picture again, after a change of the scene or the accuracy."""
        self._refined = 0
        if self._refiner.busy:
            self._refiner.drop()

    def update(self, now: float) -> bool:
        """Take over new pictures and start the next jobs; return True if there is a new picture."""
        new = False
        for answer in self._mover.answers():
            new |= self._hear_mover(answer) if self._aside is None else self._hear_aside(answer)
        for answer in self._refiner.answers():
            new |= self._hear_refiner(answer)
        if self._wanted is None:
            return new
        scene, size, showing = self._wanted.scene, self._wanted.size, self._wanted.showing
        if self._moved < self.version and not self._mover.busy:
            coarseness = self.pace.choose(size)
            self._moved, self._moving = self.version, (self.version, coarseness, self._wanted)
            self._mover.ask(
                kind="move", scene=moving_scene(scene), size=coarseness.size(size),
                showing=replace(showing, annotation=Annotation()), with_opacity=bool(showing.annotation),
                accuracy={"sampling_rate": coarseness.rate, "early_termination": MOVING_TERMINATION},
            )  # fmt: skip
        settled = now - self._changed_at >= SETTLED and self._moved == self.version and not self._mover.busy
        if settled and self._refined < self.version:
            self._refined, self.refined, self._refining = self.version, 0.0, self._wanted
            self._refiner.ask(kind="rest", scene=at_rest(scene), size=size, showing=showing, accuracy=self.accuracy)
        return new

    def aside(self, scene: Scene, size: Size, showing: Showing, take: Callable[[NDArray], None]) -> bool:
        """Have a small picture of another scene drawn for `take`; return False if there is something else to draw."""
        if not self.at_rest or self._mover.busy:
            return False
        self._aside = take
        accuracy = {"sampling_rate": 1.0, "early_termination": MOVING_TERMINATION}
        self._mover.ask(kind="move", scene=moving_scene(scene), size=size, showing=showing, accuracy=accuracy)
        return True

    def next_due(self, now: float) -> float:
        """Return the seconds until `update` has to be called again although no picture arrives."""
        if self._wanted is None or self._refined == self.version or self._mover.busy:
            return float("inf")
        return max(SETTLED - (now - self._changed_at), 0.0)

    def _hear_aside(self, answer: Answer) -> bool:
        take = self._aside
        if answer.final:
            self._aside = None
        if answer.pixels is not None and take is not None:
            take(answer.pixels)
        return False

    def _hear_mover(self, answer: Answer) -> bool:
        assert self._moving is not None
        version, coarseness, wanted = self._moving
        if answer.kind == "failed":
            self._fault(answer, version)
            return False
        if answer.final:
            drawn = replace(coarseness, shrink=coarseness.shrink * answer.metadata.get("shrink", 1))
            self.pace.learn(drawn, wanted.size, answer.metadata["seconds"])
        if answer.pixels is None:
            return False
        if self.pictures == 0 and not is_software(answer.metadata.get("renderer", "")):
            self.pace.ladder = quality.ON_CARD
        self.pictures += 1
        if self.shown is not None and (self.shown.version, self.shown.state) >= (version, "refining"):
            return False  # the refiner's picture is already shown
        self.shown = Shown(answer.pixels, version, "moving", answer.metadata, coarseness, wanted)
        return True

    def _hear_refiner(self, answer: Answer) -> bool:
        if answer.kind == "failed":
            self._fault(answer, self._refined)
            if self.shown is not None:
                self.shown = replace(self.shown, version=self.version, state="rest")
            return False
        if answer.kind == "progress":
            self.refined = float(answer.metadata["done"])
            return False
        assert answer.pixels is not None
        self.pictures += 1
        state = "rest" if answer.final else "refining"
        self._failed = (0, "")
        self.shown = Shown(answer.pixels, self._refined, state, answer.metadata, wanted=self._refining)
        return True

    def _fault(self, answer: Answer, version: int) -> None:
        self._failed = version, answer.text
        if answer.text not in self.faults:
            self.faults.append(answer.text)
