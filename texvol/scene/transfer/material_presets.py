"""Presets of named materials, as a transfer-function file has them; extinctions are per mean edge of the box.

A CT preset stands twice: in Hounsfield units, and in fractions of the medium's range for rescaled or 8-bit CT.
"""

from __future__ import annotations

from typing import Any

Content = dict[str, Any]


def _material(
    name: str,
    rises: tuple[float, float] | None,
    falls: tuple[float, float] | None,
    color: tuple[float, float, float],
    extinction: float,
) -> Content:
    ends = {key: list(each) for key, each in (("from", rises), ("to", falls)) if each is not None}
    return {"name": name, **ends, "color": list(color), "extinction": extinction}


def _content(*materials: Content) -> Content:
    return {"length": "box", "materials": list(materials)}


_FAT, _MUSCLE = (0.90, 0.70, 0.10), (0.75, 0.12, 0.10)

CT_MATERIALS: dict[str, tuple[Content, Content]] = {
    # The materials of the source's table 5-1.
    "table-5-1": (
        _content(
            _material("air", None, (-150, -120), (0, 0, 0), 0),
            _material("fat", (-150, -120), (-40, 0), _FAT, 3),
            _material("soft tissue", (-40, 0), (100, 250), _MUSCLE, 6),
            _material("bone", (100, 250), None, (1, 1, 1), 80),
        ),
        _content(
            _material("air", None, (0.05, 0.12), (0, 0, 0), 0),
            _material("fat", (0.05, 0.12), (0.24, 0.30), _FAT, 3),
            _material("soft tissue", (0.24, 0.30), (0.44, 0.60), _MUSCLE, 6),
            _material("bone", (0.44, 0.60), None, (1, 1, 1), 80),
        ),
    ),
    # Skin is where a sample is part air, part what it covers; fat and muscle leave a view of the bone.
    "ct-materials": (
        _content(
            _material("air", None, (-650, -400), (0, 0, 0), 0),
            _material("skin", (-650, -400), (-200, -140), (0.70, 0.36, 0.22), 2),
            _material("fat", (-200, -140), (-50, -10), (0.85, 0.62, 0.22), 1),
            _material("muscle", (-50, -10), (110, 190), (0.60, 0.08, 0.06), 3),
            _material("bone", (110, 190), (600, 1100), (0.92, 0.80, 0.60), 60),
            _material("dense bone", (600, 1100), None, (1.00, 0.98, 0.92), 200),
        ),
        _content(
            _material("air", None, (0.00, 0.05), (0, 0, 0), 0),
            _material("skin", (0.00, 0.05), (0.10, 0.14), (0.70, 0.36, 0.22), 2),
            _material("fat", (0.10, 0.14), (0.22, 0.27), (0.85, 0.62, 0.22), 1),
            _material("muscle", (0.22, 0.27), (0.42, 0.52), (0.60, 0.08, 0.06), 3),
            _material("bone", (0.42, 0.52), (0.72, 0.85), (0.92, 0.80, 0.60), 60),
            _material("dense bone", (0.72, 0.85), None, (1.00, 0.98, 0.92), 200),
        ),
    ),
}

# T1-weighted, where fluid is dark and white matter bright.
MATERIALS: dict[str, Content] = {
    "mr-materials": {"values": "matter"}
    | _content(
        _material("fluid", (0.04, 0.12), (0.32, 0.44), (0.10, 0.24, 0.50), 2),
        _material("grey matter", (0.32, 0.44), (0.66, 0.74), (0.62, 0.30, 0.24), 14),
        _material("white matter", (0.66, 0.74), (0.92, 1.00), (0.92, 0.84, 0.70), 50),
        _material("bright", (0.92, 1.00), None, (1.00, 0.80, 0.30), 60),
    ),
}
