"""Messages between the window and a painting process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from numpy.typing import NDArray

from texvol.annotation import Annotation
from texvol.scene.orbit import Turn
from texvol.scene.scene import Scene
from texvol.scene.tour import Tour

Size = tuple[int, int]


@dataclass(frozen=True)
class Showing:
    """Presentation of a picture in 8 bits.

    Attributes
    ----------
    window : (centre, width), optional
        Window of values that are shown as grey.
    transparent : bool
        True if picture files keep their opacity instead of a background.
    """

    window: tuple[float, float] | None = None
    transparent: bool = False
    annotation: Annotation = field(default_factory=Annotation)


@dataclass(frozen=True)
class Job:
    """Order of one picture, or of one file.

    Attributes
    ----------
    number : int
        Number of the job; a process drops a job when one with a higher number arrives.
    kind : str
        "move": one picture with `accuracy`. "rest": several pictures with decreasing error, the last within
        `accuracy["max_error"]`. "file": a picture file at `path`. "film": `views` pictures at `path`, of a turn or
        a tour, the `course`.
        "steps": a picture for each of `views` time steps at `path`.
    accuracy : mapping
        Arguments of `Renderer.render`.
    name : str
        Name of the volume in the header of a file.
    with_opacity : bool
        True if the answer's pixels have the opacity as a fourth channel.
    """

    number: int
    kind: Literal["move", "rest", "file", "film", "steps"]
    scene: Scene
    size: Size
    accuracy: Mapping[str, Any] = field(default_factory=dict)
    showing: Showing = Showing()
    path: str = ""
    views: int = 0
    course: Turn | Tour = field(default_factory=Turn)
    fps: float | None = None
    name: str = ""
    with_opacity: bool = False


@dataclass(frozen=True)
class Answer:
    """Answer to a job; a job may have several.

    Attributes
    ----------
    kind : str
        "picture"; "timed": a picture `metadata["shrink"]` times smaller takes `metadata["seconds"]`; "done": a file
        has been written; "progress": the fraction `metadata["done"]` has been written; "failed": `text` is the reason.
    final : bool
        True for the last answer to a job.
    pixels : array of shape (height, width, 3) or (height, width, 4), uint8
        Picture in sRGB, as in a PNG file; with the opacity of the medium if the job asks for it. The colours include
        the background in any case.
    metadata : mapping
        `settings`, `slabs`, `seconds`, `estimated_error` and `reached`, if they are known; `filled` of a picture, see
        `texvol.window.filled`.
    """

    kind: Literal["picture", "timed", "done", "progress", "failed"]
    number: int
    final: bool = True
    pixels: NDArray | None = None
    metadata: Mapping[str, Any] = field(default_factory=dict)
    text: str = ""
