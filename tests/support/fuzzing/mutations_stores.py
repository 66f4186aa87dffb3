"""Damage to stores of many files: their JSON as such, chunks and shards, files that are missing, and links."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from random import Random
from typing import Any

from support.fuzzing.mutations import damaged

Files = dict[str, bytes]


class Link(bytes):
    """In place of a file's content: what it is a symbolic link to."""


_HUGE = (2**31, 2**40, 2**62, 2**63, 2**64, 10**30)
_NUMBERS = (0, -1, 1, 2, 3, 7, 64, 1000, 10**6, *_HUGE, -(2**63), 0.5, 1e-320, 1e-30, 1e30, 1e308, -1.5)
_ODD: tuple[Any, ...] = (
    None, True, False, "", "0", "zyx", "a" * 300, "\0", "\ud800", "\x1b[31m", [], {}, [[]], [{}], [None], {"a": {}},
    float("nan"), float("inf"), float("-inf"), *_NUMBERS, [0], [1, 2], [-1] * 3, [2**40] * 3, [1] * 40, list("zyx"),
)  # fmt: skip
_PATHS = (
    "..", "../..", "../../../../etc", "/etc", "/", ".", "", "0/..", "0/../0", "./0", "0/", "//0", "9", "a\0b", "0/c",
    "zarr.json", ".zarray", "labels", "1", "a" * 5000, "~", "%2e%2e", "file:///etc", "s3://a/b", "\\..\\..", "0\n1",
)  # fmt: skip
_WORDS = {
    "data_type": ("uint8", "int64", "float64", "float16", "complex64", "bool", "r16", "bfloat16", "string", "int4"),
    "dtype": ("|u1", ">i4", "<f8", "<c8", "|b1", "|S5", "|O", "<M8[s]", "<f2", [["a", "<i2"]]),
    "type": ("space", "time", "channel", "scale", "translation", "identity", "affine"),
    "name": ("z", "y", "x", "t", "c", "gzip", "zstd", "blosc", "bytes", "crc32c", "transpose", "sharding_indexed"),
    "version": ("0.1", "0.4", "0.5", "0.6", "9", 0.4, None),
    "node_type": ("array", "group", "thing"),
    "order": ("C", "F", "K"),
    "id": ("zlib", "zstd", "blosc", "lz4", "none", "gzip"),
    "dimension_separator": ("/", ".", "", "//"),
}
_SIZES = ("shape", "chunks", "chunk_shape")
_TARGETS = ("/dev/zero", "/proc/self/mem", "/etc/passwd", "/", "..", ".", "nothing", "../0", "/dev/null")


def damaged_store(files: Mapping[str, bytes], random: Random) -> Files:
    """Files of a store with one to three steps of damage."""
    changed = dict(files)
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        random.choice(_STEPS)(changed, random)
    return changed


def _is_metadata(name: str) -> bool:
    return name.rpartition("/")[2] in ("zarr.json", ".zarray", ".zattrs", ".zgroup", ".zmetadata")


def _metadata(files: Files, random: Random) -> str | None:
    """A file of metadata; that of the root half of the times."""
    names = [name for name in files if _is_metadata(name) and not isinstance(files[name], Link)]
    roots = [name for name in names if name.count("/") <= 1]
    return random.choice(roots if roots and random.random() < 0.5 else names) if names else None


def _json(files: Files, random: Random) -> None:
    """Change a value, a key or an entry somewhere in metadata."""
    name = _metadata(files, random)
    try:
        content = json.loads(files[name]) if name else None
    except (ValueError, RecursionError):  # of an earlier step
        return
    places = list(_places(content))
    if name is None or not places:
        return
    _change(*random.choice(places), random)
    files[name] = json.dumps(content).encode("utf-8", "surrogatepass")


def _places(content: Any) -> list[tuple[Any, Any]]:
    """Containers and keys of all values."""
    if not isinstance(content, dict | list):
        return []
    keys = list(content) if isinstance(content, dict) else list(range(len(content)))
    return [(content, key) for key in keys] + [each for key in keys for each in _places(content[key])]


def _change(inside: Any, key: Any, random: Random) -> None:
    value, how = inside[key], random.random()
    if how < 0.15:
        del inside[key]
    elif how < 0.25 and isinstance(inside, list):
        inside.insert(random.randrange(len(inside) + 1), value)
    elif how < 0.25:
        inside[random.choice(("zarr_format", "path", "a", key + "s", key.upper()))] = inside.pop(key)
    elif key in _SIZES and isinstance(value, list) and value:
        value[random.randrange(len(value))] = random.choice(_NUMBERS)
        if random.random() < 0.3:
            inside[key] = [random.choice((*_HUGE, 10**5, 10**7))] * len(value)
    elif isinstance(inside, list) and isinstance(value, int | float) and how < 0.8:
        inside[key] = random.choice((*_NUMBERS, float("nan"), -value, value * 3))
    elif key in _WORDS and how < 0.8:
        inside[key] = random.choice(_WORDS[key])
    elif key == "path" and how < 0.9:
        inside[key] = random.choice(_PATHS)
    else:
        inside[key] = random.choice(_ODD)


def _text(files: Files, random: Random) -> None:
    """Damage the text of metadata."""
    if name := _metadata(files, random):
        files[name] = damaged(files[name], random, text=True)


def _chunk(files: Files, random: Random) -> None:
    """Damage the bytes of a chunk or shard; at its end, where a shard has its index, as often as anywhere."""
    names = [name for name in files if not _is_metadata(name) and not isinstance(files[name], Link)]
    if not names:
        return
    name, how = random.choice(names), random.random()
    content = files[name]
    if how < 0.2:
        files[name] = content[: random.randrange(len(content) + 1)]
    elif how < 0.3:
        files[name] = files[random.choice(names)]
    elif how < 0.6:
        cut = max(len(content) - 40 - 16 * random.randrange(10), 0)
        files[name] = content[:cut] + damaged(content[cut:], random)
    else:
        files[name] = damaged(content, random)


def _lost(files: Files, random: Random) -> None:
    """Take away a file, or all below a folder."""
    name = random.choice(list(files) or [""])
    parts = name.split("/")
    below = "/".join(parts[: random.randrange(1, len(parts) + 1)])
    for each in list(files):
        if len(files) > 1 and (each == name if random.random() < 0.5 else each.startswith(f"{below}/")):
            del files[each]


def _link(files: Files, random: Random) -> None:
    """Put a link in place of a file, or of a folder and all that is in it."""
    name = random.choice(list(files) or ["v.zarr/zarr.json"])
    if random.random() < 0.4 and name.count("/") > 1:
        name = "/".join(name.split("/")[: random.randrange(2, name.count("/") + 1)])
        for each in [each for each in files if each.startswith(f"{name}/")]:
            del files[each]
    own = name.rpartition("/")[2]
    files[name] = Link(random.choice((*_TARGETS, own)).encode())


_STEPS: tuple[Callable[[Files, Random], None], ...] = (
    _json, _json, _json, _json, _json, _text, _chunk, _chunk, _lost, _link
)  # fmt: skip
