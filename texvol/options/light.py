"""Converters of the options for light, gradients, materials and projection modes.

A light is `head`, `directional:X,Y,Z` (direction towards the light; `X,Y,Z` for short) or `point:X,Y,Z` (position),
each with `:R,G,B` or `:I` for its colour, and a point light then with `:K` for its fall-off; or a word that stands
alone: `ambient`, light from everywhere only; `depth`, shading by depth; `none`; or the name of a set of lights, placed
by the camera. In a scene file a light may be a table: {kind = "point", position = [100, 0, 50], color =
[1, 0.9, 0.8], fall-off = 200}.

A depth cue is `S` or `S,R,G,B`, each with `:NEAR,FAR` for the depths between which it grows, one of which may be left
out; in a scene file also {strength = 0.5, color = [0, 0, 0], near = 100, far = 300}.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, cast

from texvol.options import texts
from texvol.scene.camera import Camera
from texvol.scene.display import NUMBER_MODES, Window, checked_window
from texvol.scene.gradient import Estimator, EstimatorKind
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.light_sets import LIGHT_SETS, light_set
from texvol.scene.lighting import LIGHT_KINDS, DepthCue, Light, Lighting, LightKind, Triple
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

AMBIENT, DEPTH, NO_LIGHT = "ambient", "depth", "none"
WORDS = ("head", *LIGHT_SETS, AMBIENT, DEPTH, NO_LIGHT)  # lights that need no numbers
SHADING = ("ambient", "diffuse", "specular", "shininess", "two-sided", "fade", "shadows")
_LIGHT_FORMS = (
    "head, directional:X,Y,Z, X,Y,Z, point:X,Y,Z (each may end with :R,G,B or :I, a point light also with :COLOR:K), "
    f"{', '.join(LIGHT_SETS)}, {AMBIENT}, {DEPTH} or {NO_LIGHT}"
)
# Keys of a table beside `kind`, in the order of the text form.
_TABLE_KEYS: dict[str, tuple[str, ...]] = {
    "head": ("color",),
    "directional": ("direction", "color"),
    "point": ("position", "color", "fall-off"),
    AMBIENT: (),
    DEPTH: (),
    NO_LIGHT: (),
    **dict.fromkeys(LIGHT_SETS, ()),
}
_FRONT = Camera.orthographic((0, -1, 0), (0, 0, 0), (0, 0, 1), height=1)  # as long as no camera is known
# An isosurface without light shows its own colour and does not depend on the gradient; without this it would be black.
_OWN_COLOR = Lighting((), ambient=1.0, diffuse=0.0, specular=0.0)
_FOR_MODES = {
    "isovalue": ("isosurface",),
    "air": ("xray",),
    "window": NUMBER_MODES,
    **dict.fromkeys(("caps", "add", "label-look"), ("composite",)),
}
# Options of a scene file that are dropped if the command line has this option.
_PLACED = ("eye", "target", "height")
_SEEN_FROM = ("view", "azimuth", "elevation", "fit")
_REPLACED_BY = {
    "tf": ("coloring", "label-look"),
    "window": ("coloring",),
    "label-look": ("tf", "materials"),
    **dict.fromkeys(_PLACED, (*_SEEN_FROM, "zoom")),
    **dict.fromkeys(_SEEN_FROM, (*_PLACED, "up")),
}


def light(text: str) -> Light | str:
    """Return a light, or one of the words `ambient`, `depth` and `none`, or the name of a set of lights."""
    kind, *parts = (part.strip() for part in text.split(":"))
    if "," in kind:
        kind, parts = "directional", [kind, *parts]
    if kind in (AMBIENT, DEPTH, NO_LIGHT, *LIGHT_SETS) and not parts:
        return kind
    if kind not in LIGHT_KINDS or len(parts) > len(_TABLE_KEYS[kind]):
        near = did_you_mean(kind, _TABLE_KEYS) if kind not in _TABLE_KEYS else ""
        raise argparse.ArgumentTypeError(f"must be {_LIGHT_FORMS}, got {text!r}{near}")
    key = _TABLE_KEYS[kind][0] if kind != "head" else ""
    triple = parts.pop(0) if key and parts else ""
    vector = cast(Triple, texts.numbers(triple, f"a {key} X,Y,Z", 3)) if triple else None
    color = _light_color(parts[0]) if any(parts[:1]) or len(parts) == 1 else Light.color
    fall_off = texts.numbers(parts[1], "a fall-off K, a distance", 1)[0] if len(parts) > 1 else None
    return texts.made(lambda: Light(cast(LightKind, kind), vector, color, fall_off), names_option=True)


def light_table(table: Mapping[str, Any]) -> Light | str:
    """Return the light of a table with `kind`, `direction` or `position`, `color`, and `fall-off` of a point light."""
    kind = table.get("kind", "nothing")
    if not isinstance(kind, str) or kind not in _TABLE_KEYS:
        near = did_you_mean(str(kind), _TABLE_KEYS)
        raise argparse.ArgumentTypeError(f"kind must be one of {', '.join(_TABLE_KEYS)}, got {kind!r}{near}")
    known = _TABLE_KEYS[kind]
    unknown = [key for key in table if key not in ("kind", *known)]
    if unknown:
        raise argparse.ArgumentTypeError(
            f"unknown key {unknown[0]!r} for kind {kind}; keys are {', '.join(('kind', *known))}"
        )
    parts = [texts.as_text(table.get(key, "")) for key in known]
    return light(":".join([kind, *parts]).rstrip(":"))


def fraction(text: str) -> float:
    """Return a number of at least 0."""
    (value,) = texts.numbers(text, "a number of at least 0", 1)
    if value < 0:
        raise argparse.ArgumentTypeError(f"must be a number of at least 0, got {text!r}")
    return value


def finite(text: str) -> float:
    """Return a finite number."""
    return texts.numbers(text, "a finite number", 1)[0]


def gradient(text: str) -> Estimator:
    """Return the gradient estimator of "central", "zucker-hummel", "adaptive" or "gaussian[:SCALE]"."""
    kind, colon, scale = (part.strip() for part in text.partition(":"))
    if colon and kind != "gaussian":
        raise argparse.ArgumentTypeError(f"must be central, zucker-hummel, adaptive or gaussian[:SCALE], got {text!r}")
    numbers = texts.numbers(scale, "gaussian:SCALE, with SCALE a number of samples", 1) if colon else ()
    return texts.made(lambda: Estimator(cast(EstimatorKind, kind), *numbers), names_option=True)


def depth_cue(text: str) -> DepthCue:
    """Return the depth cue of "S[,R,G,B][:NEAR,FAR]"."""
    look, _, ends = text.partition(":")
    strength, _, name = look.partition(",")
    named = cast(Triple, texts.rgb(name, "a strength S, or S,R,G,B")) if texts.is_word(name) else None
    numbers = texts.numbers(strength if named else look, "a strength S, or S,R,G,B", 1, 4)
    color = named or (cast(Triple, numbers[1:]) if len(numbers) > 1 else DepthCue.color)
    near, far = _ends(ends) if ":" in text else (None, None)
    return texts.made(lambda: DepthCue(numbers[0], color, near, far), names_option=True)


def depth_cue_value(value: Any) -> DepthCue:
    """Return the depth cue of a scene file: number, text, array, or table of `strength`, `color`, `near`, `far`."""
    if isinstance(value, bool):
        raise argparse.ArgumentTypeError(f"must be a strength S, or S,R,G,B, got {value!r}")
    if not isinstance(value, Mapping):
        return depth_cue(texts.as_text(value))
    unknown = [key for key in value if key not in ("strength", "color", "near", "far")]
    if unknown or "strength" not in value:
        raise argparse.ArgumentTypeError(f"keys must be strength, color, near and far, got {dict(value)!r}")
    expected = {"strength": ("a strength S", 1), "color": ("a colour R,G,B", 3)}
    parts: dict[str, Any] = {}
    for key, each in value.items():
        form, count = expected.get(key, (f"{key}, a depth in world units", 1))
        as_text = texts.as_text(each)
        numbers = texts.rgb(as_text, form) if key == "color" else texts.numbers(as_text, form, count)
        parts[key] = numbers if key == "color" else numbers[0]
    return texts.made(lambda: DepthCue(**parts), names_option=True)


def _ends(text: str) -> tuple[float | None, float | None]:
    parts = text.split(",")
    form = ":NEAR,FAR, depths in world units, one of which may be left out"
    if len(parts) != 2 or not text.strip(", "):
        raise argparse.ArgumentTypeError(f"must be {form}, got {text!r}")
    near, far = (texts.numbers(part, form, 1)[0] if part.strip() else None for part in parts)
    return near, far


def materials(text: str) -> tuple[str, ...]:
    """Return the names of "NAME,NAME"."""
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"must be names separated by commas, got {text!r}")
    return names


def window(text: str) -> Window:
    """Return (centre, width) in data units."""
    return texts.made(lambda: checked_window(text), names_option=True)


def with_head_light(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Return `chosen` with a head light, if it sets shading but no light; `shadows = false` does not count."""
    asks = any(name in chosen for name in SHADING if name != "shadows") or chosen.get("shadows", False)
    return ({"light": [Light()]} if asks else {}) | dict(chosen)


def lighting(chosen: Mapping[str, Any], camera: Camera = _FRONT) -> Lighting | None:
    """Return the lighting of the options, by their names; None if they set none.

    A set of lights is placed by the camera, by default one at the front.
    """
    lights = chosen.get("light", [])
    words = [each for each in lights if isinstance(each, str)]
    if words and len(lights) > 1:
        raise InputError(f"light: {words[0]} must be the only light, got {len(lights)} lights")
    shading = {name.replace("-", "_"): chosen[name] for name in SHADING if name in chosen}
    if words == [AMBIENT]:
        return Lighting((), **shading)
    if words and words[0] in LIGHT_SETS:
        return replace(light_set(words[0], camera), **shading)
    if words and chosen.get("mode") == "isosurface":
        return _OWN_COLOR  # None would mean the default head light
    if words or not lights:
        return None
    return Lighting(lights, **shading)


def placed(chosen: Mapping[str, Any], lighting_of_look: Lighting | None, camera: Camera) -> Lighting | None:
    """Return the lighting of a scene: of the options, a set of lights placed by the scene's camera, or of a look."""
    is_set = any(isinstance(each, str) and each in LIGHT_SETS for each in chosen.get("light", ()))
    return lighting(chosen, camera) if is_set else lighting_of_look


def depth_cue_of(chosen: Mapping[str, Any]) -> DepthCue | None:
    """Return the depth cue of the options: --depth-cue, or full strength to black for light `depth`."""
    by_light = DepthCue(1.0) if chosen.get("light") == [DEPTH] else None
    cue: DepthCue | None = chosen.get("depth-cue", by_light)
    return cue if cue is not None and cue.strength > 0 else None


def overridden(file: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of scene file and command line, without those of the file that the line makes meaningless.

    These are options for another mode, the other look of a volume (transfer function or look of labels), and the other
    way to show numbers (grey or in colours).
    """
    dropped = {name for option in line for name in _REPLACED_BY.get(option, ())}
    if line.get("coloring") == "tf":
        dropped.add("window")
    if "mode" in line:
        dropped |= {name for name, modes in _FOR_MODES.items() if line["mode"] not in modes}
    return {name: value for name, value in file.items() if name not in dropped} | dict(line)


def isosurface(text: str) -> Isosurface:
    """Return the isosurface of "V", "V:R,G,B", "V:A" or "V:R,G,B:A"."""
    value, *look = (part.strip() for part in text.split(":"))
    is_color = bool(look) and ("," in look[0] or texts.is_word(look[0]))
    color = cast(Triple, texts.rgb(look.pop(0), "a colour R,G,B")) if is_color else None
    if len(look) > 1:
        raise argparse.ArgumentTypeError(f"must be V[:R,G,B][:A], got {text!r}")
    opacity = texts.number(look[0]) if look else 1.0
    return texts.made(lambda: Isosurface(finite(value), color, opacity), names_option=True)


def isosurface_table(table: Mapping[str, Any]) -> Isosurface:
    """Return the isosurface of a scene file's {value = …, color = [R, G, B], opacity = A}."""
    known = {"value", "color", "opacity"}
    if unknown := set(table) - known:
        raise argparse.ArgumentTypeError(
            f"must have keys of {', '.join(sorted(known))}, got {', '.join(sorted(unknown))}"
        )
    if "value" not in table:
        raise argparse.ArgumentTypeError("must have a value")
    color = table.get("color")
    numbers = None if color is None else cast(Triple, texts.rgb(texts.as_text(color), "a colour R,G,B"))
    value, opacity = (table.get(name, 1.0) for name in ("value", "opacity"))
    for name, number in (("value", value), ("opacity", opacity)):
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise argparse.ArgumentTypeError(f"{name} must be a number, got {number!r}")
    return texts.made(lambda: Isosurface(value, numbers, opacity), names_option=True)


def isosurfaces_value(value: Any) -> list[Isosurface]:
    """Return the isosurfaces of a scene file: a number, a text or a table, or an array of these."""
    found = []
    for each in value if isinstance(value, list) else [value]:
        if isinstance(each, dict):
            found.append(isosurface_table(each))
        elif isinstance(each, str) or (isinstance(each, int | float) and not isinstance(each, bool)):
            found.append(isosurface(texts.as_text(each)))
        else:
            raise argparse.ArgumentTypeError(f"must be a value, a text or a table, or an array of these, got {each!r}")
    return found


def isosurfaces_of(chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scene's isovalue, or its isosurfaces where they are several, or have looks of their own."""
    found: list[Isosurface] = chosen.get("isovalue", [])
    if len(found) == 1 and found[0] == Isosurface(found[0].value):
        return {"isovalue": found[0].value}
    return {"isosurfaces": tuple(found)}


def check_view(chosen: Mapping[str, Any]) -> None:
    """Raise InputError if the view is given twice, by a place of the eye and by a side."""
    placed = [name for name in _PLACED if name in chosen]
    seen = [name for name in _SEEN_FROM if name in chosen]
    if placed and seen:
        raise InputError(f"--{placed[0]} and --{seen[0]} both decide the view: give one of them")


def check_mode(chosen: Mapping[str, Any]) -> None:
    """Raise InputError if an option is for another projection mode than the chosen one."""
    now = chosen.get("mode", "composite")
    for name, modes in _FOR_MODES.items():
        if name in chosen and now not in modes:
            raise InputError(f"--{name} needs --mode {' or '.join(modes)}, got --mode {now}")
    if "window" in chosen and chosen.get("coloring") == "tf":
        raise InputError("--window needs --coloring grey, got --coloring tf: leave one of them out")
    if now == "isosurface" and "isovalue" not in chosen:
        raise InputError("--mode isosurface needs --isovalue V, in data units")


def _light_color(text: str) -> Triple:
    numbers = texts.rgb(text, "a colour R,G,B or a brightness I", 1, 3)
    return cast(Triple, numbers * 3 if len(numbers) == 1 else numbers)
