"""What a painting process is asked for, and what it answers: plain data that both sides know."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from numpy.typing import NDArray

from texvol.annotation import Annotation
from texvol.scene.scene import Scene

Size = tuple[int, int]


@dataclass(frozen=True)
class Showing:
    """How a picture is shown in 8 bits, as `Display` wants to know it.

    Attributes
    ----------
    window : (centre, width), optional
        Of pictures that hold numbers, where they are grey.
    transparent : bool
        Whether files let through what lies behind.
    """

    window: tuple[float, float] | None = None
    transparent: bool = False
    annotation: Annotation = field(default_factory=Annotation)


@dataclass(frozen=True)
class Job:
    """One picture, or file of pictures.

    Attributes
    ----------
    number : int
        Ascending: of one process only the newest is wanted.
    kind : str
        "move", as asked for; "rest", several, better and better, the last within `max_error`; "file", into `path`;
        "film", an orbit of `views` into `path`.
    accuracy : mapping
        Arguments of `Renderer.render`.
    name : str
        What the header of a file calls the volume.
    """

    number: int
    kind: Literal["move", "rest", "file", "film"]
    scene: Scene
    size: Size
    accuracy: Mapping[str, Any] = field(default_factory=dict)
    showing: Showing = Showing()
    path: str = ""
    views: int = 0
    fps: float | None = None
    name: str = ""


@dataclass(frozen=True)
class Answer:
    """What became of a job, or of a part of it.

    Attributes
    ----------
    kind : str
        "picture"; "done", a file is written; "progress", so much of it, `facts["done"]`; "failed", with its `text`.
    final : bool
        Whether nothing more comes of this job.
    pixels : array of shape (height, width, 3), uint8
        sRGB, as a PNG file has it.
    facts : mapping
        `settings`, `slabs`, `seconds`, `estimated_error`, `reached`, where they are known.
    """

    kind: Literal["picture", "done", "progress", "failed"]
    number: int
    final: bool = True
    pixels: NDArray | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)
    text: str = ""
