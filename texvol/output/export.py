"""Export of drawn pictures to files: numbers as grey or colours, annotation, and metadata for the header."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from texvol.annotation import Annotation, annotate, check, with_room
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.scene import display
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.slicing.slabs import slabs_crossed

if TYPE_CHECKING:
    from texvol.options.scene_options import SceneOptions

_FEW = 32  # spacing of pixels that are checked first for emptiness


def out_of_view(scene: Scene, size: tuple[int, int]) -> list[Volume]:
    """Return the volumes whose box no pixel's ray meets in front of the eye."""
    camera = scene.completed(size).camera
    return [volume for volume in scene.volumes if not slabs_crossed(volume, camera, volume.radius, size)]


def emptiness_warning(picture: NDArray, scene: Scene) -> str | None:
    """Return a warning if the picture is empty, or if one of several volumes is outside the view; else None."""
    size = picture.shape[1], picture.shape[0]
    opacity = picture[..., 3]
    shows_nothing = not (opacity[::_FEW, ::_FEW].any() or opacity.any())
    if not (shows_nothing or scene.added):
        return None
    outside = out_of_view(scene, size)
    if outside and len(outside) < len(scene.volumes):
        return f"{', '.join(volume.name for volume in outside)} is outside the view"
    if not shows_nothing:
        return None
    if outside:
        subject = "all volumes are" if scene.added else "the volume is"
        return f"the picture is empty: {subject} outside the view"
    if scene.cutting:
        return "the picture is empty: clip planes and crop box hide everything"
    if any(mask is not None for mask in (scene.mask, *(each.mask for each in scene.added))):
        return "the picture is empty: the mask hides everything"
    return "the picture is empty: nothing in the volume is visible"


def is_exact(path: str) -> bool:
    """True if a file of that name holds the numbers of a picture, not an 8-bit view of them."""
    return Path(path).suffix.lower() == ".exr"


class PictureExport:
    """Conversion of drawn pictures to the contents of files.

    If no window of numbers is chosen, that of the first picture is used for all. Annotation is drawn into 8-bit files,
    never into an EXR file.
    """

    def __init__(self, scene_options: SceneOptions, annotation: Annotation | None = None) -> None:
        self.window = scene_options.window  # of numbers: (centre, width), if chosen or found from a picture
        self._transparent = scene_options.transparent
        self._annotation = annotation or Annotation()

    def prepared(self, scene: Scene, size: tuple[int, int], *, chose_view: bool) -> Scene:
        """Return the scene, framed so that annotation has room beside the box unless the user chose the view.

        Raises
        ------
        InputError, MissingExtraError
            If the annotation can't be drawn into a picture of the scene.
        """
        check(self._annotation, scene)
        if chose_view or not self._annotation:
            return scene
        return replace(scene, camera=with_room(scene.completed(size).camera, scene, size, self._annotation))

    def of(self, picture: NDArray, scene: Scene, path: str) -> NDArray:
        """Return the picture for a file of that name; warn if it is empty or lacks one of its volumes."""
        if message := emptiness_warning(picture, scene):
            warnings.warn(message, stacklevel=2)
        if is_exact(path):
            return picture
        if scene.mode in display.NUMBER_MODES:
            if self.window is None and scene.coloring == "grey":
                self.window = display.found_window(picture, scene)
            picture = display.shown(picture, scene, window=self.window)
        if not self._annotation:
            return picture
        size = picture.shape[1], picture.shape[0]
        return annotate(picture, scene, size, self._annotation, transparent=self._transparent, window=self.window)

    def metadata(self, name: str, scene: Scene, path: str, settings: Mapping[str, Any] | None = None) -> dict[str, str]:
        """Return the metadata of a picture file's header: its scene, the window of its numbers, and measures."""
        shown: dict[str, Any] = {}
        if scene.mode in display.NUMBER_MODES and self.window is not None:
            shown = {"window": self.window}
        if self._annotation.measures:
            shown["measures"] = [each.as_table() for each in self._annotation.measures]
        return scene_metadata(name, scene, settings=settings or {}, display=shown, checksum=is_exact(path))
