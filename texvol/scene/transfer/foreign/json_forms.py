"""JSON of ParaView, VTK and 3D Slicer, as curves of colour and opacity."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from texvol.scene.transfer.foreign.color_spaces import SPACES, in_rgb
from texvol.scene.transfer.foreign.content import Content, Length
from texvol.scene.transfer.foreign.curves import Curve, Mix, Node, Numbers, bounded, check_positive, nodes_of
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

CELL = "per mean edge of the volume's cells (its diagonal over the cube root of their number), ParaView's own default"
_VTK_SPACES = ("RGB", "HSV", "Lab", "Diverging", "Lab/CIEDE2000", "Step")  # vtkColorTransferFunction's numbers
_SLICER_LIGHT = {"ambient": 0.1, "diffuse": 0.7, "specular": 0.2, "specularPower": 10.0}  # what a file leaves out
_STEP = 1e-6  # width of a step of the opacity by gradient, of its value
_RAISED = ("Ambient", "Diffuse", "Specular", "SpecularPower")


def read(parsed: Any, name: str | None = None) -> Content | None:
    """Return the content of a parsed JSON text; None if it is of no known program.

    Parameters
    ----------
    name : str, optional
        Name of the colour map in a list of ParaView's.
    """
    if isinstance(parsed, list) and len(parsed) >= 1 and all(isinstance(each, dict) for each in parsed):
        maps = [each for each in parsed if "RGBPoints" in each or "IndexedColors" in each]
        parsed = _chosen(maps, name) if maps else parsed
    elif name is not None:
        raise InputError(f"is no list of colour maps, from which ::{name} would take one")
    if not isinstance(parsed, dict):
        return None
    if "RGBPoints" in parsed or "IndexedColors" in parsed:
        return _paraview(parsed)
    if "volumeProperties" in parsed:
        return _slicer(parsed)
    states = parsed.get("states", parsed)
    if isinstance(states, dict):
        objects = {str(key): each for key, each in states.items() if isinstance(each, dict) and "ClassName" in each}
        if "ClassName" in parsed:
            objects = {"0": parsed}
        if objects:
            return _vtk(objects)
    return None


def _chosen(maps: list[dict[str, Any]], name: str | None) -> dict[str, Any]:
    """Return the colour map of a name, or the only one."""
    names = [str(each.get("Name", "?")) for each in maps]
    if name is None and len(maps) == 1:
        return maps[0]
    if name in names:
        return maps[names.index(name)]
    some = ", ".join(names[:6]) + (", …" if len(names) > 6 else "")
    if name is None:
        raise InputError(f"has {len(maps)} colour maps, and FILE::NAME takes one: {some}")
    raise InputError(f"colour map {name!r} not found{did_you_mean(name, names)}; the file has {some}")


def _paraview(fields: dict[str, Any]) -> Content:
    """Return the content of a colour map of ParaView, vtk.js or VTK's `Name`, `ColorSpace`, `RGBPoints`, `Points`."""
    if "RGBPoints" not in fields:
        name = fields.get("Name", "?")
        raise InputError(
            f"colour map {name!r} is a list of colours for categories: a transfer function needs RGBPoints"
        )
    space = str(fields.get("ColorSpace", "RGB"))
    if space == "HSV" and fields.get("HSVWrap", False):  # off where ParaView's file does not say it, unlike VTK's own
        space = "HSV wrapped"
    if space not in SPACES:
        raise InputError(f"ColorSpace must be one of {', '.join(_without_wrapped())}, got {space!r}")
    numbers = _floats(fields["RGBPoints"], "RGBPoints")
    nodes = nodes_of(numbers, 3, "RGBPoints", ordered=False)
    is_logarithmic = bool(fields.get("UseLogScale", False))
    if is_logarithmic:
        check_positive(nodes, "RGBPoints must be above 0 with UseLogScale")
    color = Curve(nodes, SPACES[space], logarithmic=is_logarithmic)
    opacity = None
    if fields.get("Points"):
        points = _floats(fields["Points"], "Points")
        # ParaView has four numbers for each point, VisRTX two: only those have ascending values if read so.
        is_shaped = len(points) % 4 == 0 and not all(low < high for low, high in pairwise(points[::2]))
        opacity = Curve(nodes_of(points, 1, "Points", shaped=is_shaped, ordered=False))
    return Content(color, opacity, Length("cell", 1.0, CELL))


def _without_wrapped() -> list[str]:
    return [name for name in SPACES if " " not in name]


def _slicer(fields: dict[str, Any]) -> Content:
    """Return the content of 3D Slicer's .vp.json; of several properties and components the first, as Slicer does."""
    properties = fields["volumeProperties"]
    where = "volumeProperties"
    first = _object(properties[0] if isinstance(properties, list) and properties else None, where)
    components = first.get("components")
    part = _object(components[0] if isinstance(components, list) and components else None, "components")
    if "rgbTransferFunction" in part:
        color = Curve(_slicer_nodes(part, "rgbTransferFunction", "color"))
    else:
        greys = _slicer_nodes(part, "grayTransferFunction", "y")
        color = Curve([each._replace(numbers=np.repeat(each.numbers, 3)) for each in greys])
    opacity = Curve(_slicer_nodes(part, "scalarOpacity", "y"))
    keys: dict[str, Any] = {}
    if part.get("shade"):
        light = _SLICER_LIGHT | _object(part.get("lighting", {}), "lighting")
        keys |= lit(*(_float(light[name], name) for name in _SLICER_LIGHT))
    notes: tuple[str, ...] = ()
    if "gradientOpacity" in part and not part.get("disableGradientOpacity"):
        more, notes = by_gradient(_slicer_nodes(part, "gradientOpacity", "y"))
        keys |= more
    if len(properties) > 1:
        notes += (f"the first of its {len(properties)} volume properties is taken",)
    if isinstance(components, list) and len(components) > 1:
        notes += (f"the first of its {len(components)} components is taken",)
    if (unit := part.get("scalarOpacityUnitDistance")) is None:
        length = Length(reason="per 1 world unit, as 3D Slicer takes them where a file does not say it")
    else:
        length = Length(amount=_float(unit, "scalarOpacityUnitDistance"))
    return Content(color, opacity, length, keys, notes)


def _slicer_nodes(part: dict[str, Any], key: str, of: str) -> list[Node]:
    points = _object(part.get(key), key).get("points")
    if not isinstance(points, list) or not points:
        raise InputError(f"{key} must have a list of points")
    flat: list[float] = []
    width = 3 if of == "color" else 1
    for each in points:
        point = _object(each, f"a point of {key}")
        numbers = point.get(of)
        several = _floats(numbers if isinstance(numbers, list) else [numbers], f"{of} of {key}")
        if len(several) != width:
            raise InputError(f"{of} of {key} must have {width} numbers, got {len(several)}")
        shape = [_float(point.get(name, default), name) for name, default in (("midpoint", 0.5), ("sharpness", 0.0))]
        flat += [_float(point.get("x"), f"x of {key}"), *several, *shape]
    return nodes_of(flat, width, key, shaped=True, ordered=False)


def _vtk(objects: dict[str, dict[str, Any]]) -> Content:
    """Return the content of the states that VTK's object manager exports, which lack midpoints and sharpness."""
    named = {str(each.get("Id", key)): each for key, each in objects.items()}
    properties = [each for each in named.values() if each["ClassName"].endswith("VolumeProperty")]
    if not properties:
        colors = [each for each in named.values() if str(each["ClassName"]).endswith("ColorTransferFunction")]
        if len(colors) != 1:
            raise InputError("must have a vtkVolumeProperty, or one vtkColorTransferFunction")
        return Content(_vtk_color(colors[0]), None, Length())
    if len(properties) > 1:
        raise InputError(f"must have one vtkVolumeProperty, got {len(properties)}")
    of = properties[0]
    color = _vtk_color(_linked(of, "RGBTransferFunction", named))
    opacity = _vtk_opacity(_linked(of, "ScalarOpacityFunction", named))
    keys: dict[str, Any] = {}
    if _first(of.get("Shade")):
        keys |= lit(*(_float(_first(of.get(name)), name) for name in _RAISED))
    notes: tuple[str, ...] = ()
    if _first(of.get("GradientOpacityFunction")) and not _first(of.get("DisableGradientOpacity")):
        state = _linked(of, "GradientOpacityFunction", named)
        more, notes = by_gradient(nodes_of(_floats(state.get("Data"), "Data"), 1, "GradientOpacityFunction"))
        keys |= more
    unit = _float(_first(of.get("ScalarOpacityUnitDistance")), "ScalarOpacityUnitDistance")
    return Content(color, opacity, Length(amount=unit), keys, notes)


def _vtk_color(state: dict[str, Any]) -> Curve:
    number = int(_float(state.get("ColorSpace", 0), "ColorSpace"))
    space = _VTK_SPACES[number] if 0 <= number < len(_VTK_SPACES) else str(number)
    if space == "HSV" and state.get("HSVWrap", True):
        space = "HSV wrapped"
    if space not in SPACES:
        raise InputError(f"ColorSpace must be one of {', '.join(_without_wrapped())}, got {space}")
    is_clamped = bool(state.get("Clamping", True))
    below, above = (_vtk_beyond(state, name, is_clamped) for name in ("BelowRangeColor", "AboveRangeColor"))
    return _vtk_curve(state, 3, below, above, mix=SPACES[space], logarithmic=bool(state.get("Scale", 0)))


def _vtk_beyond(state: dict[str, Any], name: str, is_clamped: bool) -> Numbers | None:
    """Return the colour before the first or after the last value; None if it is that of the end."""
    if not is_clamped:
        return np.zeros(3)
    if not state.get(f"Use{name}", False):
        return None
    return nodes_of([0.0, *_floats(state.get(name), name)], 3, name)[0].numbers


def _vtk_opacity(state: dict[str, Any]) -> Curve:
    nothing = None if state.get("Clamping", True) else np.zeros(1)
    return _vtk_curve(state, 1, nothing, nothing, logarithmic=bool(state.get("UseLogScale", False)))


def _vtk_curve(
    state: dict[str, Any],
    width: int,
    below: Numbers | None,
    above: Numbers | None,
    *,
    mix: Mix = in_rgb,
    logarithmic: bool,
) -> Curve:
    name = str(state.get("ClassName"))
    nodes = nodes_of(_floats(state.get("Data"), f"Data of {name}"), width, name)
    if logarithmic:
        check_positive(nodes, f"{name} must be above 0 with a logarithmic scale")
    return Curve(bounded(nodes, below, above), mix, logarithmic=logarithmic)


def _linked(of: dict[str, Any], key: str, named: dict[str, dict[str, Any]]) -> dict[str, Any]:
    link = _first(of.get(key))
    found = named.get(str(link.get("Id"))) if isinstance(link, dict) else None
    if found is None:
        raise InputError(f"its {key} must name a state in the file, got {link!r}")
    return found


def _first(thing: Any) -> Any:
    return thing[0] if isinstance(thing, list) and thing else thing


def lit(ambient: float, diffuse: float, specular: float, shininess: float) -> dict[str, Any]:
    """Return the keys of a look lit from the eye, as VTK's volumes are by default, from both sides."""
    shading = {"ambient": ambient, "diffuse": diffuse, "specular": specular, "shininess": max(shininess, 1.0)}
    return {"light": ["head"], **shading, "two-sided": True}


def by_gradient(nodes: Sequence[Node]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the keys of an opacity by gradient magnitude, and notes; nothing if it is 1 everywhere."""
    if all(float(each.numbers[0]) == 1 for each in nodes):
        return {}, ()
    curve = Curve(nodes)
    pairs: list[list[float]] = []
    # No magnitude is negative: a function that begins below 0 is taken from 0 on.
    knots = sorted({max(each, 0.0) for each in curve.knots})
    for low, high in pairwise(knots):
        function = curve.inside(low, high)
        count = 2 if nodes[0].sharpness == 0 and all(each.sharpness == 0 for each in nodes) else 17
        for value in np.linspace(low, high, count):
            pairs.append([float(value), float(function(float(value))[0])])
    if not pairs:
        pairs = [[0.0, float(curve.last.numbers[0])]]
    ascending = [pairs[0]]
    for value, factor in pairs[1:]:
        last, before = ascending[-1]
        if value <= last and factor != before:  # a step, whose ends are a little apart, as in 3D Slicer
            value = last + _STEP * max(abs(last), pairs[-1][0])
        if value > last:
            ascending.append([value, factor])
    note = "its opacity by gradient is taken as a factor of the extinction, per mean spacing of samples as VTK does"
    return {"gradient": ascending, "gradients": "voxel"}, (note,)


def _object(thing: Any, what: str) -> dict[str, Any]:
    if not isinstance(thing, dict):
        raise InputError(f"{what} must be an object, got {thing!r:.60}")
    return thing


def _float(thing: Any, what: str) -> float:
    if isinstance(thing, bool) or not isinstance(thing, int | float):
        raise InputError(f"{what} must be a number, got {thing!r:.60}")
    return float(thing)


def _floats(things: Any, what: str) -> list[float]:
    if not isinstance(things, list):
        raise InputError(f"{what} must be a list of numbers, got {things!r:.60}")
    return [_float(each, what) for each in things]
