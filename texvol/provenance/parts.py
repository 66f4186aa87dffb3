"""Converters from the JSON of a picture's header to parts of a scene, for `stored_scene`.

Each raises InputError, TypeError, ValueError or OverflowError for content that texvol does not write.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.settings import ADAPTIVE, Settings, checked_interpolation, checked_target, checked_termination
from texvol.scene.cutting import ClipPlane
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.lighting import SHADOW_NODES, Light, Lighting, checked_shadow_nodes
from texvol.scene.measures.measure import Measure
from texvol.scene.refinement import REFINEMENTS
from texvol.scene.transfer import TransferFunction
from texvol.slicing.slabs import SLICINGS
from texvol.textures.slab_texture import TEXEL_FORMATS
from texvol.util.errors import InputError
from texvol.util.suggestions import check_one_of

_NUMBER = (int, float)
# Types of the arguments with which a volume is read again.
SOURCE: dict[str, Any] = {"path": str, "absolute": str, "shape": list, "dtype": str, "series": str, "spacing": list}
SOURCE |= {"variable": str, "resolution": list, "missing": list}
SOURCE |= {"channel": (int, str), "time": int, "labels": bool, "blocks": bool, "color": bool}
SOURCE |= {
    "image": str,
    "level": int,
    "fix_pyramid": bool,
    "missing_chunks": bool,
    "label_names": str,
    "resample": bool,
}
SOURCE |= {"built_in": str, "samples": int, "transform": list}
_TYPES = {"float": _NUMBER, "str": str, "bool": bool, "int": int}
_TYPES |= {f"{name} | None": kind for name, kind in _TYPES.items()}
_SETTINGS: dict[str, Any] = {
    each.name: _TYPES[str(each.type)]
    for each in fields(Settings)
    if each.name != "regions"  # of a pass, not of a picture
} | {"max_error": _NUMBER}
_MOST_SHOWN = 200  # characters of a quoted text, enough for a path

T = TypeVar("T")


def transfer_function(content: Any) -> TransferFunction:
    """Return the transfer function that a header holds."""
    return TransferFunction.from_content(content, "transfer function")


def settings(content: Any) -> dict[str, Any]:
    """Return arguments of `Renderer.render`."""
    found = _of_types(content, _SETTINGS)
    thickness = found.get("slab_thickness", 1.0)
    if not 0 < thickness < np.inf:
        raise InputError(f"slab_thickness must be positive and finite, got {thickness:g}")
    checked_termination(found.get("early_termination"), None)
    checked_target(found.get("target_format", "auto"))
    if found.get("texture_refinement", 1) not in REFINEMENTS:
        raise InputError(f"texture_refinement must be 1, 2 or 4, got {quoted(found['texture_refinement'])}")
    checked_shadow_nodes(found.get("shadow_nodes", SHADOW_NODES))
    if found.get("slicing", "stacks") not in SLICINGS:
        raise InputError(f"slicing must be one of {', '.join(SLICINGS)}, got {quoted(found['slicing'])}")
    checked_interpolation(found.get("interpolation", "auto"))
    check_one_of("adaptive", found.get("adaptive", "on"), ADAPTIVE)
    if found.get("texture_format", "auto") not in ("auto", *TEXEL_FORMATS):
        formats = ", ".join(("auto", *TEXEL_FORMATS))
        raise InputError(f"texture_format must be one of {formats}, got {quoted(found['texture_format'])}")
    return found


def source(content: Any) -> dict[str, Any]:
    """Return the file of a volume and arguments of `texvol.load`."""
    found = _of_types(content, SOURCE)
    for key, kind in (("shape", (int,)), ("resolution", (int,)), ("spacing", _NUMBER)):
        if key in found and not (len(found[key]) == 3 and all(type(each) in kind for each in found[key])):
            raise InputError(f"{key} must be three numbers, got {quoted(found[key])}")
    for each in found.get("missing", ()):
        number(each)
    if "transform" in found:
        found["transform"] = array(found["transform"], (4, 4))
    return found


def mask_source(content: Any) -> tuple[dict[str, Any], tuple[float, float] | None]:
    """Return the file of a mask, and the values between which the mask fades in."""
    if not isinstance(content, dict):
        raise InputError(f"must be an object, got {quoted(content)}")
    fade = numbers(content["fade"], 2) if "fade" in content else None
    found = source({key: value for key, value in content.items() if key != "fade"})
    return found, None if fade is None else (fade[0], fade[1])


def isosurfaces(content: Any) -> tuple[Isosurface, ...]:
    """Return the isosurfaces."""
    if not isinstance(content, list):
        raise InputError(f"must be a list, got {quoted(content)}")
    return tuple(made(Isosurface, each) for each in content)


def lighting(content: Any) -> Lighting:
    """Return the lighting."""
    if not isinstance(content, dict) or not isinstance(content.get("lights"), list):
        raise InputError(f"must be an object with a list of lights, got {quoted(content)}")
    return made(Lighting, content | {"lights": [made(Light, each) for each in content["lights"]]})


def clip_planes(content: Any) -> tuple[ClipPlane, ...]:
    """Return the clip planes."""
    if not isinstance(content, list):
        raise InputError(f"must be a list of planes, got {quoted(content)}")
    return tuple(made(ClipPlane, each) for each in content)


def measures(content: Any) -> tuple[Measure, ...]:
    """Return the measures."""
    if not isinstance(content, list):
        raise InputError(f"must be a list of measures, got {quoted(content)}")
    return tuple(made(Measure, each) for each in content)


def switch(content: Any) -> bool:
    """Return a bool."""
    if not isinstance(content, bool):
        raise InputError(f"must be true or false, got {quoted(content)}")
    return content


def word(content: Any, *words: str) -> str:
    """Return one of these words."""
    if content not in words:
        raise InputError(f"must be {' or '.join(words)}, got {quoted(content)}")
    return str(content)


def made(kind: Callable[..., T], content: Any) -> T:
    """Return a data class from its fields by name; fields without a default are required."""
    known = {each.name: each for each in fields(kind)}  # type: ignore[arg-type]
    check_keys(content, known)
    for key, each in known.items():
        if key not in content and each.default is MISSING:
            raise InputError(f"{key} is missing")
        if key in content and isinstance(content[key], bool) != isinstance(each.default, bool):
            raise InputError(f"{key} has the wrong type: {quoted(content[key])}")
    return kind(**content)


def numbers(content: Any, count: int) -> tuple[float, ...]:
    """Return a list of `count` numbers as a tuple."""
    if not isinstance(content, list) or len(content) != count:
        raise InputError(f"must be {count} numbers, got {quoted(content)}")
    return tuple(map(number, content))


def number(content: Any) -> float:
    """Return a number."""
    if isinstance(content, bool) or not isinstance(content, _NUMBER):
        raise InputError(f"must be a number, got {quoted(content)}")
    return float(content)


def array(content: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Return numbers as an array of that shape."""
    if len(shape) == 1:
        return np.array(numbers(content, shape[0]))
    if not isinstance(content, list) or len(content) != shape[0]:
        raise InputError(f"must be {shape[0]} rows of numbers, got {quoted(content)}")
    return np.stack([array(row, shape[1:]) for row in content])


def check_keys(content: Any, known: Mapping[str, Any]) -> None:
    """Raise InputError unless the content is an object with known keys only."""
    if not isinstance(content, dict):
        raise InputError(f"must be an object with {', '.join(known)}, got {quoted(content)}")
    unknown = sorted(set(content) - set(known))
    if unknown:
        raise InputError(f"unknown key {quoted(unknown[0])}; keys are {', '.join(known)}")


def quoted(thing: Any) -> str:
    """Return the representation of `thing`, shortened to fit on a line."""
    return repr(thing) if isinstance(thing, str) and len(thing) <= _MOST_SHOWN else reprlib.repr(thing)


def _of_types(content: Any, types: Mapping[str, Any]) -> dict[str, Any]:
    check_keys(content, types)
    for key, value in content.items():
        if not isinstance(value, types[key]) or (isinstance(value, bool) and types[key] is not bool):
            raise InputError(f"{key} has the wrong type: {quoted(value)}")
    return dict(content)
