"""Volumes and masks named in a picture's header: find their files and check that they are unchanged.

A volume is the one that was drawn if dimensions, position, kind of samples and, if the header has one, the checksum of
its values agree; a mask if it fits its volume and the checksum of its weights agrees.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from texvol.formats.pictures.scene_metadata import BLOCKS, COLORS, LABELS, checksum_of, kind_of
from texvol.provenance import parts
from texvol.provenance.metadata import Metadata
from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, TexvolError
from texvol.util.locations import is_remote

AnyVolume = Volume | str | os.PathLike[str] | None
ALWAYS = ("volume", "dimensions", "spacing")
KEYS = (*ALWAYS, "source", "origin", "direction", "type", "kind", "checksum", "mask")
_ADDED_KEYS = dict.fromkeys((*KEYS, "transfer_function"))
_MASK_KEYS = dict.fromkeys(("name", "source", "checksum"))
_MOST_DEMO_SAMPLES = 512  # along each axis, 0.5 GB: limits what a header can ask for
_SAME_POSITION = 1e-9  # of the spacing: rounding of different library versions

Folder = str | os.PathLike[str] | None
T = TypeVar("T")


def found_volume(metadata: Metadata, given: AnyVolume, folder: Folder) -> Volume:
    """Return the volume that was drawn, or raise InputError."""
    if isinstance(given, Volume):
        return _same_volume(metadata, given)
    source = metadata.part("source", parts.source) or {}
    if given is not None:
        return _same_volume(metadata, _loaded(metadata, os.fspath(given), source))
    if "built_in" in source:
        return _same_volume(metadata, _built_in(metadata, source))
    name = str(metadata.content["volume"])
    if metadata.told_how_to_read and not source:
        raise metadata.fault(f"names a volume without a file, {parts.quoted(name)}: give the volume as well")
    source = source or {"path": name}
    found = _first_accepted(metadata, source, folder, lambda volume: _same_volume(metadata, volume))
    if found is None:
        wanted = parts.quoted(source.get("path", name))
        raise metadata.fault(f"names the volume {wanted}, which is neither here nor beside the picture: give its path")
    return found


def found_mask(metadata: Metadata, volume: Volume, given: Mask | None, folder: Folder) -> Mask | None:
    """Return the mask of a drawn volume, or None if it had none; raise InputError if the mask is not found."""
    content = metadata.content.get("mask")
    if content is None:
        return None
    mask = metadata.inner(content, "the mask")
    mask.check_keys(_MASK_KEYS, ("name",))
    if given is not None:
        return _same_mask(mask, given, volume)
    source, fade = mask.part("source", parts.mask_source) or ({}, None)
    name = parts.quoted(source.get("path", mask.content["name"]))
    if not source:
        raise mask.fault(f"has no file, {name}: give the mask as well")

    def accepted(found: Volume) -> Mask:
        return _same_mask(mask, mask.checked(lambda: Mask.of(found, fade)), volume)

    found = _first_accepted(mask, source, folder, accepted)
    if found is None:
        raise mask.fault(f"names {name}, which is neither here nor beside the picture: give it as well")
    return found


def _first_accepted(
    metadata: Metadata, source: Mapping[str, Any], folder: Folder, accepted: Callable[[Volume], T]
) -> T | None:
    """Return `accepted` of the first file that fits the header, or None without files; raise the first file's fault."""
    first_fault: InputError | None = None
    for path in positions(source, folder):
        try:
            return accepted(_loaded(metadata, path, source))
        except InputError as error:  # another file of that name may fit
            first_fault = first_fault or error
    if first_fault is not None:
        raise first_fault
    return None


def found_added(
    metadata: Metadata, given: Sequence[AddedVolume | AnyVolume], folder: Folder
) -> tuple[AddedVolume, ...]:
    """Return the further volumes that were drawn; look for the files of those not `given`; raise InputError."""
    content = metadata.content.get("added")
    if content is None:
        return ()
    if not isinstance(content, list):
        raise metadata.fault(f"is not as texvol writes it: added must be a list, got {parts.quoted(content)}")
    all_given = [*given, *[None] * (len(content) - len(given))]
    return tuple(
        _added(metadata.inner(each, f"added volume {number}"), one, folder)
        for number, (each, one) in enumerate(zip(content, all_given, strict=False), 1)
    )


def _added(metadata: Metadata, given: AddedVolume | AnyVolume, folder: Folder) -> AddedVolume:
    metadata.check_keys(_ADDED_KEYS, (*ALWAYS, "source"))
    medium = metadata.part("transfer_function", parts.transfer_function)
    drawn, mask = (given.volume, given.mask) if isinstance(given, AddedVolume) else (given, None)
    volume = found_volume(metadata, drawn, folder)
    return AddedVolume(volume, medium, found_mask(metadata, volume, mask, folder))


def positions(source: Mapping[str, Any], folder: Folder) -> Iterator[str]:
    """Yield the existing paths at which the file may be, each once."""
    path, absolute = source.get("path", ""), source.get("absolute", "")
    candidates = [path]
    if folder is not None and path:
        candidates += [os.path.join(folder, path), os.path.join(folder, os.path.basename(path.rstrip("/\\")))]
    seen = set()
    if is_remote(path):
        yield path
        return
    for each in [*candidates, absolute]:
        # Reading a pipe or a device would block.
        if each and (os.path.isfile(each) or os.path.isdir(each)) and os.path.realpath(each) not in seen:
            seen.add(os.path.realpath(each))
            yield each


def _loaded(metadata: Metadata, path: str, source: Mapping[str, Any]) -> Volume:
    """Return the volume of that file, read and moved as before."""
    from texvol.formats.readers import ARGUMENTS, load

    told = {key: source[key] for key in ARGUMENTS if key in source}
    if not os.path.exists(told.get("label_names", "")):  # the header has the transfer function, names included
        told.pop("label_names", None)
    if not metadata.told_how_to_read:  # the header has the scene's spacing, the file's or an override
        told["spacing"] = metadata.part("spacing", lambda each: parts.numbers(each, 3))
    try:
        return _moved(load(path, **told), source)
    except TexvolError as error:
        raise metadata.fault(f"has a volume that can't be read: {error}") from None


def _moved(volume: Volume, source: Mapping[str, Any]) -> Volume:
    return volume.moved(source["transform"]) if "transform" in source else volume


def _built_in(metadata: Metadata, source: Mapping[str, Any]) -> Volume:
    from texvol.scene.demo import demo_volume

    samples = source.get("samples", 0)
    if source["built_in"] != "demo" or not 1 <= samples <= _MOST_DEMO_SAMPLES:
        raise metadata.fault(f"names an unknown built-in volume: {parts.quoted(dict(source))}")
    return metadata.checked(lambda: _moved(demo_volume(samples), source))


def _same_volume(metadata: Metadata, volume: Volume) -> Volume:
    """Return `volume` if it is the one that was drawn, else raise InputError."""
    dimensions = metadata.part("dimensions", lambda each: parts.numbers(each, 3)) or ()
    if dimensions != volume.dimensions:
        was, now = (" x ".join(f"{number:.12g}" for number in each) for each in (dimensions, volume.dimensions))
        raise metadata.fault(f"needs a volume of {was} samples, got {now} in {volume.name}")
    _check_position(metadata, volume, "spacing", (3,), volume.smallest_spacing)
    _check_position(metadata, volume, "origin", (3,), float(volume.spacing.max() + np.abs(volume.origin).max()))
    _check_position(metadata, volume, "direction", (3, 3), float(np.abs(volume.direction).max()))
    kind = metadata.part("kind", lambda each: parts.word(each, LABELS, BLOCKS, COLORS)) or ""
    if kind != kind_of(volume):
        then, since = (each or "values" for each in (kind, kind_of(volume)))
        raise metadata.fault(f"needs a volume of {then}, got {since} in {volume.name}")
    checksum = metadata.content.get("checksum")
    if checksum is not None and checksum != checksum_of(volume):
        raise metadata.fault(f"needs other values than those of {volume.name}: the file has changed, or is another one")
    return volume


def _same_mask(metadata: Metadata, mask: Mask, volume: Volume) -> Mask:
    """Return `mask` if it is the one that was drawn, else raise InputError."""
    metadata.checked(lambda: mask.check_fits(volume))
    checksum = metadata.content.get("checksum")
    if checksum is not None and checksum != checksum_of(mask):
        raise metadata.fault(f"needs other weights than those of {mask.name}: the file has changed, or is another one")
    return mask


def _check_position(metadata: Metadata, volume: Volume, what: str, shape: tuple[int, ...], scale: float) -> None:
    """Raise InputError if the volume's box is not at the position that was drawn."""
    was = metadata.part(what, lambda each: parts.array(each, shape))
    now = getattr(volume, what)
    if was is not None and not (np.abs(was - now) <= _SAME_POSITION * scale).all():
        then, since = (", ".join(f"{number:.12g}" for number in each.reshape(-1)) for each in (was, now))
        raise metadata.fault(f"needs a volume of {what} {then}, got {since} in {volume.name}")
