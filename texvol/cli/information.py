"""Metadata of a volume for machines, and as a page for people: the numbers for choosing a transfer function."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.cli.store_information import store_metadata, store_rows
from texvol.formats.readers import resampling
from texvol.scene.air import hounsfield_by
from texvol.scene.kinds import kind_of
from texvol.scene.large_volume import LargeVolume
from texvol.scene.lone_extremes import LoneExtreme, lone_extremes
from texvol.scene.looks import look_for, look_name
from texvol.scene.volume import Volume
from texvol.util.shown_text import shown_line
from texvol.util.statistics import chunks, finite

PERCENTAGES = (0.1, 1, 5, 25, 50, 75, 95, 99, 99.9)
BINS = 64
MOST_LABELS = 48  # labels listed
MOST_SORTED = 2**24  # samples used for percentiles; evenly spread ones if there are more

_TEXEL_BYTES = {"rgba8": 4, "rgba16f": 8, "rgba32f": 16}
_ROWS = 16
_LABELS_A_ROW = 6
_BAR = 44


def metadata(volume: Volume) -> dict[str, Any]:
    """Return metadata of a volume that JSON can hold; what is missing or not finite is None.

    Lengths are in world units, triples are x, y, z. `extent` is the box along the grid's axes; `box_min` and `box_max`
    are its bounds along the world's axes. Statistics are of finite values; `percentiles` use `percentile_samples` of
    them. In `memory`, `texture_bytes` has a number for each texel format; `gradient_bytes` is the size of the texture
    of values and gradients that `post` and `integrated` need for light or contours (`slab` and `extinction` store no
    gradient). `resampling` is None if the samples are those of the file; `notes` are the reader's choices.

    `kind` is what the values are taken for in a first picture, `kind_reason` says why, and `look` what it is drawn in.

    `labels` is None for measured values; for labels it has their `count`, label, name and number of samples of the
    first, and `names_from`, the file of the names, if there is one.
    `hounsfield` is "file" if the file says that values are Hounsfield units, "values" if the file names no unit and the
    values look like Hounsfield units, else None. `color` is True if each sample has its own colour; the value is then
    its amount. `lone_extremes` are values at the ends of the range that are far from all others: `value`, number of
    `samples`, distance in ranges of the other values (`times`), that range (`others`), and the text for `--missing`.

    Of a store, values are those of the samples that `values_of` counts, of a coarser level or in the middle, unless
    that is None; `store` has its levels, channels, images and times, and is None for any other file.
    """
    corners = volume.corners_from_centre + volume.centre
    seen = volume.overview
    low, high, mean, counts = _summary(seen.values)
    is_whole = volume.dtype.kind in "iu"
    percentiles, used = _percentiles(seen.values)
    edges, bins = _histogram(seen.values, low, high)
    return {
        "name": volume.name,
        "dimensions": list(volume.dimensions),
        "type": volume.dtype.name,
        "spacing": _numbers(volume.spacing),
        "unit": volume.unit,
        "value_unit": volume.value_unit,
        "hounsfield": hounsfield_by(seen) or None,
        **_kind(volume),
        "space": volume.space,
        "origin": _numbers(volume.origin),
        "direction": [_numbers(row) for row in volume.direction],
        "extent": _numbers(volume.spacing * volume.dimensions),
        "box_min": _numbers(corners.min(axis=0)),
        "box_max": _numbers(corners.max(axis=0)),
        "resampling": None if volume.resampling is None else dict(volume.resampling),
        "notes": list(volume.notes),
        "labels": _labels(seen),
        "color": volume.colors is not None,
        "extinction_unit": f"per {volume.unit or 'world unit'}",
        "samples": volume.size,
        **counts,
        "value_range": None if low is None or high is None else [_number(low, is_whole), _number(high, is_whole)],
        "mean": _number(mean),
        "lone_extremes": [_lone(each) for each in lone_extremes(seen)],
        "percentiles": percentiles,
        "percentile_samples": used,
        "histogram": {"edges": edges, "counts": bins},
        "memory": _memory(volume),
        "values_of": None if seen.shape == volume.shape else {"dimensions": list(seen.dimensions)},
        "store": store_metadata(volume),
    }


def text(metadata: dict[str, Any]) -> str:
    """Return a page of text about the volume from its `metadata`."""
    unit, memory = metadata["unit"], metadata["memory"]
    textures = ", ".join(f"{name} {_bytes(size)}" for name, size in memory["texture_bytes"].items())
    with_gradients = f"{_bytes(memory['gradient_bytes'])} (light, contours in post and integrated)"
    rows = [
        ("dimensions", f"{_row(metadata['dimensions'], ' x ')}  ({metadata['samples']} samples of {metadata['type']})"),
        ("spacing", f"{_row(metadata['spacing'], ' x ')} {unit or 'world units (the file names none)'}"),
        ("extent", f"{_row(metadata['extent'], ' x ')} {unit}".rstrip()),
        ("world", f"{_row(metadata['box_min'])}  to  {_row(metadata['box_max'])}"),
        ("axes", metadata["space"] or "the file does not name the directions of the world axes"),
        ("origin", _row(metadata["origin"])),
        ("direction", "; ".join(_row(row) for row in metadata["direction"])),
        ("extinction", metadata["extinction_unit"]),
        *(_titled("labels", _label_lines(metadata)) if metadata["labels"] else [("values", _values(metadata))]),
        *([("value unit", _unit_row(metadata))] if metadata["value_unit"] or metadata["hounsfield"] else []),
        *_titled("kind", _kind_lines(metadata)),
        *([("colour", "each sample has its own; the value is its amount")] if metadata["color"] else []),
        *([("", _overview_line(metadata["values_of"]))] if metadata["values_of"] else []),
        *_titled("alone", map(_lone_line, metadata["lone_extremes"])),
        ("not finite", f"{metadata['nan_count']} NaN, {metadata['inf_count']} infinite"),
        ("memory", f"data {_bytes(memory['data_bytes'])}; texture {textures}"),
        ("", f"texture with gradients {with_gradients}"),
    ]
    if metadata["resampling"] is not None:
        rows += _titled("resampled", resampling.text(metadata["resampling"]))
    if metadata["store"] is not None:
        rows += store_rows(metadata["store"])
    rows += [("note", note) for note in metadata["notes"]]
    page = [metadata["name"], "", *(f"{name:<12}{value}" for name, value in rows)]
    if metadata["value_range"] is not None and not metadata["labels"]:
        page += ["", *_percentile_lines(metadata), "", *_histogram_lines(metadata["histogram"])]
    return "\n".join(map(shown_line, page))


def _memory(volume: Volume) -> dict[str, Any]:
    """Return bytes of the samples, and of their textures without gradients, by texel format, and with gradients."""
    dtype, colors = volume.dtype, volume.colors
    # A texel of value and gradient has four numbers: of 16 bits for 8- and 16-bit integers, else of 32 bits.
    gradient_texel = 4 * (2 if dtype.kind in "iu" and dtype.itemsize <= 2 else 4)
    return {
        "data_bytes": volume.size * dtype.itemsize + (0 if colors is None else colors.nbytes),
        "texture_bytes": {name: volume.size * size for name, size in _TEXEL_BYTES.items()},
        "gradient_bytes": volume.size * gradient_texel,
    }


def _labels(volume: Volume) -> dict[str, Any] | None:
    if not volume.labels:
        return None
    from texvol.scene.label_counts import label_counts
    from texvol.scene.label_names import names_of, table_of

    found, table = label_counts(volume), table_of(volume)
    rows = zip(found.labels[:MOST_LABELS].tolist(), found.counts[:MOST_LABELS].tolist(), strict=True)
    known = names_of(volume, found.labels.tolist())
    first = [
        {"label": label, "samples": count} | ({"name": known[label]} if label in known else {}) for label, count in rows
    ]
    names_from = {} if table is None else {"names_from": table.source, "named": len(known)}
    return {"count": len(found.labels), "first": first} | names_from


def _lone(extreme: LoneExtreme) -> dict[str, Any]:
    found = extreme._asdict()
    return {("missing" if key == "text" else key): value for key, value in found.items()}


def _kind(volume: Volume) -> dict[str, str]:
    kind = kind_of(volume)
    in_memory = kind.name == "labels" and not isinstance(volume, LargeVolume)  # whose labels are counted anyway
    reason = look_for(volume).reason if in_memory else kind.reason
    return {"kind": kind.name, "kind_reason": reason, "look": look_name(volume)}


def _kind_lines(metadata: dict[str, Any]) -> list[str]:
    """Return what the first picture takes the values for, and why."""
    drawn = f"drawn in the look {metadata['look']} unless --tf says another"
    if metadata["kind"] == "labels" and not metadata["labels"]:
        drawn = "drawn as labels; --no-labels draws them as values"
    return [f"{metadata['kind']}, since {metadata['kind_reason']}", drawn]


def _overview_line(values_of: dict[str, Any]) -> str:
    return f"values are those of {_row(values_of['dimensions'], ' x ')} samples of the store"


def _values(metadata: dict[str, Any]) -> str:
    extent = metadata["value_range"]
    return f"{_row(extent, ' to ')}, mean {_digits(metadata['mean'])}" if extent else "none is finite"


def _unit_row(metadata: dict[str, Any]) -> str:
    if metadata["hounsfield"] == "values":
        return "assumed to be Hounsfield units, by range and fraction of air; the file names no unit"
    return "HU, Hounsfield units" if metadata["hounsfield"] else metadata["value_unit"]


def _titled(title: str, lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield rows of lines under one title."""
    for number, line in enumerate(lines):
        yield "" if number else title, line


def _lone_line(lone: dict[str, Any]) -> str:
    count = "1 sample" if lone["samples"] == 1 else f"{lone['samples']} samples"
    low, high = map(_digits, lone["others"])
    far = f"far from all others ({low} to {high})"
    return f"{lone['missing']} in {count}, {far}: if it marks missing samples, --missing {lone['missing']}"


def _label_lines(metadata: dict[str, Any]) -> list[str]:
    """Return a line with the number of labels, and lines that list the first labels."""
    labels = metadata["labels"]
    listed = [f"{each['label']}: {each['samples']}" for each in labels["first"]]
    more = labels["count"] - len(listed)
    count = f"{labels['count']}, from {_row(metadata['value_range'], ' to ')}, with numbers of samples"
    count += f"; {more} more are not listed" if more else ""
    if "names_from" not in labels:
        return [count, *(", ".join(listed[at : at + _LABELS_A_ROW]) for at in range(0, len(listed), _LABELS_A_ROW))]
    names = f"{labels['named']} have names, from {labels['names_from']}"
    rows = zip(listed, labels["first"], strict=True)
    return [count, names, *(f"{line} {each.get('name', '')}".rstrip() for line, each in rows)]


def _summary(values: NDArray[Any]) -> tuple[Any, Any, float | None, dict[str, int]]:
    """Return smallest, largest and mean finite value, and the numbers of finite, NaN and infinite values."""
    low = high = None
    mean, seen, nans = 0.0, 0, 0
    for chunk in chunks(values):
        known = finite(chunk)
        if known.size < chunk.size:
            nans += int(np.isnan(chunk).sum())
        if not known.size:
            continue
        first, last = known.min(), known.max()
        low, high = (first, last) if low is None else (min(low, first), max(high, last))
        seen += known.size
        # Divided before it is summed: the sum of values near 1e308 would be infinite.
        mean += float((known.astype(np.float64) / known.size).sum() - mean) * (known.size / seen)
    counts = {"finite_count": seen, "nan_count": nans, "inf_count": values.size - seen - nans}
    return low, high, mean if seen else None, counts


def _percentiles(values: NDArray[Any]) -> tuple[dict[str, float | None], int]:
    """Return percentiles of the finite values, and the number of samples used."""
    step = -(-values.size // MOST_SORTED)
    # With a step that shares a factor with a dimension, some columns would always be sampled and some never.
    while step > 1 and any(gcd(step, size) > 1 for size in values.shape):
        step += 1
    samples = finite(values.reshape(-1)[::step])
    if samples.dtype == np.float16:
        samples = samples.astype(np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        found = np.percentile(samples, PERCENTAGES) if samples.size else [None] * len(PERCENTAGES)
    by_name = {f"{percentage:g}": _number(number) for percentage, number in zip(PERCENTAGES, found, strict=True)}
    return by_name, samples.size


def _histogram(values: NDArray[Any], low: Any, high: Any) -> tuple[list[float], list[int]]:
    """Return edges and counts of equal bins from `low` to `high`; integers get half a step more at both ends."""
    if low is None:
        return [], []
    is_whole = values.dtype.kind in "iu"
    bins = min(BINS, int(high) - int(low) + 1) if is_whole else BINS
    begin, end = (float(low) - 0.5, float(high) + 0.5) if is_whole else (float(low), float(high))
    width = end / 2 - begin / 2  # half of the range: the whole range of -1e308 to 1e308 is infinite
    if width <= 0 or not np.isfinite(1 / width):
        return [begin, end], [sum(finite(chunk).size for chunk in chunks(values))]
    counts = np.zeros(bins, np.int64)
    for chunk in chunks(values):
        positions = (finite(chunk).astype(np.float64) / 2 - begin / 2) / width * bins
        counts += np.bincount(np.clip(positions.astype(np.int64), 0, bins - 1), minlength=bins)
    fractions = np.linspace(0, 1, bins + 1)
    edges = begin * (1 - fractions) + end * fractions
    return [float(edge) for edge in edges], [int(count) for count in counts]


def _numbers(triple: NDArray[Any]) -> list[float | None]:
    return [_number(number) for number in triple]


def _number(number: Any, is_whole: bool = False) -> float | int | None:
    if number is None or not np.isfinite(number):
        return None
    return int(number) if is_whole else float(number)


def _percentile_lines(metadata: dict[str, Any]) -> list[str]:
    columns = [(f"{name}%", _digits(number)) for name, number in metadata["percentiles"].items()]
    widths = [max(map(len, column)) for column in columns]
    lines = [
        f"{title:12}" + "  ".join(f"{cell:>{width}}" for cell, width in zip(cells, widths, strict=True))
        for title, cells in zip(("percentile", "value"), zip(*columns, strict=True), strict=True)
    ]
    used, finite = metadata["percentile_samples"], metadata["finite_count"]
    if used < finite:
        lines.append(f"            from {used} of {finite} samples, evenly spread")
    return lines


def _histogram_lines(histogram: dict[str, Any]) -> list[str]:
    """Return rows of a few bins each, with a bar as long as the logarithm of the count."""
    edges, counts = histogram["edges"], histogram["counts"]
    bins = -(-len(counts) // _ROWS)
    rows = [(edges[at], sum(counts[at : at + bins])) for at in range(0, len(counts), bins)]
    most = max(count for _, count in rows)
    starts = [_digits(start) for start, _ in rows]
    width = max(len(start) for start in starts)
    end = _digits(edges[-1])
    lines = [f"histogram   samples from each value up to the next row's, the last up to {end}; bars are logarithmic"]
    for start, (_, count) in zip(starts, rows, strict=True):
        bar = "█" * max(round(_BAR * np.log1p(count) / np.log1p(most)), 1 if count else 0)
        lines.append(f"  {start:>{max(width, 8)}}  {bar:<{_BAR}}  {count}".rstrip())
    return lines


def _digits(number: float | None) -> str:
    return "-" if number is None else f"{number:.6g}"


def _row(numbers: list[Any], between: str = ", ") -> str:
    return between.join(str(number) if isinstance(number, int) else _digits(number) for number in numbers)


def _bytes(count: float) -> str:
    for unit in ("bytes", "KiB", "MiB", "GiB"):
        if count < 1024:
            return f"{count:.4g} {unit}"
        count /= 1024
    return f"{count:.4g} TiB"
