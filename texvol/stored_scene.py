"""Scenes out of pictures: what `scene_facts` wrote into a header, with its volume found again.

The header is a text that anyone may have changed. Each part becomes what it stands for by way of the checks that it
goes through elsewhere, and whatever is wrong is one line that names the picture and the part. A volume counts as found
when its dimensions, its place in the world and, where the header has a checksum, its values are those that were drawn.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol import stored_parts as parts
from texvol.camera import Camera
from texvol.cutting import checked_crop
from texvol.display import NUMBER_MODES, checked_window, shown
from texvol.errors import InputError, TexvolError
from texvol.geometry import Mesh
from texvol.gradient import Estimator
from texvol.lighting import DepthCue
from texvol.scene import Scene
from texvol.scene_facts import ATTRIBUTE, BY_TRANSFER_FUNCTION, FORMAT, checksum_of
from texvol.stored_geometry import geometry_from_facts
from texvol.transfer.files import from_content
from texvol.volume import Volume

AnyVolume = Volume | str | os.PathLike[str] | None
_MOST_CHARACTERS = 64 << 20  # as many as of a transfer function, which is the longest part
_ALWAYS = ("volume", "dimensions", "spacing", "classification", "background")
_KEYS = dict.fromkeys(
    (*_ALWAYS, "format", "source", "origin", "direction", "type", "checksum", "mode", "isovalue", "gradient")
    + ("lighting", "depth_cue", "camera", "transfer_function", "clip", "crop", "caps", "geometry")
    + ("settings", "window", "colors")
)
_MOST_DEMO_SAMPLES = 512  # along each axis, 0.5 GB: a header must not be able to ask for more
_SAME_PLACE = 1e-9  # of the spacing: what another version of a library may make of the same file

T = TypeVar("T")


@dataclass(frozen=True)
class StoredScene:
    """A scene as a picture's header has it.

    Attributes
    ----------
    scene : Scene
    settings : mapping
        Arguments with which `Renderer.render` draws the very picture again; empty where the oracle drew it.
    window : (centre, width), optional
        What 8 bits show of numbers.
    by_transfer_function : bool
        Whether numbers in 8 bits have the colours of the transfer function.
    name : str
        What messages call it: the picture.
    """

    scene: Scene
    settings: Mapping[str, Any] = field(default_factory=dict)
    window: tuple[float, float] | None = None
    by_transfer_function: bool = False
    name: str = "scene"

    @property
    def slab_thickness(self) -> float | None:
        """World units; None where the picture was not drawn in slabs, or does not say."""
        return self.settings.get("slab_thickness")

    @property
    def shows_numbers(self) -> bool:
        """Whether the pixels of its picture are data, and not light."""
        return self.scene.mode in NUMBER_MODES

    def in_eight_bits(self, picture: NDArray) -> NDArray[np.float64]:
        """What a file of 8 bits is meant to hold of the scene's picture: colours in [0, 1], linear, premultiplied."""
        if self.shows_numbers:
            by_matter = self.by_transfer_function
            picture = shown(picture, self.scene, window=self.window, use_transfer_function=by_matter)
        return np.clip(np.asarray(picture, np.float64), 0.0, 1.0)


def stored_scene_of(
    attributes: Mapping[str, str],
    *,
    name: str,
    folder: str | os.PathLike[str] | None = None,
    volume: AnyVolume = None,
) -> StoredScene:
    """The scene in a picture's attributes; see `scene_from_facts`.

    Raises
    ------
    InputError
        If they hold none.
    """
    if ATTRIBUTE not in attributes:
        raise InputError(f"{name}: has no scene in its header ({ATTRIBUTE}), where texvol writes it in EXR and PNG")
    return scene_from_facts(attributes[ATTRIBUTE], name=name, folder=folder, volume=volume)


def scene_from_facts(
    text: str, *, name: str, folder: str | os.PathLike[str] | None = None, volume: AnyVolume = None
) -> StoredScene:
    """The scene that a picture's header describes.

    Parameters
    ----------
    text : str
        The attribute "texvol:scene".
    name : str
        The picture, for messages.
    folder : path, optional
        Where the picture is: its volume is looked for from the current folder, from there, and where it was.
    volume : Volume or path, optional
        Instead of looking for it. It still has to be the one that was drawn.

    Raises
    ------
    InputError
        If the text is not such a header, or its volume is not found or has changed.
    """
    facts = _Facts(text, name)

    def meshes(content: Any) -> tuple[Mesh, ...]:
        return geometry_from_facts(content, lambda fact: _places(fact, folder))

    # What does not need the volume first: it may take long to read.
    settings = facts.part("settings", parts.settings) or {}
    window = facts.part("window", lambda each: checked_window(parts.numbers(each, 2)))
    colors = facts.part("colors", _colors)
    described: dict[str, Any] = {
        "transfer_function": facts.part("transfer_function", lambda each: from_content(each, "transfer function")),
        "camera": facts.part("camera", lambda each: parts.made(Camera, each)),
        "lighting": facts.part("lighting", parts.lighting),
        "depth_cue": facts.part("depth_cue", lambda each: parts.made(DepthCue, each)),
        "background": facts.part("background", lambda each: parts.numbers(each, 3)),
        "isovalue": facts.part("isovalue", parts.number),
        "gradient": facts.part("gradient", lambda each: parts.made(Estimator, each)) or Estimator(),
        "clip": facts.part("clip", parts.clip_planes) or (),
        "crop": facts.part("crop", checked_crop),
        "caps": facts.part("caps", parts.switch) or False,
        "geometry": facts.part("geometry", meshes) or (),
    } | {key: facts.content[key] for key in ("classification", "mode") if key in facts.content}
    found = _found_volume(facts, volume, folder)
    scene = facts.checked(lambda: Scene(found, **described))
    return StoredScene(scene, settings, window, colors == BY_TRANSFER_FUNCTION, name)


class _Facts:
    """A header, parsed, and a way to say what is wrong with it."""

    def __init__(self, text: str, name: str) -> None:
        self.name = name
        try:
            content = json.loads(text) if len(text) <= _MOST_CHARACTERS else None
        except (ValueError, RecursionError) as error:
            raise self.fault(f"is not JSON: {error}") from None
        if not isinstance(content, dict):
            raise self.fault(f"is not a JSON object of at most {_MOST_CHARACTERS >> 20} MB")
        self.content: dict[str, Any] = content
        version = content.get("format", 1)
        if version not in (1, FORMAT):
            raise self.fault(f"is of format {parts.quoted(version)}, and this texvol reads up to {FORMAT}")
        missing = [key for key in _ALWAYS if content.get(key) is None]
        if missing:
            raise self.fault(f"lacks {', '.join(missing)}")
        self.checked(lambda: parts.check_keys(content, _KEYS))

    @property
    def told_how_to_read(self) -> bool:
        """Whether a volume from a file would have said how it was read: texvol 0.3 wrote its name alone."""
        return "format" in self.content

    def fault(self, reason: object) -> InputError:
        """An error on this header."""
        return InputError(f"{self.name}: the scene in its header {' '.join(str(reason).split())}")

    def checked(self, make: Callable[[], T]) -> T:
        """What `make` returns; whatever it raises says whose header it was."""
        try:
            return make()
        except (TypeError, ValueError, OverflowError, RecursionError) as error:
            raise self.fault(f"is none that texvol writes: {error}") from None

    def part(self, key: str, make: Callable[[Any], T]) -> T | None:
        """What stands under a key, made into what it means; None where nothing does."""
        if self.content.get(key) is None:
            return None
        return self.checked(lambda: _named(key, make, self.content[key]))


def _found_volume(facts: _Facts, given: AnyVolume, folder: str | os.PathLike[str] | None) -> Volume:
    """The volume that was drawn, or InputError."""
    if isinstance(given, Volume):
        return _same_volume(facts, given)
    source = facts.part("source", parts.source) or {}
    if given is not None:
        return _same_volume(facts, _loaded(facts, os.fspath(given), source))
    if "built_in" in source:
        return _same_volume(facts, _built_in(facts, source))
    name = str(facts.content["volume"])
    if facts.told_how_to_read and not source:
        raise facts.fault(f"is of a volume without a file, {parts.quoted(name)}: give the volume as well")
    first_fault: InputError | None = None
    for path in _places(source or {"path": name}, folder):
        try:
            return _same_volume(facts, _loaded(facts, path, source))
        except InputError as error:  # another file of that name may be the one
            first_fault = first_fault or error
    if first_fault is not None:
        raise first_fault
    wanted = parts.quoted(source.get("path", name))
    raise facts.fault(f"is of the volume {wanted}, which is neither here nor beside the picture: give its path")


def _places(source: Mapping[str, Any], folder: str | os.PathLike[str] | None) -> Iterator[str]:
    """Where there is something that may be the volume, each place once."""
    path, absolute = source.get("path", ""), source.get("absolute", "")
    candidates = [path]
    if folder is not None and path:
        candidates += [os.path.join(folder, path), os.path.join(folder, os.path.basename(path.rstrip("/\\")))]
    seen = set()
    for each in [*candidates, absolute]:
        # A pipe or a device would be waited for.
        if each and (os.path.isfile(each) or os.path.isdir(each)) and os.path.realpath(each) not in seen:
            seen.add(os.path.realpath(each))
            yield each


def _loaded(facts: _Facts, path: str, source: Mapping[str, Any]) -> Volume:
    """The volume of that file, read as it was."""
    from texvol.readers import ARGUMENTS, load

    told = {key: source[key] for key in ARGUMENTS if key in source}
    if not facts.told_how_to_read:  # the scene's spacing, whether it was the file's or not
        told["spacing"] = facts.part("spacing", lambda each: parts.numbers(each, 3))
    try:
        return load(path, **told)
    except TexvolError as error:
        raise facts.fault(f"has a volume that can't be read: {error}") from None


def _built_in(facts: _Facts, source: Mapping[str, Any]) -> Volume:
    from texvol.demo import demo_volume

    samples = source.get("samples", 0)
    if source["built_in"] != "demo" or not 1 <= samples <= _MOST_DEMO_SAMPLES:
        raise facts.fault(f"is of a built-in volume that there is none of: {parts.quoted(dict(source))}")
    return demo_volume(samples)


def _same_volume(facts: _Facts, volume: Volume) -> Volume:
    """`volume`, if it is the one that was drawn."""
    dimensions = facts.part("dimensions", lambda each: parts.numbers(each, 3)) or ()
    if dimensions != volume.dimensions:
        was, now = (" x ".join(f"{number:.12g}" for number in each) for each in (dimensions, volume.dimensions))
        raise facts.fault(f"is of a volume of {was} samples, and {volume.name} has {now}")
    _check_place(facts, volume, "spacing", (3,), volume.smallest_spacing)
    _check_place(facts, volume, "origin", (3,), float(volume.spacing.max() + np.abs(volume.origin).max()))
    _check_place(facts, volume, "direction", (3, 3), float(np.abs(volume.direction).max()))
    checksum = facts.content.get("checksum")
    if checksum is not None and checksum != checksum_of(volume):
        raise facts.fault(f"is of other values than those of {volume.name}: it has changed since, or is another")
    return volume


def _check_place(facts: _Facts, volume: Volume, what: str, shape: tuple[int, ...], scale: float) -> None:
    """InputError if the volume's box lies elsewhere than the one that was drawn."""
    was = facts.part(what, lambda each: parts.array(each, shape))
    now = getattr(volume, what)
    if was is not None and not (np.abs(was - now) <= _SAME_PLACE * scale).all():
        then, since = (", ".join(f"{number:.12g}" for number in each.reshape(-1)) for each in (was, now))
        raise facts.fault(f"is of a volume of {what} {then}, and {volume.name} has {since}")


def _named(key: str, make: Callable[[Any], T], content: Any) -> T:
    """What `make` makes of a part; its error says which part."""
    try:
        return make(content)
    except InputError as error:
        message = str(error)
        raise InputError(message if message.startswith(key.replace("_", " ")) else f"{key}: {message}") from None


def _colors(content: Any) -> str:
    if content != BY_TRANSFER_FUNCTION:
        raise InputError(f"{BY_TRANSFER_FUNCTION} is wanted, and not {parts.quoted(content)}")
    return BY_TRANSFER_FUNCTION
