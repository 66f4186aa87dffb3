"""Transfer functions written for ParaView and 3D Slicer: sRGB and opacities of a length, linear between nodes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from texvol.scene.lighting import Lighting
from texvol.scene.optics import opacity_from_depth
from texvol.scene.transfer.foreign.sampling import Function, Sample, in_opacity, sampled
from texvol.scene.transfer.function import TransferFunction
from texvol.util.color import srgb_from_linear
from texvol.util.errors import InputError

_SCHEMA = "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/VolumeRendering/Resources/Schema/"
_SCHEMA += "volume-property-schema-v1.0.0.json#"
_INSET = 1e-6  # of an interval
_UNLIT = Lighting(ambient=1.0, diffuse=0.0, specular=0.0)


class Written(NamedTuple):
    """Text of a file, and its number of nodes."""

    text: str
    nodes: int


def paraview(function: TransferFunction, unit: float, name: str) -> Written:
    """Return a colour map of ParaView, whose opacities are of a length of `unit`.

    Raises
    ------
    InputError
        If the medium depends on the gradient, or emits more than it absorbs.
    """
    nodes = _nodes(function, unit)
    content = {
        "Name": name,
        "ColorSpace": "RGB",
        "RGBPoints": [number for node in nodes for number in (node.value, *node.numbers[:3].tolist())],
        "Points": [number for node in nodes for number in (node.value, float(node.numbers[3]), 0.5, 0.0)],
        "NanColor": [0.0, 0.0, 0.0],
    }
    return Written(json.dumps([content], indent=1), len(nodes))


def slicer(function: TransferFunction, unit: float, lighting: Lighting | None) -> Written:
    """Return a volume property of 3D Slicer (.vp.json), with its length of opacities and its light; raises likewise."""
    nodes, light = _nodes(function, unit), lighting or _UNLIT
    shape = {"midpoint": 0.5, "sharpness": 0.0}
    colors = [{"x": node.value, "color": node.numbers[:3].tolist(), **shape} for node in nodes]
    opacities = [{"x": node.value, "y": float(node.numbers[3]), **shape} for node in nodes]
    component = {
        "componentWeight": 1.0,
        "shade": lighting is not None,
        "lighting": {
            "diffuse": light.diffuse,
            "ambient": light.ambient,
            "specular": light.specular,
            "specularPower": light.shininess,
        },
        "disableGradientOpacity": True,
        "scalarOpacityUnitDistance": unit,
        "rgbTransferFunction": {"type": "colorTransferFunction", "points": colors},
        "scalarOpacity": {"type": "piecewiseLinearFunction", "points": opacities},
        "gradientOpacity": {"type": "piecewiseLinearFunction", "points": [{"x": 0.0, "y": 1.0, **shape}]},
    }
    whole = {
        "effectiveRange": [nodes[0].value, nodes[-1].value],
        "isoSurfaceValues": [],
        "independentComponents": True,
        "interpolationType": "linear",
        "useClippedVoxelIntensity": False,
        "clippedVoxelIntensity": 0.0,
        "scatteringAnisotropy": 0.0,
        "components": [component],
    }
    return Written(json.dumps({"@schema": _SCHEMA, "volumeProperties": [whole]}, indent=1), len(nodes))


def slicer_text(function: TransferFunction, lighting: Lighting | None) -> Written:
    """Return a volume property of 3D Slicer (.vp), whose opacities are of 1 world unit; raises likewise."""
    nodes, light = _nodes(function, 1.0), lighting or _UNLIT
    shading = (light.diffuse, light.ambient, light.specular, light.shininess)
    lists = (
        [number for node in nodes for number in (node.value, float(node.numbers[3]))],
        [0.0, 1.0, 255.0, 1.0],
        [number for node in nodes for number in (node.value, *node.numbers[:3].tolist())],
    )
    lines = ["1", str(int(lighting is not None)), *map(_digits, shading), *map(_counted, lists)]
    return Written("\n".join(lines) + "\n", len(nodes))


def _counted(numbers: Sequence[float]) -> str:
    return " ".join([str(len(numbers)), *map(_digits, numbers)])


def _digits(number: float) -> str:
    return f"{float(number):.9g}"


def _nodes(function: TransferFunction, unit: float) -> list[Sample]:
    """Return values with sRGB and opacity, ascending: a step has two, a rounding of single precision apart."""
    if function.needs_gradient:
        raise InputError(f"{function.name}: depends on the gradient, which other programs' files cannot say")
    if function.excess_emission > 0:
        raise InputError(f"{function.name}: emits more than it absorbs, which other programs' files cannot say")
    if not 0 < unit < np.inf:
        raise InputError(f"unit distance must be a finite number above 0, got {unit:g}")

    def between(low: float, high: float) -> Function:
        # At the upper end as from below it; and the colour of emission and extinction that are 0 at an end is inside.
        inset = _INSET * (high - low) if function.glows else 0.0
        inner = low + inset, np.nextafter(high - inset, low)
        return lambda value: _numbers(function, float(np.clip(value, *inner)), unit)

    found = sampled(function.values.tolist(), between, in_opacity)
    before, after = (_numbers(function, value, unit) for value in (-np.inf, np.inf))
    for place, number in ((0, before), (len(found), after)):
        if not np.array_equal(found[min(place, len(found) - 1)].numbers, number):
            found.insert(place, Sample(found[min(place, len(found) - 1)].value, number))
    return _apart(found)


def _numbers(function: TransferFunction, value: Any, unit: float) -> np.ndarray:
    """Return sRGB and opacity of a value."""
    *color, extinction = function.at(value)
    straight = np.array(color)
    if function.glows and np.isfinite(extinction):
        straight = straight / extinction if extinction > 0 else np.zeros(3)
    return np.array([*srgb_from_linear(np.clip(straight, 0, 1)), opacity_from_depth(extinction * unit)])


def _apart(samples: Sequence[Sample]) -> list[Sample]:
    """Return samples of different values, since VTK keeps one of two at the same value."""
    found: list[Sample] = []
    for sample in reversed(samples):
        value = sample.value
        if found and not value < found[-1].value:
            above = found[-1].value
            value = above - float(np.spacing(np.float32(abs(above)))) if abs(above) < 1e30 else np.nextafter(above, -1)
        found.append(Sample(float(value), sample.numbers))
    return found[::-1]
