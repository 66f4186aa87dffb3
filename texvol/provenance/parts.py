"""Parts of a picture's header, from JSON to what they stand for; `stored_scene` says what they are parts of.

Each raises InputError, or TypeError, ValueError and OverflowError, where it gets what texvol never writes.
"""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.rendering import accuracy
from texvol.rendering.settings import Settings
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Light, Lighting
from texvol.scene.transfer import TransferFunction
from texvol.textures.slab_texture import TEXEL_FORMATS
from texvol.util.errors import InputError

_NUMBER = (int, float)
# How a volume is read again, and of which type that is.
SOURCE: dict[str, Any] = {"path": str, "absolute": str, "shape": list, "dtype": str, "series": str, "spacing": list}
SOURCE |= {"variable": str, "resolution": list, "missing": list}
SOURCE |= {"channel": int, "time": int, "labels": bool, "color": bool}
SOURCE |= {"built_in": str, "samples": int, "transform": list}
_SETTINGS: dict[str, Any] = {
    each.name: {"float": _NUMBER, "str": str, "bool": bool}[str(each.type)] for each in fields(Settings)
}
_MOST_SHOWN = 200  # characters of a text that is quoted; a path has that many

T = TypeVar("T")


def transfer_function(content: Any) -> TransferFunction:
    """Return the transfer function that a header holds."""
    return TransferFunction.from_content(content, "transfer function")


def settings(content: Any) -> dict[str, Any]:
    """Arguments for `Renderer.render`."""
    found = _of_types(content, _SETTINGS)
    thickness = found.get("slab_thickness", 1.0)
    if not 0 < thickness < np.inf:
        raise InputError(f"slab_thickness is positive and finite, and not {thickness:g}")
    accuracy.checked_termination(found.get("early_termination"), None)
    accuracy.checked_target(found.get("target_format", "auto"))
    if found.get("texture_format", "auto") not in ("auto", *TEXEL_FORMATS):
        raise InputError(f"texture_format is {quoted(found['texture_format'])}")
    return found


def source(content: Any) -> dict[str, Any]:
    """Where a volume comes from, and arguments of `texvol.load`."""
    found = _of_types(content, SOURCE)
    for key, kind in (("shape", (int,)), ("resolution", (int,)), ("spacing", _NUMBER)):
        if key in found and not (len(found[key]) == 3 and all(type(each) in kind for each in found[key])):
            raise InputError(f"{key} is three numbers, and not {quoted(found[key])}")
    for each in found.get("missing", ()):
        number(each)
    if "transform" in found:
        found["transform"] = array(found["transform"], (4, 4))
    return found


def mask_source(content: Any) -> tuple[dict[str, Any], tuple[float, float] | None]:
    """Where a mask comes from, and between which values it fades in."""
    if not isinstance(content, dict):
        raise InputError(f"an object is wanted, and not {quoted(content)}")
    fade = numbers(content["fade"], 2) if "fade" in content else None
    found = source({key: value for key, value in content.items() if key != "fade"})
    return found, None if fade is None else (fade[0], fade[1])


def lighting(content: Any) -> Lighting:
    """Lights, and how matter answers them."""
    if not isinstance(content, dict) or not isinstance(content.get("lights"), list):
        raise InputError(f"an object with a list of lights is wanted, and not {quoted(content)}")
    return made(Lighting, content | {"lights": [made(Light, each) for each in content["lights"]]})


def clip_planes(content: Any) -> tuple[ClipPlane, ...]:
    """Planes that cut."""
    if not isinstance(content, list):
        raise InputError(f"a list of planes is wanted, and not {quoted(content)}")
    return tuple(made(ClipPlane, each) for each in content)


def switch(content: Any) -> bool:
    """True or false."""
    if not isinstance(content, bool):
        raise InputError(f"true or false is wanted, and not {quoted(content)}")
    return content


def made(kind: Callable[..., T], content: Any) -> T:
    """One of our data classes from its fields by name; those without a default have to be there."""
    known = {each.name: each for each in fields(kind)}  # type: ignore[arg-type]
    check_keys(content, known)
    for key, each in known.items():
        if key not in content and each.default is MISSING:
            raise InputError(f"it lacks {key}")
        if key in content and isinstance(content[key], bool) != isinstance(each.default, bool):
            raise InputError(f"{key} is {quoted(content[key])}")
    return kind(**content)


def numbers(content: Any, count: int) -> tuple[float, ...]:
    """So many numbers."""
    if not isinstance(content, list) or len(content) != count:
        raise InputError(f"{count} numbers are wanted, and not {quoted(content)}")
    return tuple(map(number, content))


def number(content: Any) -> float:
    """A number."""
    if isinstance(content, bool) or not isinstance(content, _NUMBER):
        raise InputError(f"a number is wanted, and not {quoted(content)}")
    return float(content)


def array(content: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Numbers in that shape."""
    if len(shape) == 1:
        return np.array(numbers(content, shape[0]))
    if not isinstance(content, list) or len(content) != shape[0]:
        raise InputError(f"{shape[0]} rows of numbers are wanted, and not {quoted(content)}")
    return np.stack([array(row, shape[1:]) for row in content])


def check_keys(content: Any, known: Mapping[str, Any]) -> None:
    """Raise InputError unless it is an object with no other keys than those."""
    if not isinstance(content, dict):
        raise InputError(f"an object with {', '.join(known)} is wanted, and not {quoted(content)}")
    unknown = sorted(set(content) - set(known))
    if unknown:
        raise InputError(f"there is no {quoted(unknown[0])}; there are {', '.join(known)}")


def quoted(thing: Any) -> str:
    """`thing` as it is written, of a length that a line can take."""
    return repr(thing) if isinstance(thing, str) and len(thing) <= _MOST_SHOWN else reprlib.repr(thing)


def _of_types(content: Any, types: Mapping[str, Any]) -> dict[str, Any]:
    check_keys(content, types)
    for key, value in content.items():
        if not isinstance(value, types[key]) or (isinstance(value, bool) and types[key] is not bool):
            raise InputError(f"{key} is {quoted(value)}")
    return dict(content)
