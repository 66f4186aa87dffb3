"""Zarr of versions 2 and 3: OME-Zarr images with their levels and channels, and plain arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from texvol.formats import units
from texvol.formats.readers.channels import described, note, with_first
from texvol.formats.readers.samples import Choice, FileFault, Samples, once
from texvol.formats.stores.access import Store
from texvol.formats.stores.images import image_of
from texvol.formats.stores.ome import Image
from texvol.formats.stores.placing import layout_of, letters_of
from texvol.formats.stores.pyramid import checked_levels, levels_of
from texvol.formats.stores.sources import Layout, Reading
from texvol.formats.stores.statistics import statistics_of
from texvol.formats.stores.tensor_source import TensorSource
from texvol.scene.channel import Channel
from texvol.scene.large_volume import ChunkStatistics, Level
from texvol.util.locations import public

_MOST_CHANNELS = 10_000


def read(path: str, choice: Choice) -> Samples:
    """Return the levels of the chosen image, channel and time; no samples are read but a few for checks."""
    store = once(choice, "store", lambda: Store(path))
    store.look_up(["zarr.json", "labels/zarr.json"])  # in one round trip
    if choice.variable is not None or store.version(""):
        key = (choice.variable or "").strip("/")
        if not store.version(key):
            raise FileFault(f"has no array {key!r} (--variable)")
        return _array(store, key, choice)
    image, known = once(choice, "image", lambda: image_of(store, choice.image))
    return _image(store, image, known, choice)


def _array(store: Store, key: str, choice: Choice) -> Samples:
    """Return the samples of an array without metadata of OME."""
    if choice.image is not None:
        raise FileFault("is an array without images: leave --image out")
    (opened,) = once(choice, "arrays", lambda: store.open_arrays([key]))
    names = _dimension_names(store, key, opened.rank)
    letters = letters_of(names)
    choice = with_first(letters, opened.shape, choice)
    layout = layout_of(letters, opened.shape, choice, [str(each or "-") for each in names])
    source = TensorSource.of(opened, layout, "level 0", _reading(store, choice), store.check_alive)
    channels = described(letters, opened.shape)
    channel = channels[choice.channel] if channels and choice.channel is not None else None
    return Samples.of_levels((Level(source),), channels=channels, channel=channel, notes=note(channels, choice.channel))


def _dimension_names(store: Store, key: str, rank: int) -> list[str | None]:
    """Return the names of an array's dimensions, as version 3 and xarray write them."""
    node = store.json(f"{key}/zarr.json" if key else "zarr.json") or {}
    told = node.get("dimension_names") or (store.attributes(key) or {}).get("_ARRAY_DIMENSIONS")
    return list(told) if isinstance(told, list) and len(told) == rank else [None] * rank


def _image(store: Store, image: Image, known: list[str], choice: Choice) -> Samples:
    opened = once(choice, "arrays", lambda: store.open_arrays([each.key for each in image.datasets]))
    letters = "".join(axis.letter for axis in image.axes)
    for each, dataset in zip(opened, image.datasets, strict=True):
        if each.rank != len(letters):
            raise FileFault(
                f"its array {dataset.key} must have {len(letters)} axes as its metadata say, got {each.rank}"
            )
    sizes = opened[0].shape
    channels = _channels(image, sizes[letters.index("C")] if "C" in letters else 1)
    chosen = choice
    if choice.channel is None and len(channels) > 1:
        chosen = choice._replace(channel=next((each.number for each in channels if each.active), 0))
    names = [axis.name for axis in image.axes]
    layouts = [layout_of(letters, each.shape, chosen, names) for each in opened]
    reading = _reading(store, choice)
    sources = [TensorSource.of(each, layout, f"level {number}", reading, store.check_alive)
               for number, (each, layout) in enumerate(zip(opened, layouts, strict=True))]  # fmt: skip
    if choice.missing:  # the statistics of the store count values that are missing now
        statistics: list[ChunkStatistics | None] = [None] * len(layouts)
        stale: tuple[str, ...] = ()
    else:
        keys = [each.key for each in image.datasets]
        statistics, stale = statistics_of(store, reading.name, image.group, keys, sources)
    unit, factors, notes = units.common_length([_unit(image, layouts[0], axis) for axis in range(3)])
    scales = [_spatial(each.scale, layouts[0], factors, 1.0) for each in image.datasets]
    if not image.placed:
        scales = [[size / own for size, own in zip(sources[0].shape, each.shape, strict=True)] for each in sources]
        notes += ("its metadata have no coordinateTransformations: levels are placed by their sizes",)
    translations = [_spatial(each.translation, layouts[0], factors, 0.0) for each in image.datasets]
    levels, more = levels_of(sources, scales, translations, statistics)
    labels = choice.labels or image.is_label
    levels, check = (levels, None) if labels else checked_levels(levels, choice)
    return Samples.of_levels(
        levels, scales[0][::-1], translations[0][::-1], unit=unit, labels=labels, channels=channels,
        channel=None if len(channels) < 2 else channels[int(chosen.channel or 0)],
        **_own_place(store.attributes(image.group) or {}),
        images=tuple(known), check=check, notes=(*notes, *_about(image, known, channels, chosen), *more, *stale),
        **_times(image, letters, sizes, store.attributes(image.group) or {}),
    )  # fmt: skip


def _own_place(attributes: dict[str, Any]) -> dict[str, Any]:
    """Return what `texvol convert` writes that OME-Zarr has no words for: direction, space and unit of the values."""
    told = attributes.get("texvol")
    if not isinstance(told, dict):
        return {}
    found = {key: told[key] for key in ("space", "value_unit") if isinstance(told.get(key), str)}
    return found | ({"direction": told["direction"]} if "direction" in told else {})


def _reading(store: Store, choice: Choice) -> Reading:
    return Reading(public(store.path), tuple(choice.missing), bool(choice.missing_chunks))


def _channels(image: Image, count: int) -> tuple[Channel, ...]:
    """Return as many channels as there are, described where the metadata do; none of absurdly many."""
    if count > _MOST_CHANNELS:
        return ()
    told = {each.number: each for each in image.channels}
    return tuple(told.get(number, Channel(number)) for number in range(count))


def _unit(image: Image, layout: Layout, axis: int) -> str:
    stored = layout.order[axis]
    return "" if stored is None else units.length_unit(image.axes[stored].unit)


def _spatial(numbers: Sequence[float], layout: Layout, factors: Sequence[float], otherwise: float) -> list[float]:
    """Return numbers along z, y, x in the common unit, and `otherwise` along an axis that the array lacks."""
    return [otherwise if axis is None else numbers[axis] * factor
            for axis, factor in zip(layout.order, factors, strict=True)]  # fmt: skip


def _times(image: Image, letters: str, sizes: Sequence[int], attributes: dict[str, Any]) -> dict[str, Any]:
    """Return the times of all steps: those that `texvol convert` writes where they are uneven, else by the scale."""
    if "T" not in letters or sizes[letters.index("T")] > 10**6:
        return {}
    axis = letters.index("T")
    first, own = image.datasets[0], attributes.get("texvol")
    own = own if isinstance(own, dict) else {}
    times, unit = own.get("times"), own.get("time_unit")
    if not isinstance(times, list) or len(times) != sizes[axis] or not all(map(_is_number, times)):
        times = [first.translation[axis] + first.scale[axis] * number for number in range(sizes[axis])]
    return {"times": times, "time_unit": unit if isinstance(unit, str) else units.time_unit(image.axes[axis].unit)}


def _is_number(told: Any) -> bool:
    return isinstance(told, int | float) and not isinstance(told, bool) and math.isfinite(told)


def _about(image: Image, known: list[str], channels: tuple[Channel, ...], chosen: Choice) -> tuple[str, ...]:
    notes = []
    if len(known) > 1:
        notes.append(
            f"image {image.name or image.group or '0'}; the store has {', '.join(known)}; --image NAME chooses"
        )
    if len(channels) > 1:
        own = channels[int(chosen.channel or 0)]
        listed = ", ".join(f"{each.number} {each.name}".rstrip() for each in channels)
        notes.append(f"channel {f'{own.number} {own.name}'.rstrip()} of {len(channels)}: {listed}; --channel N chooses")
    return tuple(notes)
