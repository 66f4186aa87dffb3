"""What the texts of the options for light, gradients, materials and projection modes become.

A light is `head`, `directional:X,Y,Z` (where it comes from; `X,Y,Z` for short) or `point:X,Y,Z`, each with `:R,G,B` or
`:I` for its colour; or one of three words that stand alone: `ambient`, light from everywhere and no other; `depth`,
shading by depth; and `none`. In a scene file it may be a table as well: {kind = "point", position = [100, 0, 50],
color = [1, 0.9, 0.8]}.

A depth cue is `S` or `S,R,G,B`, each with `:NEAR,FAR` for the depths between which it grows, either of which may be
left out; in a scene file {strength = 0.5, color = [0, 0, 0], near = 100, far = 300} as well.

Converters raise argparse.ArgumentTypeError: whoever calls them says for which option.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

from texvol.scene.display import NUMBER_MODES, Window, checked_window
from texvol.scene.gradient import Estimator, EstimatorKind
from texvol.scene.lighting import LIGHT_KINDS, DepthCue, Light, Lighting, LightKind, Triple
from texvol.scene.scene import MODES
from texvol.util.errors import InputError

AMBIENT, DEPTH, NO_LIGHT = "ambient", "depth", "none"
SHADING = ("ambient", "diffuse", "specular", "shininess", "two-sided", "fade", "shadows")
_LIGHT_FORMS = (
    f"head, directional:X,Y,Z, X,Y,Z, point:X,Y,Z (each may end with :R,G,B or :I), {AMBIENT}, {DEPTH} or {NO_LIGHT}"
)
# Keys of a table beside its kind, in the order in which a text has them.
_TABLE_KEYS: dict[str, tuple[str, ...]] = {
    "head": ("color",),
    "directional": ("direction", "color"),
    "point": ("position", "color"),
    AMBIENT: (),
    DEPTH: (),
    NO_LIGHT: (),
}
# An isosurface without light is not black: all of its own colour, and nothing that depends on the gradient.
_OWN_COLOR = Lighting((), ambient=1.0, diffuse=0.0, specular=0.0)
_FOR_MODES = {
    "isovalue": ("isosurface",),
    "air": ("xray",),
    "window": NUMBER_MODES,
    **dict.fromkeys(("caps", "add", "label-look"), ("composite",)),
}

T = TypeVar("T")


def light(text: str) -> Light | str:
    """A light, or one of the words `ambient`, `depth` and `none`."""
    kind, *parts = (part.strip() for part in text.split(":"))
    if "," in kind:
        kind, parts = "directional", [kind, *parts]
    if kind in (AMBIENT, DEPTH, NO_LIGHT) and not parts:
        return kind
    if kind not in LIGHT_KINDS or len(parts) > len(_TABLE_KEYS[kind]):
        raise argparse.ArgumentTypeError(f"a light is {_LIGHT_FORMS}, and not {text!r}")
    position = _TABLE_KEYS[kind][0] if kind != "head" else ""
    where = parts.pop(0) if position and parts else ""
    vector = cast(Triple, _numbers(where, f"a {position} X,Y,Z", 3)) if where else None
    color = _light_color(parts[0]) if parts else Light.color
    return _checked(lambda: Light(cast(LightKind, kind), vector, color))


def light_table(table: Mapping[str, Any]) -> Light | str:
    """The same from a table with `kind`, `direction` or `position`, and `color`."""
    kind = table.get("kind", "nothing")
    if not isinstance(kind, str) or kind not in _TABLE_KEYS:
        raise argparse.ArgumentTypeError(f"kind is one of {', '.join(_TABLE_KEYS)}, and not {kind!r}")
    known = _TABLE_KEYS[kind]
    unknown = [key for key in table if key not in ("kind", *known)]
    if unknown:
        raise argparse.ArgumentTypeError(f"a light of kind {kind} has no {unknown[0]!r}")
    parts = [as_text(table.get(key, "")) for key in known]
    while parts and not parts[-1]:
        parts.pop()
    return light(":".join([kind, *parts]))


def as_text(value: Any) -> str:
    """What stands in a scene file as it would stand on the line."""
    return ",".join(str(part) for part in value) if isinstance(value, list) else str(value)


def fraction(text: str) -> float:
    """A number from 0 upwards."""
    (wanted,) = _numbers(text, "a number from 0 upwards", 1)
    if wanted < 0:
        raise argparse.ArgumentTypeError(f"a number from 0 upwards is wanted, and not {text!r}")
    return wanted


def finite(text: str) -> float:
    """A finite number."""
    return _numbers(text, "a finite number", 1)[0]


def gradient(text: str) -> Estimator:
    """An estimator from "central", "zucker-hummel" or "gaussian[:SCALE]"."""
    kind, colon, scale = (part.strip() for part in text.partition(":"))
    if colon and kind != "gaussian":
        raise argparse.ArgumentTypeError(f"central, zucker-hummel or gaussian[:SCALE] is wanted, and not {text!r}")
    numbers = _numbers(scale, "gaussian:SCALE, a number of samples,", 1) if colon else ()
    return _checked(lambda: Estimator(cast(EstimatorKind, kind), *numbers))


def depth_cue(text: str) -> DepthCue:
    """A depth cue from "S[,R,G,B][:NEAR,FAR]"."""
    look, _, ends = text.partition(":")
    numbers = _numbers(look, "a strength S, or S,R,G,B,", 1, 4)
    color = cast(Triple, numbers[1:]) if len(numbers) > 1 else DepthCue.color
    near, far = _ends(ends) if ":" in text else (None, None)
    return _checked(lambda: DepthCue(numbers[0], color, near, far))


def depth_cue_value(value: Any) -> DepthCue:
    """The same from a scene file: a number, a text, an array, or a table with `strength`, `color`, `near`, `far`."""
    if isinstance(value, bool):
        raise argparse.ArgumentTypeError(f"a strength S, or S,R,G,B, is wanted, and not {value!r}")
    if not isinstance(value, Mapping):
        return depth_cue(as_text(value))
    unknown = [key for key in value if key not in ("strength", "color", "near", "far")]
    if unknown or "strength" not in value:
        raise argparse.ArgumentTypeError(f"a depth cue has strength, color, near and far, and is not {dict(value)!r}")
    wanted = {"strength": ("a strength S", 1), "color": ("a colour R,G,B", 3)}
    parts: dict[str, Any] = {}
    for key, each in value.items():
        what, count = wanted.get(key, (f"{key}, a depth in world units,", 1))
        numbers = _numbers(as_text(each), what, count)
        parts[key] = numbers if key == "color" else numbers[0]
    return _checked(lambda: DepthCue(**parts))


def _ends(text: str) -> tuple[float | None, float | None]:
    parts = text.split(",")
    wanted = ":NEAR,FAR, depths in world units of which one may be left out,"
    if len(parts) != 2 or not text.strip(", "):
        raise argparse.ArgumentTypeError(f"{wanted} are wanted, and not {text!r}")
    near, far = (_numbers(part, wanted, 1)[0] if part.strip() else None for part in parts)
    return near, far


def materials(text: str) -> tuple[str, ...]:
    """Names of materials from "NAME,NAME"."""
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"names with commas between are wanted, and not {text!r}")
    return names


def window(text: str) -> Window:
    """(centre, width) in data units."""
    return _checked(lambda: checked_window(text))


def with_head_light(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """`chosen`, and a head light if it says how matter is lit and not by what; no shadows are no wish for light."""
    asks = any(name in chosen for name in SHADING if name != "shadows") or chosen.get("shadows", False)
    return ({"light": [Light()]} if asks else {}) | dict(chosen)


def lighting(chosen: Mapping[str, Any]) -> Lighting | None:
    """Light of the options, by their names; None where they say nothing of it."""
    lights = chosen.get("light", [])
    words = [each for each in lights if isinstance(each, str)]
    if words and len(lights) > 1:
        raise InputError(f"light: {words[0]} goes with no other light, and {len(lights)} were given")
    shading = {name.replace("-", "_"): chosen[name] for name in SHADING if name in chosen}
    if words == [AMBIENT]:
        return Lighting((), **shading)
    if words and chosen.get("mode") == "isosurface":
        return _OWN_COLOR  # None would give it the head light that it has by default
    if words or not lights:
        return None
    return Lighting(lights, **shading)


def depth_cue_of(chosen: Mapping[str, Any]) -> DepthCue | None:
    """The depth cue of the options: as it says, or that of light `depth`: all the way to black."""
    by_light = DepthCue(1.0) if chosen.get("light") == [DEPTH] else None
    cue: DepthCue | None = chosen.get("depth-cue", by_light)
    return cue if cue is not None and cue.strength > 0 else None


def overridden(file: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """Options of the scene file and the line; the line drops what the file says that its own options are not for.

    These are options for another mode, and one of two ways to show numbers: as grey, or in colours.
    """
    kept = dict(file)
    if "tf" in line or "window" in line:
        kept.pop("coloring", None)
    if line.get("coloring") == "tf":
        kept.pop("window", None)
    if "mode" in line:
        kept = {name: kept[name] for name in kept if line["mode"] in _FOR_MODES.get(name, MODES)}
    return kept | dict(line)


def check_mode(chosen: Mapping[str, Any]) -> None:
    """InputError if an option is for another projection mode than the chosen one."""
    now = chosen.get("mode", "composite")
    for name, modes in _FOR_MODES.items():
        if name in chosen and now not in modes:
            raise InputError(f"--{name} is for --mode {' or '.join(modes)}, and the mode is {now}")
    if "window" in chosen and chosen.get("coloring") == "tf":
        raise InputError("--window is for --coloring grey, and the coloring is tf: leave one of them out")
    if now == "isosurface" and "isovalue" not in chosen:
        raise InputError("--mode isosurface needs --isovalue V, in data units")


def _light_color(text: str) -> Triple:
    numbers = _numbers(text, "a colour R,G,B or a brightness I", 1, 3)
    return cast(Triple, numbers * 3 if len(numbers) == 1 else numbers)


def _numbers(text: str, wanted: str, *counts: int) -> tuple[float, ...]:
    """Finite numbers with commas between, as many as one of `counts`."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in counts or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"{wanted} is wanted, and not {text!r}")
    return numbers


def _checked(make: Callable[[], T]) -> T:
    """What `make` returns; its InputError without its first word, which the option's name says already."""
    try:
        return make()
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error).partition(": ")[2]) from None
