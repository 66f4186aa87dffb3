"""What of annotation is asked for, and the ways in: `check` before the work, `with_room` for the camera, `annotate`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from texvol.util.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from texvol.scene.camera import Camera
    from texvol.scene.scene import Scene

Triple = tuple[float, float, float]
PARTS = ("box", "axes", "orientation", "legend", "scale-bar")  # the names of what is on or off


@dataclass(frozen=True)
class Annotation:
    """What to draw into a picture.

    Parameters
    ----------
    box : bool
        Outline of each volume's box. Edges behind the matter are seen through it.
    axes : bool
        Names, ticks and numbers along three edges of the box at its silhouette. A number is the world coordinate, along
        the axis named, of the very point that its tick marks; also where the box is oblique or sheared. Of several
        volumes it is the box that holds them all, along the axes of the first.
    orientation : bool
        Letters at the middles of the borders: which way of the body they lie, such as R or RA. For volumes whose file
        says so.
    legend : bool
        Colours and opacity by value; the window of modes that show numbers; the isovalue; materials by name; labels
        and their colours. For each of several volumes, as far as there is room; none where samples have colours.
    scale_bar : bool
        A round length; in perspective it holds at the depth of the camera's target, and says so.
    title : str, optional
        One line; shrunk, then cut, where it is too long.
    color : (r, g, b), optional
        Linear light of text and lines; unless given, black or white, whichever is farther from the background.
    font_size : float, optional
        Pixels per em; unless given, in proportion to the picture's height.
    value_name : str
        What the values are, for the legend: "HU", or "CT number (HU)"; of several volumes those of the first.
    font : path, optional
        A TrueType or OpenType file, for letters that DejaVu Sans lacks.

    Raises
    ------
    InputError
        If a colour is not three numbers in [0, 1], a font size not positive and finite, or a text no text.
    """

    box: bool = False
    axes: bool = False
    orientation: bool = False
    legend: bool = False
    scale_bar: bool = False
    title: str | None = None
    color: Triple | None = None
    font_size: float | None = None
    value_name: str = ""
    font: str | os.PathLike[str] | None = None

    def __post_init__(self) -> None:
        for name in ("title", "value_name"):
            text = getattr(self, name)
            if not (isinstance(text, str) or (name == "title" and text is None)):
                raise InputError(f"annotation: {name} is text, and is {text!r}")
        if self.color is not None:
            color = np.asarray(self.color)
            if color.shape != (3,) or color.dtype.kind not in "iuf" or not ((color >= 0) & (color <= 1)).all():
                raise InputError(f"annotation: color is three numbers in [0, 1], and is {self.color!r}")
        if self.font_size is not None and not (_is_number(self.font_size) and 0 < self.font_size < np.inf):
            raise InputError(f"annotation: font size is a positive number of pixels, and is {self.font_size!r}")

    @classmethod
    def of(cls, parts: Iterable[str], title: str | None = None, **further: Any) -> Annotation:
        """Annotation by the names of its parts; see PARTS.

        Raises
        ------
        InputError
            If a name is none of them.
        """
        wanted = list(parts)
        for part in wanted:
            if part not in PARTS:
                raise InputError(f"annotation: there is {', '.join(PARTS)}, and no {part!r}")
        chosen: dict[str, Any] = {_field(part): True for part in wanted}
        return cls(**chosen, title=title, **further)

    def __bool__(self) -> bool:
        """Whether anything is to be drawn."""
        return any(getattr(self, _field(part)) for part in PARTS) or bool((self.title or "").strip())


def check(annotation: Annotation, scene: Scene) -> None:
    """Find out before the work of a picture whether its annotation can be drawn.

    Raises
    ------
    InputError
        If orientation letters are asked for of a volume that does not say how it lies in the body, or the font lacks
        letters of a text.
    MissingExtraError
        If the font library, or the font, is not installed.
    """
    if annotation:
        from texvol.annotation.drawing import check_drawable

        check_drawable(annotation, scene)


def with_room(camera: Camera, scene: Scene, size: tuple[int, int], annotation: Annotation) -> Camera:
    """The camera, moved along and across its view so that the whole box fits beside the annotation.

    It looks the same way. For cameras that frame the box anyway: an eye or height that somebody chose is theirs.
    """
    if not annotation:
        return camera
    from texvol.annotation.room import framed

    return framed(camera, scene, size, annotation)


def annotate(
    picture: NDArray,
    scene: Scene,
    size: tuple[int, int],
    annotation: Annotation,
    *,
    transparent: bool = False,
    window: tuple[float, float] | None = None,
) -> NDArray:
    """The picture with its annotation, shape (height, width, 4), of the same type.

    Pixels that annotation does not cover are as they were. A pixel that a mark of the colour m covers by the share c
    becomes (1 - c) p + c m, in linear light; marks behind the matter enter as the background does, by (1 - opacity).

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        Colours, linear and premultiplied, over the scene's background: what `render`, `raycast` or `display.shown`
        made of `scene`. What is covered is first clipped to what 8 bits hold.
    size : (width, height)
    transparent : bool
        Whether the picture keeps its opacity and shows whatever page it lies on.
    window : (centre, width), optional
        In which the numbers of xray, mip, minip and average are shown; see `display.shown`. For the legend.

    Raises
    ------
    InputError
        As `check`; or if the picture is not of that size.
    """
    if picture.shape != (size[1], size[0], 4):
        raise InputError(f"annotation: a picture of {size[0]}x{size[1]} is wanted, and its shape is {picture.shape}")
    if not annotation:
        return picture
    from texvol.annotation.drawing import annotated

    return annotated(picture, scene, annotation, transparent, window)


def _field(part: str) -> str:
    return part.replace("-", "_")


def _is_number(thing: object) -> bool:
    return isinstance(thing, int | float | np.integer | np.floating) and not isinstance(thing, bool)
