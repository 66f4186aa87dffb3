"""A transfer function as its file holds it; reading it again gives the same one."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.scene.transfer.function import TransferFunction


def content_of(function: TransferFunction) -> dict[str, Any]:
    """The content of a transfer-function file, in data and world units; infinite extinction as opacity 1."""
    points = [
        _point(function, value, color, extinction)
        for value, color, extinction in zip(function.values, function.colors, function.extinctions, strict=True)
    ]
    content: dict[str, Any] = {"points": points}
    if function.glows:
        content["emission"] = "emissive" if function.emissive else "premultiplied"
    if function.modulation is not None:
        content["gradient"] = function.modulation.tolist()
    if function.graded:
        content["graded"] = [
            {
                "points": [
                    {"value": float(value), "emission": emission.tolist(), "extinction": float(extinction)}
                    for value, emission, extinction in zip(
                        graded.values, graded.emissions, graded.extinctions, strict=True
                    )
                ],
                "gradient": [float(graded.start), float(graded.full)],
            }
            for graded in function.graded
        ]
    if function.contours:
        content["contours"] = [
            {
                "value": float(contour.value),
                "world_thickness": float(contour.thickness),
                "emission": list(contour.emission),
                "extinction": float(contour.extinction),
            }
            for contour in function.contours
        ]
    if function.materials:
        content["material_names"] = list(function.materials)
    if function.material_colors:
        content["material_colors"] = [list(color) for color in function.material_colors]
    return content


def _point(function: TransferFunction, value: float, color: np.ndarray, extinction: float) -> dict[str, Any]:
    opaque = bool(np.isinf(extinction))
    glows = function.emissive or (function.premultiplied and not opaque)
    point = {"value": float(value), "emission" if glows else "color": color.tolist()}
    return point | ({"opacity": 1.0} if opaque else {"extinction": float(extinction)})
