"""Random scenes that are hard on a renderer: values far apart, odd grids, odd matter, odd views; each said in words.

A scene is made of parts drawn at random, one function for each. The base of a volume lies between 0 and 1 and goes to
an interval of its type, of which the transfer function, the isovalue or the window then speak; a few samples may lie
far off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.gradient import Estimator
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, MODES, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

Random = np.random.Generator
SIZE = (32, 32)
_FLOATS, _INTEGERS = ("f2", "f4", "f4", "f8", "f8"), ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8")
FAR_FLOATS = (1e4, -1e5, 1e6, 1e8, -9999.0, 65504.0, -1e10, 1e16, 9.97e36, -3.4e38, 1e38, 1e200, -1e300, 1.7e308)
_STRANGE = (np.nan, np.inf, -np.inf)


@dataclass(frozen=True)
class OddScene:
    """A scene, what is odd about it, and the arguments that it is drawn with."""

    number: int
    scene: Scene
    words: tuple[str, ...]
    options: dict[str, Any] = field(default_factory=dict)
    size: tuple[int, int] = SIZE


def odd_scene(number: int, seed: int = 0, *, far_off: bool = False) -> OddScene:
    """Scene of a number; with `far_off` one with a far-off sample of which a maximum error is wanted."""
    random = np.random.default_rng([seed, number, int(far_off)])
    words: list[str] = []
    mode = _mode(random, far_off)
    words.append(mode)
    while True:  # some parts do not go together, and Scene says so
        try:
            scene = _scene(random, mode, words, far_off)
            break
        except InputError:
            del words[1:]
    wanted = far_off or random.random() < 0.4
    if wanted:
        error = float(10 ** random.uniform(-2.5, -1)) * _scale(scene)
        words.append(f"max_error {error:.3g}")
        return OddScene(number, scene, tuple(words), {"max_error": error})
    rate = float(random.choice([0.5, 1, 1, 2, 4]))
    words.append(f"rate {rate:g}")
    return OddScene(number, scene, tuple(words), {"sampling_rate": rate})


def _chance(random: Random, probability: float) -> bool:
    return bool(random.random() < probability)


def _one(random: Random, choices: Sequence[Any]) -> Any:
    return choices[int(random.integers(len(choices)))]


def _mode(random: Random, far_off: bool) -> str:
    others = [mode for mode in MODES if mode != "composite"]
    composite = 0.55 if far_off else 0.6
    return "composite" if _chance(random, composite) else str(_one(random, others))


def _scene(random: Random, mode: str, words: list[str], far_off: bool) -> Scene:
    volume, ends = _volume(random, words, far_off)
    parts: dict[str, Any] = {"mode": mode, "camera": _camera(random, volume, words)}
    if mode == "composite":
        parts["classification"] = _one(random, CLASSIFICATIONS)
        words.append(parts["classification"])
        parts["transfer_function"] = _medium(random, volume, ends, words)
        lit = _chance(random, 0.3)
        if _chance(random, 0.1):
            parts["added"] = (_added(random, volume, words),)
            lit = False
    else:
        lit = mode == "isosurface" and _chance(random, 0.6)
    if mode == "isosurface":
        parts["isovalue"] = _isovalue(random, volume, ends, words)
    if lit:
        parts["lighting"] = _lighting(random, volume, mode, words)
        parts["gradient"] = Estimator(_one(random, ("central", "central", "zucker-hummel", "gaussian")))
    if _chance(random, 0.08) and mode in ("composite", "isosurface"):
        parts["depth_cue"] = DepthCue(float(random.random()))
        words.append("depth cue")
    parts |= _cutting(random, volume, mode, words)
    if _chance(random, 0.12):
        parts["mask"] = _mask(random, volume, words)
    if _chance(random, 0.3) and mode in ("composite", "isosurface"):
        parts["background"] = tuple(float(each) for each in random.random(3))
    return Scene(volume, **({"classification": "slab"} | parts))


def _base(random: Random, words: list[str]) -> NDArray[np.float64]:
    """Values between 0 and 1."""
    shape = random.integers(3, 14, 3)
    if _chance(random, 0.12):
        shape[int(random.integers(3))] = 1
    if _chance(random, 0.03):
        shape[:] = _one(random, ((1, 1, 1), (1, 1, 9), (2, 2, 2), (1, 8, 1)))
    z, y, x = np.meshgrid(*((np.arange(n) + 0.5) / n for n in shape), indexing="ij")
    kinds: dict[str, Callable[[], NDArray[np.float64]]] = {
        "wave": lambda: 0.5 + 0.5 * np.sin(5 * x + 3 * y) * np.cos(4 * z + 1),
        "noise": lambda: random.random(shape),
        "ramp": lambda: (x + y + z) / 3,
        "step": lambda: (x + 0.3 * y > 0.6).astype(float),
        "ball": lambda: np.clip(1.2 - 2 * np.sqrt((x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2), 0, 1),
        "spikes": lambda: (random.random(shape) < 0.03).astype(float),
        "constant": lambda: np.full(shape, 0.5),
        "levels": lambda: np.floor(4 * random.random(shape)) / 4,
    }
    kind = _one(random, list(kinds))
    words.append(f"{kind} {'x'.join(map(str, shape[::-1]))}")
    return kinds[kind]()


def _volume(random: Random, words: list[str], far_off: bool) -> tuple[Volume, tuple[float, float]]:
    """A volume, and the interval that its base has become."""
    base = _base(random, words)
    dtype = np.dtype(_one(random, _FLOATS if _chance(random, 0.6) else _INTEGERS))
    low, high = _ends(random, dtype)
    with np.errstate(over="ignore", invalid="ignore"):
        values = (low + base * (high - low)).astype(dtype)
    words.append(f"{dtype.name} {low:.4g} … {high:.4g}")
    if far_off or _chance(random, 0.35):
        values = _with_far_off(random, values, (low, high), words)
    if dtype.kind == "f" and _chance(random, 0.04 if far_off else 0.12):
        strange = _one(random, _STRANGE)
        values.flat[random.integers(values.size, size=_one(random, (1, 1, 4)))] = strange
        words.append(f"some {strange}")
    spacing = np.ones(3)
    if _chance(random, 0.4):
        spacing = 10 ** random.uniform(-0.5, 0.5, 3)
    if _chance(random, 0.15):
        spacing = spacing * _one(random, (1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12))
        words.append(f"spacing {spacing[0]:.3g}")
    origin = random.uniform(-9, 9, 3) * spacing * _one(random, (0, 1, 1, 100))
    return Volume(values, spacing, origin, _direction(random, words)), (low, high)


def _ends(random: Random, dtype: np.dtype) -> tuple[float, float]:
    if dtype.kind == "f":
        small = [(0, 1), (0, 1), (-1000, 3000), (0, 255), (300, 301), (-1, -0.5)]
        wide = [(0, 1e-30), (1e6, 1e6 + 64), (0, 1e30), (-1e37, 1e37), (0, 1e-40)]
        return _one(random, small if dtype.itemsize == 2 or _chance(random, 0.7) else wide)
    info = np.iinfo(dtype)
    choices = [(0, 100), (0, 100), (10, 12)]
    choices += [(-1000, 3000)] if info.min < -1000 and info.max > 3000 else []
    choices += [(float(info.min) / 2, float(info.max) / 2)]
    choices += [(2.0**30, 2.0**30 + 200)] if info.max > 2**30 + 200 else []
    return _one(random, choices)


def _with_far_off(random: Random, values: NDArray, ends: tuple[float, float], words: list[str]) -> NDArray:
    """Values of which a few are far from the others."""
    dtype = values.dtype
    if dtype.kind == "f":
        largest = float(np.finfo(dtype).max)
        far = [each for each in (*FAR_FLOATS, largest, -largest) if abs(each) <= largest]
        far += [ends[0] + (ends[1] - ends[0]) * factor for factor in (1e2, 1e3, -1e4, 1e6)]
        far = [each for each in far if abs(each) <= largest]
    else:
        info = np.iinfo(dtype)
        far = [each for each in (info.min, info.max, -9999, -32768, 65535, 10**6, -(10**9), 2**53 + 1)]
        far = [each for each in far if info.min <= each <= info.max]
    value = _one(random, far)
    values = values.copy()
    if _chance(random, 0.3) and values.size > 8:
        values[: max(values.shape[0] // 3, 1)] = value
        words.append(f"a third is {value:.4g}")
    else:
        values.flat[random.integers(values.size, size=_one(random, (1, 1, 1, 3)))] = value
        words.append(f"far off {value:.4g}")
    return values


def _direction(random: Random, words: list[str]) -> NDArray[np.float64] | None:
    kind = _one(random, ("none", "none", "turned", "mirrored", "sheared"))
    if kind == "none":
        return None
    words.append(kind)
    turned = np.linalg.qr(random.standard_normal((3, 3)))[0]
    if kind == "mirrored":
        turned = turned * [1, 1, -1]
    return turned + (0.4 * random.standard_normal((3, 3)) if kind == "sheared" else 0.0)


def _camera(random: Random, volume: Volume, words: list[str]) -> Camera:
    view = random.standard_normal(3)
    if _chance(random, 0.2):
        view = np.eye(3)[int(random.integers(3))] * _one(random, (1, -1))
    view = view / np.linalg.norm(view)
    inside = _chance(random, 0.15)
    eye = volume.centre - volume.radius * (0.3 if inside else random.uniform(1.5, 4)) * view
    up = np.eye(3)[int(np.argmin(np.abs(view)))]
    words += ["eye inside"] if inside else []
    if _chance(random, 0.5):
        words.append("perspective")
        return Camera.perspective(eye, volume.centre, up, fov=float(random.uniform(15, 100)))
    return Camera.orthographic(eye, volume.centre, up, height=float(volume.radius * random.uniform(0.3, 2.2)))


def _medium(random: Random, volume: Volume, ends: tuple[float, float], words: list[str]) -> TransferFunction | None:
    """A transfer function that looks at the base, at a small part of it, or at all that there is."""
    kind = _one(random, ("proposed", "ramp", "ramp", "narrow", "steps", "peaks", "opaque", "emissive", "wide", "spike"))
    words.append(f"{kind} matter")
    low, high = ends
    if kind == "proposed":
        return None
    if kind == "narrow":
        middle, half = random.uniform(low, high), (high - low) * 10 ** random.uniform(-3, -1)
        low, high = middle - half, middle + half
    if kind == "wide" and volume.finite_range is not None:
        low, high = (float(end) for end in volume.finite_range)
    count = int(random.integers(2, 6))
    with np.errstate(over="ignore"):
        values = np.sort(low + (high - low) * random.random(count))
    if kind == "steps":
        values = np.repeat(values, 2)
    if kind == "peaks":
        width = (high - low) * 10 ** random.uniform(-4, -1)
        values = np.sort(np.concatenate([values - width, values, values + width]))
    if kind == "spike":
        middle, width = (low + high) / 2, (high - low) * 1e-3
        values = np.array([middle - width, middle, middle + width])
    extinctions = random.random(len(values)) ** 3 * 10 ** random.uniform(-2, 1) / volume.smallest_spacing
    if kind in ("peaks", "spike"):
        extinctions[[*range(0, len(values), 3), *range(2, len(values), 3)]] = 0
    if kind == "opaque":
        values, extinctions = np.array([values[0], values[-1], values[-1]]), np.array([0, extinctions[0], np.inf])
    colors = random.random((len(values), 3))
    if kind == "emissive":
        return TransferFunction(values, colors / volume.radius, extinctions, emissive=True)
    return TransferFunction(values, colors, extinctions)


def _isovalue(random: Random, volume: Volume, ends: tuple[float, float], words: list[str]) -> float:
    low, high = ends
    at = _one(random, ("inside", "inside", "inside", "end", "sample", "far"))
    words.append(f"isovalue {at}")
    if at == "end":
        return float(_one(random, ends))
    if at == "sample":
        values = volume.values[np.isfinite(volume.values)]
        return float(_one(random, values)) if values.size else low
    if at == "far" and volume.finite_range is not None:
        low, high = (float(end) for end in volume.finite_range)
        return low / 2 + high / 2
    return float(low + (high - low) * random.uniform(0.05, 0.95))


def _lighting(random: Random, volume: Volume, mode: str, words: list[str]) -> Lighting:
    away = tuple(float(each) for each in random.standard_normal(3))
    position = tuple(float(each) for each in volume.centre + 3 * volume.radius * np.array(away))
    lights = (_one(random, (Light(), Light("directional", away), Light("point", position))),)
    shadows = mode == "composite" and _chance(random, 0.2)
    words.append("lit with shadows" if shadows else "lit")
    return Lighting(lights, shadows=shadows, specular=float(_one(random, (0.0, 0.3))))


def _cutting(random: Random, volume: Volume, mode: str, words: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if _chance(random, 0.1):
        normal = random.standard_normal(3)
        offset = float(normal @ (volume.centre + random.uniform(-0.3, 0.3) * volume.radius))
        found["clip"] = (ClipPlane(tuple(float(each) for each in normal), offset),)
        words.append("clipped")
    if _chance(random, 0.08):
        reach = volume.radius * random.uniform(0.2, 0.9, 3)
        found["crop"] = tuple((float(c - r), float(c + r)) for c, r in zip(volume.centre, reach, strict=True))
        words.append("cropped")
    if found and mode == "composite" and _chance(random, 0.4):
        found["caps"] = True
        words.append("caps")
    return found


def _mask(random: Random, volume: Volume, words: list[str]) -> Mask:
    weights = random.random(volume.values.shape)
    if _chance(random, 0.5):
        words.append("masked")
        return Mask(weights > 0.3)
    words.append("faded")
    return Mask(weights)


def _added(random: Random, volume: Volume, words: list[str]) -> AddedVolume:
    inner: list[str] = []
    other, ends = _volume(random, inner, far_off=False)
    scale = volume.radius / other.radius * random.uniform(0.3, 1)
    matrix = np.eye(4)
    matrix[:3, :3] = scale * np.linalg.qr(random.standard_normal((3, 3)))[0]
    matrix[:3, 3] = volume.centre - matrix[:3, :3] @ other.centre
    moved = other.moved(matrix)
    medium = _medium(random, moved, ends, inner)
    words.append(f"added ({', '.join(inner)})")
    return AddedVolume(moved, medium)


def _scale(scene: Scene) -> float:
    """Size of the numbers that a picture holds: 1 of light, else of the values, times the way through the box."""
    if scene.mode in ("composite", "isosurface"):
        return 1.0
    spread = scene.volume.finite_range or (0.0, 1.0)
    largest = max(abs(float(end)) for end in spread) or 1.0
    return largest * (scene.volume.radius if scene.mode == "xray" else 1.0)
