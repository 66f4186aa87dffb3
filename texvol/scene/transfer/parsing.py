"""The parts of a transfer-function file, from JSON to a medium in data and world units; `files` says what they mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.optics import depth_from_opacity
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.materials import Material, Pair, Triple, boundary
from texvol.scene.transfer.units import Units
from texvol.util.color import linear_color
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

# Lists of a file, and how a message calls an entry of each.
_ENTRY = {
    "points": "point",
    "materials": "material",
    "contours": "contour",
    "boundaries": "boundary",
    "graded": "graded",
}
_WEIGHTS = ("extinction", "opacity")
_MOST = 1000  # materials, contours and the like: time goes with the square of their number


@dataclass(frozen=True)
class Weighted:
    """The colour and the weight of a JSON object, in the file's units."""

    color: Triple
    is_emission: bool
    extinction: float

    @property
    def emission(self) -> NDArray[np.float64]:
        """Per the file's unit of length; the straight colour where the extinction is infinite."""
        return np.array(self.color) * (1.0 if self.is_emission or np.isinf(self.extinction) else self.extinction)


def number(thing: Any, what: str) -> float:
    """`thing` as a float."""
    if isinstance(thing, bool) or not isinstance(thing, int | float):
        raise InputError(f"{what} must be a number, got {thing!r}")
    try:
        return float(thing)
    except OverflowError:
        raise InputError(f"{what} is too large") from None


def entries(content: dict[str, Any], key: str) -> list[tuple[str, Any]]:
    """The objects under a key, if it is there, each with its name in messages, such as "contour 0"; or InputError."""
    things = content.get(key, [])
    if not isinstance(things, list) or (key in content and not things):
        raise InputError(f"a transfer function must have a list of {key} with at least one")
    if key != "points" and len(things) > _MOST:
        raise InputError(f"a transfer function must have at most {_MOST} {key}, got {len(things)}")
    return [(f"{_ENTRY[key]} {position}", thing) for position, thing in enumerate(things)]


def required(thing: dict[str, Any], key: str, where: str) -> Any:
    """Return the value of a key, or raise InputError."""
    if key not in thing:
        raise InputError(f"{where} must have {key}")
    return thing[key]


def refuse_unknown(thing: Any, known: Iterable[str], what: str, wanted: str = "") -> None:
    """Raise InputError where `thing` is no JSON object, or has other keys than those known."""
    if not isinstance(thing, dict):
        raise InputError(f"{what} must be an object with {wanted}, got {thing!r}")
    unknown = sorted(set(thing) - set(known))
    if unknown:
        listed = ", ".join(sorted(known)) + did_you_mean(unknown[0], known)
        raise InputError(f"{what}: key {unknown[0]!r} not known; known are {listed}")


def weighted(thing: dict[str, Any], where: str, color_keys: Sequence[str] = ("color",)) -> Weighted:
    """The colour, under one of `color_keys`, and the extinction or opacity of an object."""
    if ("extinction" in thing) == ("opacity" in thing):
        raise InputError(f"{where} must have either extinction or opacity, got both")
    given = [key for key in color_keys if key in thing]
    if len(given) > 1:
        raise InputError(f"{where} must have either {' or '.join(color_keys)}, got both")
    if not given:
        raise InputError(f"{where} must have {' or '.join(color_keys)}")
    color = _color(thing[given[0]], f"{where}: {given[0]}")
    if "opacity" in thing:
        opacity = number(thing["opacity"], f"{where}: opacity")
        if not 0 <= opacity <= 1:
            raise InputError(f"{where}: opacity must be from 0 to 1, got {opacity:g}")
        extinction = float(depth_from_opacity(opacity))
    else:
        extinction = number(thing["extinction"], f"{where}: extinction")
        if not extinction >= 0:
            raise InputError(f"{where}: extinction must not be negative or NaN, got {extinction:g}")
    return Weighted((color[0], color[1], color[2]), given[0] == "emission", extinction)


def material(thing: Any, where: str, units: Units) -> Material:
    """An entry of "materials"."""
    known = ("name", "from", "to", "color", *_WEIGHTS, "gradient")
    refuse_unknown(thing, known, where, "name, from, to, color and extinction")
    name = thing.get("name")
    if not isinstance(name, str) or not name.strip() or "," in name:
        raise InputError(f"{where} must have a name without a comma, got {name!r}")
    where = f"material {name!r}"
    looks = weighted(thing, where)
    _check_straight(looks.color, where)
    ends = {key: _ramp(thing[key], f"{where}: {key}") if key in thing else None for key in ("from", "to")}
    rises, falls = ends["from"], ends["to"]
    if rises and falls and (falls[0] < rises[1] or falls[1] <= rises[0]):
        raise InputError(f"{where}: to must come after from, got to at {falls[0]:g} and from up to {rises[1]:g}")
    gradient = None
    if "gradient" in thing:
        gradient = _gradient(thing["gradient"], f"{where}: gradient", units)
        _check_finite(looks.extinction, where)
    extinction = looks.extinction * units.per_length
    return Material(name, _placed(rises, units), _placed(falls, units), looks.color, extinction, gradient)


def named(name: Any, materials: Sequence[Material]) -> Material:
    """The material of that name."""
    for each in materials:
        if each.name == name:
            return each
    names = [each.name for each in materials]
    near = did_you_mean(name, names) if isinstance(name, str) else ""
    raise InputError(f"material {name!r} not found; known are {', '.join(names) or 'none'}{near}")


def contour(thing: Any, where: str, units: Units, materials: Sequence[Material]) -> Contour:
    """An entry of "contours"."""
    known = ("value", "thickness", "world_thickness", "material", "color", "emission", *_WEIGHTS)
    refuse_unknown(thing, known, where, "value, thickness, color and extinction")
    value = _position(required(thing, "value", where), f"{where}: value", units)
    if ("thickness" in thing) == ("world_thickness" in thing):
        raise InputError(f"{where} must have exactly one of thickness and world_thickness")
    if "material" in thing:
        if set(thing) & {"color", "emission", *_WEIGHTS}:
            raise InputError(f"{where} must have either a material, or a colour and an extinction of its own")
        source = named(thing["material"], materials)
        _check_finite(source.extinction, where)
        emission, extinction = source.emission, source.extinction
    else:
        looks = _thin(thing, where)
        emission, extinction = looks.emission * units.per_length, looks.extinction * units.per_length
    if "thickness" in thing:
        thickness = _positive(thing["thickness"], f"{where}: thickness") * units.known_volume.smallest_spacing
    else:
        thickness = _positive(thing["world_thickness"], f"{where}: world_thickness")
    return Contour(value, thickness, tuple(emission.tolist()), extinction)


def region_boundary(thing: Any, where: str, units: Units, materials: Sequence[Material]) -> Graded:
    """An entry of "boundaries"."""
    refuse_unknown(thing, ("materials", "gradient"), where, "materials and gradient")
    names = thing.get("materials")
    if not isinstance(names, list) or len(names) < 2:
        raise InputError(f"{where} must have a list of at least two names of materials")
    magnitude = _positive(required(thing, "gradient", where), f"{where}: gradient")
    chosen = [named(name, materials) for name in names]
    try:
        return boundary(chosen, magnitude * units.per_gradient)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def graded(thing: Any, where: str, units: Units) -> Graded:
    """An entry of "graded"."""
    refuse_unknown(thing, ("points", "gradient"), where, "points and gradient")
    start, full = _gradient(required(thing, "gradient", where), f"{where}: gradient", units)
    values, rows = [], []
    for entry, point in entries(thing, "points"):
        at = f"{where}, {entry}"
        refuse_unknown(point, ("value", "color", "emission", *_WEIGHTS), at, "value, emission and extinction")
        looks = _thin(point, at)
        values.append(_position(required(point, "value", at), f"{at}: value", units))
        rows.append([*looks.emission, looks.extinction])
    if not rows:
        raise InputError(f"{where} must have a list of at least one point")
    numbers = np.array(rows) * units.per_length
    try:
        return Graded(np.array(values), numbers[:, :3], numbers[:, 3], start, full)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def modulation(content: dict[str, Any], units: Units) -> NDArray[np.float64] | None:
    """The pairs under "gradient", or None where there are none."""
    if "gradient" not in content:
        return None
    pairs = content["gradient"]
    if not isinstance(pairs, list) or not pairs:
        raise InputError(f"gradient must be a list of pairs [magnitude, factor], got {pairs!r}")
    wanted = "a pair [magnitude, factor]"
    rows = [_numbers(pair, 2, f"gradient: entry {position}", wanted) for position, pair in enumerate(pairs)]
    return np.array(rows) * [units.per_gradient, 1.0]


def colors(content: dict[str, Any], key: str) -> list[tuple[float, float, float]]:
    """The list of straight colours under a key; none where there is no such key."""
    things = content.get(key, [])
    if not isinstance(things, list):
        raise InputError(f"{key} must be a list of colours, got {things!r}")
    found = []
    for position, each in enumerate(things):
        red, green, blue = _color(each, f"{key}: entry {position}")
        _check_straight((red, green, blue), f"{key}: entry {position}")
        found.append((red, green, blue))
    return found


def _color(thing: Any, what: str) -> list[float]:
    """Return a linear colour: three numbers, or a name or #RRGGBB as a text."""
    if isinstance(thing, str):
        return list(linear_color(thing, what))
    return _numbers(thing, 3, what, "three numbers")


def _numbers(things: Any, count: int, what: str, wanted: str) -> list[float]:
    if not isinstance(things, list) or len(things) != count:
        raise InputError(f"{what} must be {wanted}, got {things!r}")
    return [number(thing, what) for thing in things]


def _ramp(thing: Any, what: str) -> Pair:
    """Two values that ascend, or one that stands for both."""
    wanted = "a number or two that ascend"
    numbers = _numbers(thing, 2, what, wanted) if isinstance(thing, list) else [number(thing, what)] * 2
    if not (np.isfinite(numbers).all() and numbers[0] <= numbers[1]):
        raise InputError(f"{what} must be {wanted}, got {thing!r}")
    return numbers[0], numbers[1]


def _gradient(thing: Any, what: str, units: Units) -> Pair:
    wanted = "two gradient magnitudes from 0 upwards that ascend"
    start, full = _numbers(thing, 2, what, wanted)
    if not 0 <= start <= full < np.inf:
        raise InputError(f"{what} must be {wanted}, got {thing!r}")
    return start * units.per_gradient, full * units.per_gradient


def _placed(ends: Pair | None, units: Units) -> Pair | None:
    if ends is None:
        return None
    low, high = units.placed(np.array(ends))
    return float(low), float(high)


def _position(thing: Any, what: str, units: Units) -> float:
    value = number(thing, what)
    if not np.isfinite(value):
        raise InputError(f"{what} must be finite, got {value:g}")
    return float(units.placed(value))


def _positive(thing: Any, what: str) -> float:
    found = number(thing, what)
    if not 0 < found < np.inf:
        raise InputError(f"{what} must be a finite number above 0, got {found:g}")
    return found


def _thin(thing: dict[str, Any], where: str) -> Weighted:
    """The look of what depends on the gradient, which is never opaque."""
    looks = weighted(thing, where, ("color", "emission"))
    if not looks.is_emission:
        _check_straight(looks.color, where)
    _check_finite(looks.extinction, where)
    return looks


def _check_straight(color: Triple, where: str) -> None:
    if not all(0 <= component <= 1 for component in color):
        raise InputError(f"{where}: color must be from 0 to 1, got {list(color)}")


def _check_finite(extinction: float, where: str) -> None:
    if not np.isfinite(extinction):
        raise InputError(f"{where}: opacity must be below 1 if the medium depends on the gradient")
