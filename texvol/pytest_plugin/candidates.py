"""Pictures from what a test passes: arrays, files, scenes, figures, images, and callables that return them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from texvol.comparison.limits import DRIVER_ATTRIBUTE
from texvol.comparison.pictures import Picture, read_picture
from texvol.pytest_plugin import foreign, repeats
from texvol.scene.scene import Classification, Scene
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.rendering.renderer import Renderer

# Default size of scenes' pictures: small enough for a repository and for the oracle.
DEFAULT_SIZE = 128, 128


class UnreadableError(InputError):
    """A picture file that can't be read."""


@dataclass(frozen=True)
class Candidate:
    """Picture that a test passes.

    Attributes
    ----------
    picture : Picture
        Mean of the repeats.
    repeats : tuple of Picture
        The repeats; empty if the picture was made once.
    scene : Scene or None
        Scene that the picture shows, if known.
    settings : mapping
        Settings of the drawing: `Renderer.settings`.
    stats : mapping
        `Renderer.stats`.
    renderer : Renderer or None
        Renderer that drew the picture.
    """

    picture: Picture
    repeats: tuple[Picture, ...] = ()
    scene: Scene | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    stats: Mapping[str, Any] = field(default_factory=dict)
    renderer: Renderer | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Size of the picture, (width, height)."""
        height, width = self.picture.pixels.shape[:2]
        return width, height

    @property
    def is_finite(self) -> bool:
        return bool(np.isfinite(self.picture.pixels).all())


@dataclass
class Request:
    """Arguments of a check, besides the picture."""

    name: str
    repeat: int
    driver: str | None
    scene: Scene | None
    renderer: Renderer | None
    options: dict[str, Any]  # of `Renderer.render`
    of_any: tuple[str, ...] = ()  # options that are valid without a scene
    drawn_as: tuple[Classification, int] | None = None  # classification and texture refinement of the reference


class Maker:
    """Maker of candidates; has one renderer for all scenes, created for the first scene."""

    def __init__(self) -> None:
        self._renderer: Renderer | None = None

    def renderer(self) -> Renderer:
        """The renderer for scenes without a renderer of their own."""
        if self._renderer is None:
            from texvol.rendering.renderer import Renderer

            self._renderer = Renderer()
        return self._renderer

    def close(self) -> None:
        """Close the renderer."""
        if self._renderer is not None:
            self._renderer.close()

    def candidate(self, thing: Any, request: Request) -> Candidate:
        """Return the candidate of what a test passes.

        Raises
        ------
        UnreadableError
            If a file can't be read.
        InputError
            If `thing` is no picture.
        """
        if isinstance(request.repeat, bool) or not isinstance(request.repeat, int) or request.repeat < 1:
            raise InputError(f"repeat must be an int of at least 1, got {request.repeat!r}")
        made = self._made(thing, request)
        if request.repeat == 1:
            return made
        if not callable(thing) and not isinstance(thing, Scene):
            raise InputError(
                f"picture must be a scene or a function if repeat is {request.repeat}, got {type(thing).__name__}; "
                "pass a function without arguments that returns a picture"
            )
        pictures = [made.picture, *(self._made(thing, request).picture for _ in range(request.repeat - 1))]
        if len({each.pixels.shape for each in pictures}) > 1:
            raise InputError(f"picture {request.name!r}: the repeats must have one size")
        return replace(made, picture=_mean(pictures), repeats=tuple(pictures))

    def _made(self, thing: Any, request: Request) -> Candidate:
        if callable(thing):
            thing = thing()
        if isinstance(thing, Scene):
            return self._drawn(thing, request)
        kind = type(thing).__name__
        if unknown := set(request.options) - set(request.of_any):
            raise InputError(f"{', '.join(sorted(unknown))}: options of drawing need a scene, got {kind}")
        if isinstance(thing, Picture):
            picture = thing
        elif isinstance(thing, str | os.PathLike):
            try:
                picture = read_picture(thing)
            except InputError as error:
                raise UnreadableError(str(error)) from None
        elif (found := foreign.array_of(thing)) is not None:
            array, program = found
            named = {} if program is None else {DRIVER_ATTRIBUTE: program}
            picture = Picture.of_array(array, request.name, named)
        elif isinstance(thing, np.ndarray) or hasattr(thing, "__array__") or hasattr(thing, "__array_interface__"):
            picture = Picture.of_array(np.asarray(thing), request.name)
        else:
            raise InputError(
                "picture must be an array, a path, a Scene, a matplotlib Figure, a Pillow image or a function that "
                f"returns these, got {kind}"
            )
        return Candidate(_labelled(picture, request), scene=request.scene)

    def _drawn(self, scene: Scene, request: Request) -> Candidate:
        from texvol.formats.pictures.scene_metadata import scene_metadata

        if request.scene is not None:
            raise InputError("scene must be left out if picture is a scene")
        renderer = request.renderer or self.renderer()
        options = {"size": DEFAULT_SIZE} | request.options
        if scene.classification == "auto":
            # A choice that hangs on a limit must not make a difference of pictures.
            classification, refinement = request.drawn_as or ("post", 1)
            scene, options = scene.classified_as(classification), {"texture_refinement": refinement} | options
        pixels = renderer.render(scene, **options)
        scene, attributes = renderer.drawn_scene or scene, renderer.attributes
        attributes |= scene_metadata(scene.volume.name, scene, settings=renderer.settings, checksum=True)
        picture = _labelled(Picture.of_array(pixels, request.name, attributes), request)
        return Candidate(picture, (), scene, renderer.settings, {}, renderer)


def _labelled(picture: Picture, request: Request) -> Picture:
    """Return the picture with the driver that the test names, and with its scene if the header holds no scene."""
    from texvol.formats.pictures.scene_metadata import ATTRIBUTE, scene_metadata

    named = {} if request.driver is None else {DRIVER_ATTRIBUTE: request.driver}
    scene = request.scene
    if scene is not None and ATTRIBUTE not in picture.attributes:
        named[ATTRIBUTE] = scene_metadata(scene.volume.name, scene, checksum=True)[ATTRIBUTE]
    return replace(picture, attributes={**picture.attributes, **named})


def _mean(pictures: list[Picture]) -> Picture:
    """Return the mean of the pictures' light; rounding of the format is averaged with it."""
    pixels = np.mean([each.pixels for each in pictures], axis=0, dtype=np.float64)
    if all(np.array_equal(each.pixels, pictures[0].pixels) for each in pictures):
        return pictures[0]
    mean = replace(pictures[0], pixels=np.asarray(pixels, np.float32))
    return replace(mean, attributes={**mean.attributes, **repeats.header_of(pictures, mean)})
