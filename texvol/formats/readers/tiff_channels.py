"""Channels of a TIFF, as OME and ImageJ describe them: names, colours and windows of values.

OME writes a colour as the 32 bits of red, green, blue and opacity, as a signed number; ImageJ as a table of colours, of
which the last is that of the brightest value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from html import unescape
from typing import Any

import numpy as np

from texvol.scene.channel import Channel
from texvol.util.color import linear_from_srgb


def channels_of(tif: Any, count: int) -> tuple[Channel, ...]:
    """Return the descriptions of so many channels; none where the file describes another number, or nothing."""
    if tif.ome_metadata:
        found = _of_ome(tif.ome_metadata)
    else:
        found = _of_imagej(tif.imagej_metadata, count) if tif.imagej_metadata else []
    said = any(each != Channel(each.number) for each in found)
    return tuple(found) if said and len(found) == count else ()


def _of_ome(xml: str) -> list[Channel]:
    image = re.search(r"<(?:\w+:)?Pixels\b.*?</(?:\w+:)?Pixels>", xml, re.DOTALL)
    told = re.findall(r"<(?:\w+:)?Channel\b([^>]*)>", image.group(0) if image else "")
    found = []
    for number, text in enumerate(told):
        attributes = dict(re.findall(r'(\w+)\s*=\s*"([^"]*)"', text))
        bits = re.fullmatch(r"-?\d{1,10}", attributes.get("Color", ""))
        color = (int(bits.group(0)) & 0xFFFFFFFF).to_bytes(4, "big")[:3] if bits else None
        found.append(Channel(number, unescape(attributes.get("Name", "")), None if color is None else _linear(color)))
    return found


def _of_imagej(told: dict[str, Any], count: int) -> list[Channel]:
    tables, ends = told.get("LUTs"), told.get("Ranges")
    tables = tables if isinstance(tables, list) and len(tables) == count else [None] * count
    ends = list(ends) if isinstance(ends, Sequence) and len(ends) == 2 * count else []
    found = []
    for number, table in enumerate(tables):
        colors = None if table is None else np.asarray(table)
        color = None if colors is None or colors.shape != (3, 256) else _linear(colors[:, -1].tolist())
        low, high = (float(each) for each in ends[2 * number : 2 * number + 2]) if ends else (math.nan, math.nan)
        window = (low, high) if math.isfinite(low) and math.isfinite(high) and low < high else None
        found.append(Channel(number, "", color, window))
    return found


def _linear(bytes_of: Sequence[int]) -> tuple[float, float, float]:
    red, green, blue = (float(each) for each in linear_from_srgb(np.array(list(bytes_of)) / 255))
    return red, green, blue
