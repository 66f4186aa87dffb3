"""Frames of a sequence: what is chosen for the first one holds for all, so that nothing flickers."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from texvol.rendering.picture import Picture
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Classification, Scene


class DrawsPictures(Protocol):
    """Renderer, as frames need it; see `texvol.rendering.renderer.Renderer`."""

    drawn_scene: Scene | None

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last picture again."""

    @property
    def uniform_settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last scene again in slabs of one thickness, the thinnest of tiles."""

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the last picture's header."""

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last picture."""

    @property
    def render(self) -> Callable[..., Picture]:
        """Function that returns a scene's picture."""


@dataclass(frozen=True)
class Kept:
    """Choices that were made for the first frame of a sequence and hold for the others."""

    accuracy: dict[str, Any]  # arguments of `Renderer.render`
    classification: Classification
    attributes: dict[str, str]  # of the headers of all pictures
    estimate: dict[str, Any]  # statistics of the estimated error if an error was asked for


@dataclass(frozen=True)
class Frame:
    """Picture of a sequence, with the scene and the settings by which it was drawn."""

    picture: Picture
    scene: Scene
    settings: dict[str, Any]
    kept: Kept


def drawn_one_by_one(
    renderer: DrawsPictures,
    scenes: Iterable[Scene],
    size: tuple[int, int],
    views: int,
    accuracy: dict[str, Any],
    kept: Kept | None = None,
) -> Generator[Frame, None, None]:
    """Yield the frames of scenes, each when it is asked for.

    Parameters
    ----------
    views : int
        Number of pictures of each scene, from different sides.
    accuracy : dict
        Arguments of `Renderer.render` for the first frame.
    kept : Kept, optional
        Choices of the first frame if that has been drawn already.
    """
    for scene in scenes:
        frame = frame_of(renderer, scene, size, views, accuracy, kept)
        kept = frame.kept
        yield frame


def frame_of(
    renderer: DrawsPictures,
    scene: Scene,
    size: tuple[int, int],
    views: int,
    accuracy: dict[str, Any],
    kept: Kept | None,
) -> Frame:
    """Draw a frame: the first one of a sequence if nothing is `kept` from another."""
    if kept is not None:
        scene, accuracy = scene.classified_as(kept.classification), kept.accuracy
    picture = renderer.render(scene, size, views=views, **accuracy)
    drawn = renderer.drawn_scene or scene
    return Frame(picture, drawn, renderer.settings, kept or _kept(renderer, drawn, accuracy))


def _kept(renderer: DrawsPictures, drawn: Scene, accuracy: dict[str, Any]) -> Kept:
    """Return the choices of the picture that was drawn last."""
    kept: dict[str, Any] = {name: renderer.settings[name] for name in ("texture_refinement", "shadow_nodes")}
    estimate = {}
    if accuracy.get("max_error") is not None:
        names = ("texture_format", "target_format", "early_termination")
        kept |= {"max_error": None, "of": "own", "level_error": renderer.settings.get("level_error")}
        kept |= {name: renderer.settings[name] for name in names}
        kept["interpolation"] = renderer.settings.get("interpolation", "driver")
        kept["slab_thickness"] = renderer.uniform_settings["slab_thickness"]  # of the thinnest slabs, if tiles differ
        estimate = {"estimated_error_of_first_view": renderer.stats["estimated_error"]}
    elif accuracy.get("sampling_rate") is None and not isinstance(drawn.volume, LargeVolume):
        kept |= {name: renderer.settings[name] for name in ("slab_thickness", "early_termination")}
        kept["adaptive"] = renderer.settings.get("adaptive", "off")
    return Kept(accuracy | kept, drawn.classification, renderer.attributes, estimate)
