"""Annotation drawn into a picture: box outlines, axes, orientation letters, legends, scale bar, title and measures.

Annotation is composited over the finished picture, in linear light, with the camera of its scene; far edges of the box
are composited behind the medium. Pictures whose numbers are to be compared stay without annotation. The modules that
draw are imported only if an annotation is requested.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from texvol.annotation.request import PARTS, Annotation
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from texvol.scene.camera import Camera
    from texvol.scene.scene import Scene

__all__ = ["PARTS", "Annotation", "annotate", "check", "with_room"]


def check(annotation: Annotation, scene: Scene) -> None:
    """Raise an error if an annotation can't be drawn into pictures of a scene.

    Raises
    ------
    InputError
        If orientation letters are requested for a volume of unknown orientation, or the font lacks a letter.
    MissingExtraError
        If Pillow, or the default font, is not installed.
    """
    if annotation:
        from texvol.annotation.drawing import check_drawable

        check_drawable(annotation, scene)


def with_room(camera: Camera, scene: Scene, size: tuple[int, int], annotation: Annotation) -> Camera:
    """Return a camera moved along and across its view so that the whole box fits beside the annotation.

    The camera keeps its direction. Only default cameras should be moved, not an eye or height that the user chose.
    """
    if not annotation.needs_room:
        return camera
    from texvol.annotation.margins import framed_with_margins

    return framed_with_margins(camera, scene, size, annotation)


def annotate(
    picture: NDArray,
    scene: Scene,
    size: tuple[int, int],
    annotation: Annotation,
    *,
    transparent: bool = False,
    window: tuple[float, float] | None = None,
) -> NDArray:
    """Return the picture with its annotation, shape (height, width, 4), of the same type.

    Pixels without annotation stay unchanged. A pixel p of which a mark of colour m covers the fraction c becomes
    (1 - c) p + c m, in linear light. Marks behind the medium are weighted by (1 - opacity), as the background is.

    Parameters
    ----------
    picture : array of shape (height, width, 4)
        Linear premultiplied colours over the scene's background, from `render`, `raycast` or `display.shown`. Covered
        pixels are first clipped to [0, 1].
    size : (width, height)
    transparent : bool
        True if the picture keeps its opacity, so that the page behind it shows.
    window : (centre, width), optional
        Window in which the numbers of xray, mip, minip and average are shown, for the legend; see `display.shown`.

    Raises
    ------
    InputError
        In the cases of `check`, or if the picture does not have that size.
    """
    if picture.shape != (size[1], size[0], 4):
        shape = size[1], size[0], 4
        raise InputError(
            f"annotation: picture must have shape {shape} for size {size[0]}x{size[1]}, got {picture.shape}"
        )
    if not annotation:
        return picture
    from texvol.annotation.drawing import annotated

    return annotated(picture, scene, annotation, transparent, window)
