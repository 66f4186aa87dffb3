"""What a picture file shows of a drawn picture: numbers as grey or colours, annotation, and its scene in the header."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from texvol.annotation import Annotation, annotate, check, with_room
from texvol.provenance.scene_metadata import scene_metadata
from texvol.scene.display import NUMBER_MODES
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.slicing.slabs import slabs_crossed

if TYPE_CHECKING:
    from texvol.options.scene_options import SceneOptions
    from texvol.scene.camera import Camera

_FEW = 32  # one pixel of so many along each side mostly shows that there is something


def out_of_view(scene: Scene, size: tuple[int, int]) -> list[Volume]:
    """The volumes whose box no pixel's ray meets in front of the eye."""
    camera = scene.camera_for(size)
    return [volume for volume in scene.volumes if not slabs_crossed(volume, camera, volume.radius, size)]


def emptiness(picture: NDArray, scene: Scene) -> str | None:
    """What there is to say where a picture shows nothing, or one of several volumes can't be in it; else None."""
    size = picture.shape[1], picture.shape[0]
    opacity = picture[..., 3]
    shows_nothing = not (opacity[::_FEW, ::_FEW].any() or opacity.any())
    if not (shows_nothing or scene.added):
        return None
    outside = out_of_view(scene, size)
    if outside and len(outside) < len(scene.volumes):
        return f"{', '.join(volume.name for volume in outside)} is outside of the view"
    if not shows_nothing:
        return None
    if outside:
        what = "all volumes are" if scene.added else "the volume is"
        return f"{what} outside of the view, and the picture is empty"
    if scene.cutting:
        return "of what clip planes and crop box leave nothing shows, and the picture is empty"
    if any(mask is not None for mask in (scene.mask, *(each.mask for each in scene.added))):
        return "of what the mask leaves nothing shows, and the picture is empty"
    return "nothing of the volume shows, and the picture is empty"


def is_exact(path: str) -> bool:
    """True if a file of that name holds the numbers of a picture as they are, and not what 8 bits show of them."""
    return Path(path).suffix.lower() == ".exr"


class Display:
    """What files of 8 bits show; where nobody chose a window of numbers, the first picture's is that of all.

    Annotation is put into them, and never into the data of an EXR.
    """

    def __init__(self, scene_options: SceneOptions, annotation: Annotation | None = None) -> None:
        self._window = scene_options.window
        self._transparent = scene_options.transparent
        self._annotation = annotation or Annotation()

    @property
    def window(self) -> tuple[float, float] | None:
        """(centre, width) of pictures of numbers, where it was chosen, or has been found."""
        return self._window

    def prepared(self, scene: Scene, size: tuple[int, int], *, chose_view: bool) -> Scene:
        """The scene, framed so that annotation has room beside the box, unless somebody chose the view.

        Raises
        ------
        InputError, MissingExtraError
            If what is asked for can't be written into a picture of the scene.
        """
        check(self._annotation, scene)
        if chose_view or not self._annotation:
            return scene
        camera: Camera = with_room(scene.camera_for(size), scene, size, self._annotation)
        return replace(scene, camera=camera)

    def of(self, picture: NDArray, scene: Scene, path: str) -> NDArray:
        """The picture for a file of that name; with a warning where it is empty, or without one of its volumes."""
        if message := emptiness(picture, scene):
            warnings.warn(message, stacklevel=2)
        if is_exact(path):
            return picture
        if scene.mode in NUMBER_MODES:
            picture = self._numbers(picture, scene)
        if not self._annotation:
            return picture
        size = picture.shape[1], picture.shape[0]
        return annotate(
            picture,
            scene,
            size,
            self._annotation,
            transparent=self._transparent,
            window=self._window,
        )

    def _numbers(self, picture: NDArray, scene: Scene) -> NDArray:
        from texvol.scene import display

        if self._window is None and scene.coloring == "grey":
            self._window = display.found_window(picture, scene)
        return display.shown(picture, scene, window=self._window)

    def metadata(self, name: str, scene: Scene, path: str, settings: Mapping[str, Any] | None = None) -> dict[str, str]:
        """What the header of a picture file of that name says of its scene, and of how it is shown."""
        shown: dict[str, Any] = {}
        if scene.mode in NUMBER_MODES and self._window is not None:
            shown = {"window": self._window}
        return scene_metadata(name, scene, settings=settings or {}, display=shown, checksum=is_exact(path))
