"""Transfer functions as JSON. All its parts are optional, and those that are there add up.

    {"points": [{"value": 0,   "color": [0, 0, 0],       "extinction": 0},
                {"value": 300, "color": [0.9, 0.8, 0.7], "extinction": 0.5}]}

"points": a medium by value, linear in between. `value`; `color`, linear RGB in [0, 1]; `extinction` per unit of length,
    or in its place `opacity`, that of one unit of length (the source's A_l), converted by -log1p(-A).

"materials": [{"name": "fat",  "from": [-150, -120], "to": [-40, 0], "color": [0.9, 0.7, 0.1], "extinction": 0.02},
              {"name": "bone", "from": [100, 250], "color": [1, 1, 0.9], "extinction": 0.4}]
    The fraction of a material rises from 0 to 1 between the values of `from` and falls between those of `to`. One
    number makes a step (the value itself belongs to what begins there), without one it has no end. A value shows Σ
    fraction × extinction, and of colour Σ fraction × extinction × color. `extinction` or `opacity` as above; where a
    material of opacity 1 has any fraction, all is opaque. With `"gradient": [g0, g1]` a material is nothing where the
    gradient's magnitude is at most g0, and all there from g1 on.

"show": names of the materials that show; all, unless told. The others are for contours and boundaries to refer to.

"contours": [{"value": 120, "thickness": 2, "color": [0.8, 0.5, 0.4], "opacity": 0.9}]
    The surface of a value: a medium times 1 - |v - value| / (thickness |∇v|). `thickness` in voxels (smallest
    spacings), or `world_thickness`. In place of colour and weight, `"material": NAME` gives that material's.

"boundaries": [{"materials": ["fat", "muscle", "bone"], "gradient": 200}]
    From the typical value of each material, the middle of those that it has for itself, to that of the next, emission
    and extinction go linearly from one to the other, times |∇v| / gradient up to 1.

"gradient": [[0, 0], [200, 1]]: pairs of a gradient's magnitude and a factor, linear in between and clamped at the ends,
    for the points, and the materials without a `gradient` of their own.

"graded": [{"points": [{"value": 0, "emission": [0, 0, 0], "extinction": 0}, …], "gradient": [g0, g1]}, …]
    A table over value and gradient, as a sum of products: points that have `emission` per unit of length, or `color` as
    above, nothing before the first and after the last, times a ramp as a material's `gradient`.

What the numbers stand for:

    "values": "data" (default), or "percentile": values are percentiles of the volume's finite samples, 0 … 100,
              or "range": 0 is the smallest finite sample, 1 the largest,
              or "matter": 0 is where the background ends, 1 the 99.9th percentile
    "length": "world" (default), or "box": extinction is per mean edge of the volume's box, not per world unit;
              or "spacing": per smallest spacing of samples
              or "cell": per mean edge of the cells, their diagonal over the cube root of their number
    "gradients": "data" (default): data units per world unit, or "relative": 1 is the range of the finite samples per
              smallest spacing, or "voxel": data units per mean spacing
    "emission": "associated" (default), or "emissive": in place of `color` each point has `emission`, three numbers per
              unit of length that do not depend on the extinction,
              or "premultiplied": likewise, but of a medium that reflects light; a point of opacity 1 has its `color`

"light", "ambient", "diffuse", "specular", "shininess", "two-sided", "fade", "shadows", "background" and "gradient" with
    the name of an estimator: the look of the file, with the meaning of these keys in a scene file. They are no part of
    the transfer function; see `texvol.options.looks`.

A file whose name ends with .toml is TOML, with the same keys. Files of other programs become such content, see
`texvol.scene.transfer.foreign`.

"material_names" and "material_colors" are the names and colours of materials that have become points, as
`TransferFunction.as_json` writes them.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from texvol.scene.transfer import foreign, parsing
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.materials import Material, Points, mixture
from texvol.scene.transfer.units import CHOICES, Units
from texvol.scene.volume import Volume
from texvol.util import text_files
from texvol.util.errors import InputError

Function = TypeVar("Function", bound=Points)
_CHOICES = CHOICES | {"emission": ("associated", "emissive", "premultiplied")}
_PARTS = ("points", "materials", "contours", "boundaries", "graded")
_KEYS = {*_PARTS, *_CHOICES, "show", "gradient", "material_names", "material_colors"}
LOOK_KEYS = ("light", "ambient", "diffuse", "specular", "shininess", "two-sided", "fade", "shadows", "background")
_MOST_BYTES = 64 << 20  # of a file: some million points; more is no transfer function


def read_content(path: str | os.PathLike[str], unit_distance: float | None = None) -> dict[str, Any]:
    """Return the content of a transfer-function file, TOML or another program's by its name, else JSON.

    Parameters
    ----------
    path : path
        File, or FILE.json::NAME for one of ParaView's colour maps.
    unit_distance : float, optional
        Length in world units that opacities of another program's file belong to, in place of its own.

    Raises
    ------
    InputError
        If the file cannot be read, or is none of them; if a file of texvol's own is given a unit distance.
    """
    name, part = foreign.located(path)
    if foreign.is_foreign_text(name):
        return foreign.read_text(path, unit_distance)
    if name.lower().endswith(".toml"):
        content = text_files.read_toml(path)
    else:
        content = foreign.parsed_json(text_files.read_text(name, "JSON", _MOST_BYTES), name)
        if (other := foreign.of_json(name, content, unit_distance, part)) is not None:
            return other
    if not isinstance(content, dict):
        raise InputError(f"{name}: a transfer function must be a JSON object with points")
    if unit_distance is not None:
        raise InputError(f"{name}: has a unit of its own: a unit distance is for files of other programs")
    return content


def without_look(content: dict[str, Any]) -> dict[str, Any]:
    """Return the content of a file without its look."""
    named = {key: value for key, value in content.items() if key.replace("_", "-") not in LOOK_KEYS}
    return {key: value for key, value in named.items() if not (key == "gradient" and isinstance(value, str))}


def from_content(
    content: Any, name: str, volume: Volume | None, asked: Sequence[str] | None, make: Callable[..., Function]
) -> Function:
    """Make the transfer function that a parsed JSON text describes; `make` is the class of transfer functions."""
    if not isinstance(content, dict):
        raise InputError("a transfer function must be a JSON object with points")
    content = without_look(content)
    parsing.refuse_unknown(content, {*_KEYS, *LOOK_KEYS}, "a transfer function")
    chosen = {key: content.get(key, allowed[0]) for key, allowed in _CHOICES.items()}
    for key, allowed in _CHOICES.items():
        if chosen[key] not in allowed:
            raise InputError(f'"{key}" must be one of {", ".join(allowed)}, got {chosen[key]!r}')
    if not any(key in content for key in _PARTS):
        raise InputError("a transfer function must have a list of points, materials or contours, with at least one")
    emission = chosen.pop("emission")
    units = Units(volume, **chosen)
    points = _points(content, emission, name, units, make)
    materials = _materials(content, units)
    shown = _shown(content, materials, asked)
    if points is not None and points.emissive and materials:
        raise InputError(
            "emissive points must not be combined with materials, whose emission is colour times extinction"
        )
    graded, contours, referred = _by_gradient(content, units, materials, shown)
    plain = [each for each in shown if each.gradient is None]
    if plain or points is None:
        values, colors, extinctions = mixture(plain, points)
        points = make(values, colors, extinctions, name=name, premultiplied=bool(plain))
    named = [each for each in materials if each in shown or each.name in referred]
    return make(
        points.values,
        points.colors,
        points.extinctions,
        points.emissive,
        name,
        points.premultiplied,
        parsing.modulation(content, units),
        tuple(graded),
        tuple(contours),
        tuple([each.name for each in named] or _names(content, "material_names")),
        tuple([each.color for each in named] or parsing.colors(content, "material_colors")),
    )


def _points(
    content: dict[str, Any], emission: str, name: str, units: Units, make: Callable[..., Function]
) -> Function | None:
    """The points in data and world units, or None where there are none."""
    if "points" not in content:
        return None
    parsed = [_point(point, where, emission) for where, point in parsing.entries(content, "points")]
    values = np.array([value for value, _ in parsed])
    extinctions = np.array([looks.extinction for _, looks in parsed])
    premultiplied, emissive = emission == "premultiplied", emission == "emissive"
    colors = np.array([looks.emission if premultiplied else looks.color for _, looks in parsed])
    # What is wrong is said of the file's own numbers, before they become the volume's.
    make(values, colors, extinctions, emissive, name, premultiplied)
    per_length = units.per_length
    glows = emissive | (premultiplied & np.isfinite(extinctions))
    colors = colors * np.where(glows, per_length, 1.0)[..., np.newaxis]
    placed = np.maximum.accumulate(units.placed(values))
    return make(placed, colors, extinctions * per_length, emissive, name, premultiplied)


def _point(point: Any, where: str, emission: str) -> tuple[float, parsing.Weighted]:
    """Value, and colour or emission and extinction, of one point."""
    keys = {"associated": ("color",), "emissive": ("emission",), "premultiplied": ("emission", "color")}[emission]
    parsing.refuse_unknown(point, {"value", *keys, "extinction", "opacity"}, where, f"value, {keys[0]} and extinction")
    looks = parsing.weighted(point, where, keys)
    if emission == "premultiplied" and looks.is_emission and np.isinf(looks.extinction):
        raise InputError(f"{where}: an opaque point must have color in place of emission")
    return parsing.number(parsing.required(point, "value", where), f"{where}: value"), looks


def _materials(content: dict[str, Any], units: Units) -> list[Material]:
    found = [parsing.material(each, where, units) for where, each in parsing.entries(content, "materials")]
    for name, count in Counter(each.name for each in found).items():
        if count > 1:
            raise InputError(f"material {name!r} must be defined once, got it twice")
    return found


def _shown(content: dict[str, Any], materials: list[Material], asked: Sequence[str] | None) -> list[Material]:
    """The materials that show, in the file's order."""
    if asked is not None and not materials:
        raise InputError(f"materials {', '.join(map(repr, asked))} not found: the file has none")
    names = _names(content, "show") if asked is None and "show" in content else asked
    if names is None:
        return materials
    wanted = [parsing.named(name, materials) for name in names]
    return [each for each in materials if each in wanted]


def _by_gradient(
    content: dict[str, Any], units: Units, materials: list[Material], shown: list[Material]
) -> tuple[list[Graded], list[Contour], set[str]]:
    """Return the parts that depend on the gradient, and the names of the materials that they refer to."""
    graded = [each.graded() for each in shown if each.gradient is not None]
    referred: set[str] = set()
    for where, each in parsing.entries(content, "boundaries"):
        graded.append(parsing.region_boundary(each, where, units, materials))
        referred.update(each["materials"])
    graded += [parsing.graded(each, where, units) for where, each in parsing.entries(content, "graded")]
    contours = []
    for where, each in parsing.entries(content, "contours"):
        contours.append(parsing.contour(each, where, units, materials))
        referred.add(each.get("material", ""))
    return graded, contours, referred


def _names(content: dict[str, Any], key: str) -> list[str]:
    names = content.get(key, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(f"{key} must be a list of names of materials, got {names!r}")
    return names
