"""The scenes that renderers get wrong: each with what its error may be, and why.

Most draw a *ramp*, a value that rises linearly across the box, of matter whose extinction is linear in it: but for the
flat outer half spacings, where the error is known exactly, the midpoint rule integrates it without error, so that any
mistake of geometry shows in full.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from support.hard_cases import bounds
from support.hard_cases.bounds import Drawing
from texvol.scene.camera import Camera
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

FLOAT32 = {"texture_format": "rgba32f", "target_format": "rgba32f"}
COLOR = (0.9, 0.6, 0.3)
TURN = 1e-4  # rad
BEFORE, AFTER = ("slab", "extinction"), ("post", "integrated")


@dataclass(frozen=True)
class HardCase:
    """A scene, how it is drawn, how far from the oracle it may be (max. absolute error), and why."""

    name: str
    scene: Scene
    bound: Callable[[Drawing], float]
    why: str
    slab_thickness: float
    options: dict[str, Any] = field(default_factory=lambda: dict(FLOAT32))
    size: tuple[int, int] = (40, 40)
    turned: Scene | None = None  # compare how the picture changes from `scene` to this one
    slack: str = ""  # why the bound is more than ten times what is measured, where it is


LINEAR = "changes of slope inside slabs, exact; slab: neighbours' opacities interpolated, (dΔτ)²/8 a slab; rounding"


def ramp(dimensions: tuple[int, int, int] = (10, 9, 8), kind: type = np.float32, **position: Any) -> Volume:
    """Value 0 … 1 from one corner of the box to the other, steepest along x."""
    x, y, z = (s * (np.arange(n) + 0.5) / n for s, n in zip((0.5, 0.3, 0.2), dimensions, strict=True))
    values = x[np.newaxis, np.newaxis] + y[:, np.newaxis] + z[:, np.newaxis, np.newaxis]
    if np.dtype(kind).kind == "u":
        values = np.rint(values * np.iinfo(kind).max)
    return Volume(values.astype(kind), **position)


def linear_medium(volume: Volume, depth: float = 2.0, values: tuple[float, float] = (0.0, 1.0)) -> TransferFunction:
    """Extinction linear in the value, so that the box's diagonal is about `depth` deep."""
    tau = depth / (2 * volume.radius)
    return TransferFunction(np.array(values), np.array([COLOR] * 2), np.array([0.25 * tau, 1.75 * tau]))


def looking(
    volume: Volume, line_of_sight: tuple[float, float, float], beside: float = 0.0, height: float | None = None
) -> Camera:
    """Orthographic camera along `way` (in box edges), turned by `beside` radians."""
    view = np.array(line_of_sight, float) / np.linalg.norm(line_of_sight)
    aside = np.cross(view, np.eye(3)[np.argmin(np.abs(view))])
    eye = volume.centre - 3 * volume.radius * (view + beside * aside / np.linalg.norm(aside))
    return Camera.framing(volume, eye=eye, height=height)


def seen_from(volume: Volume, position: tuple[float, float, float], fov: float = 70) -> Camera:
    """Perspective camera at `place` in the box, [-1/2, 1/2]³, looking past its middle."""
    eye = volume.centre + volume.box_edges @ np.array(position)
    target = volume.centre + volume.box_edges @ (-0.3 * np.array(position) + (0.05, 0.11, -0.07))
    return Camera.perspective(eye, target, (0, 0, 1), fov=fov)


def views() -> Iterator[tuple[str, Volume, Camera, float]]:
    """Name, volume, camera and slab thickness of the cases of geometry."""
    plain, cube = ramp(), ramp((8, 8, 8))
    for name, line_of_sight in (
        ("an axis", (0, 1, 0)),
        ("a face diagonal", (1, 1, 0)),
        ("a space diagonal", (1, 1, 1)),
    ):
        for beside in (0.0, 1e-7, -1e-7):
            where = f", {beside:g} rad beside it" if beside else ""
            yield f"view along {name}{where}", plain, looking(plain, line_of_sight, beside), 1.0
    # The cube's vertical edges are 4 √2 from its middle, its corners along a space diagonal 4/√3 and 12/√3.
    yield "planes through four edges", cube, looking(cube, (1, 1, 0)), np.sqrt(2)
    yield "planes through all corners", cube, looking(cube, (1, 1, 1)), 2 / np.sqrt(3)
    for name, position in (
        ("on a face", (0.5, 0.1, 0)),
        ("on an edge", (0.5, 0.5, 0.1)),
        ("inside", (0.2, -0.1, 0.15)),
    ):
        yield f"eye {name}", plain, seen_from(plain, position), 1.0
    for fov in (1.0, 150.0):
        yield f"field of view {fov:g}°", plain, Camera.framing(plain, "perspective", fov=fov), 1.0
    sheared = [[1, 0.5, 0], [0.2, 1, 0.3], [0, -0.4, 1]]
    boxes = {
        "spacing 1:1:20": ramp(spacing=(1, 1, 20)),
        "sheared": ramp(direction=sheared),
        "left-handed": ramp(direction=np.diag([-1.0, 1, 1])),
        "sheared and left-handed": ramp(direction=np.array(sheared) * [1, 1, -1]),
        "1 voxel": ramp((1, 1, 1)),
        "1×1×9": ramp((1, 1, 9)),
        "1×9×9": ramp((1, 9, 9)),
        "7×5×3": ramp((7, 5, 3)),
        "a world of 1e-9": ramp(spacing=(1e-9, 1.2e-9, 0.9e-9)),
        "a world of 1e9": ramp(spacing=(1e9, 1.2e9, 0.9e9)),
        "origin at 1e7": ramp(origin=(1e7, -1e7, 1e7)),
    }
    for name, volume in boxes.items():
        yield name, volume, Camera.framing(volume, "perspective"), volume.smallest_spacing
    long, needle = ramp((2047, 2, 2)), ramp((1, 1, 2047))
    yield "2047×2×2, end on", long, looking(long, (1, 0.25, 0.1), height=3.0), 1.0
    yield "1×1×2047, end on", needle, looking(needle, (0.2, 0.1, 1), height=2.0), 1.0
    yield "slab thicker than the box", plain, looking(plain, (3, 1, 2)), 4 * plain.radius


def geometry() -> Iterator[HardCase]:
    for name, volume, camera, d in views():
        size = (12, 12) if "end on" in name else (40, 40)  # their bounds go through two thousand layers of cells
        for kind in CLASSIFICATIONS:
            scene = Scene(volume, linear_medium(volume), camera, classification=kind)  # type: ignore[arg-type]
            yield HardCase(f"{name}, {kind}", scene, bounds.trilinear, LINEAR, d, size=size)


def numbers_of_slabs() -> Iterator[HardCase]:
    volume = ramp((8, 8, 8))
    view = looking(volume, (0, 1, 0.2), height=8.0)
    inside = Camera.orthographic(volume.centre, volume.centre + (0, 1, 0), (0, 0, 1), 8.0)
    for kind in CLASSIFICATIONS:
        one = Scene(volume, linear_medium(volume), inside, classification=kind)  # type: ignore[arg-type]
        yield HardCase(f"1 slab, {kind}", one, bounds.trilinear, LINEAR, 8.0)
        depth = np.ptp(view.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2])
        for count in (8, 512, 4096, 16384):
            scene = Scene(volume, linear_medium(volume), view, classification=kind)  # type: ignore[arg-type]
            yield HardCase(f"{count} slabs, {kind}", scene, bounds.trilinear, LINEAR, depth / count, size=(24, 24))


def depths() -> Iterator[HardCase]:
    volume = ramp()
    framed = Camera.framing(volume, "perspective")
    # Along the edge of the box that is nearest to the eye: chords of up to a hundredth of a sample.
    corner = volume.centre + volume.box_edges @ np.array([-0.5, -0.5, 0.1])
    edge = Camera.orthographic(corner + (-5, 4, 0), corner, (0, 0, 1), 0.01)
    why = f"{LINEAR}; τd 2^-24 where a slab is clipped, 4 × 2^-24 of the depth"
    for kind in CLASSIFICATIONS:
        scene = partial(Scene, volume, classification=kind)  # type: ignore[arg-type]
        thin, dense = linear_medium(volume, 1e-12), linear_medium(volume, 1e4)
        yield HardCase(f"optical depth 1e-12, {kind}", scene(thin, framed), bounds.trilinear, LINEAR, 1.0)
        for name, camera in (("", framed), (" at an edge", edge)):
            slack = "" if name else "few pixels are not opaque, and weights there are near 0 or 1"
            if kind == "slab":
                slack = "texels stand for a slab of depth 2 at most, thousands of times thinner than this one"
            full_name = f"optical depth 1e4{name}, {kind}"
            yield HardCase(full_name, scene(dense, camera), bounds.any_depth, why, 1.0, slack=slack)


def _with_one(volume: Volume, odd: float) -> Volume:
    """The volume with another value at one sample."""
    values = volume.values.copy()
    values[4, 4, 5] = odd
    return Volume(values, volume.spacing, volume.origin, volume.direction, name=volume.name)


def kinds_of_values() -> Iterator[HardCase]:
    far = Volume(1e9 - 1 + 2 * ramp(kind=np.float64).values)
    flat = Volume(np.full((8, 9, 10), 0.3, np.float32))
    hole, infinite = (_with_one(ramp(), odd) for odd in (np.nan, np.inf))
    for kind in CLASSIFICATIONS:
        scenes = {
            "values 1e9 ± 1 in float64": Scene(
                far, linear_medium(far, values=(1e9 - 1, 1e9 + 1)), classification="slab"
            ),
            "constant volume": Scene(flat, linear_medium(flat), classification="slab"),
            "a NaN": Scene(hole, linear_medium(hole), classification="slab"),
            "an infinity": Scene(infinite, linear_medium(infinite), classification="slab"),
        }
        for name, plain in scenes.items():
            camera = Camera.framing(plain.volume, "perspective")
            scene = Scene(plain.volume, plain.transfer_function, camera, classification=kind)  # type: ignore[arg-type]
            if kind in BEFORE or name not in ("a NaN", "an infinity"):
                slack = ""
                if name == "constant volume":
                    slack = "roundings of one number cancel here"
                elif name in ("a NaN", "an infinity"):
                    slack = "each layer of cells is taken to twist as its worst cell, all one way"
                yield HardCase(f"{name}, {kind}", scene, bounds.trilinear, LINEAR, 1.0, slack=slack)
                continue
            tau = bounds.extinction_of_samples(Scene(ramp(), linear_medium(ramp()), classification="slab"))[
                4:7, 3:6, 3:6
            ]
            jump = tau.max() if name == "a NaN" else linear_medium(ramp()).extinctions[-1] - tau.min()
            bound = partial(bounds.jumping, around=ramp(), jump=jump)
            why = f"matter jumps by {jump:.2g} where the sample's cells begin and end: p/2 of that each; {LINEAR}"
            slack = "rays meet these cells elsewhere than would be worst"
            yield HardCase(f"{name}, {kind}", scene, bound, why, 1.0, slack=slack)


def transfer_functions() -> Iterator[HardCase]:
    for kind in CLASSIFICATIONS:
        scene = partial(Scene, classification=kind)  # type: ignore[arg-type]
        yield from _walls(kind, scene)
        plain = ramp()
        camera = Camera.framing(plain, "perspective")
        nothing = TransferFunction(np.array([0, 1.0]), np.array([COLOR] * 2), np.zeros(2))
        yield HardCase(
            f"all transparent, {kind}", scene(plain, nothing, camera), lambda _: 0.0, "nothing is drawn", 1.0
        )
        solid = TransferFunction(np.array([0, 1.0]), np.array([COLOR] * 2), np.full(2, np.inf))
        yield HardCase(
            f"all opaque, {kind}",
            scene(plain, solid, camera),
            lambda _: 4 * bounds.ULP,
            "roundings of one colour: texel, weights, scale, table",
            1.0,
        )


def _walls(kind: str, scene: Callable[..., Scene]) -> Iterator[HardCase]:
    """A step, a wall of opacity 1 and a spike, each crossed once by every ray, square on."""
    y = np.arange(16.0)
    volume = Volume(np.broadcast_to((y / 15).astype(np.float32)[:, np.newaxis], (16, 16, 16)))
    levels = Volume(np.broadcast_to((16 * y).astype(np.uint8)[:, np.newaxis], (16, 16, 16)))
    camera = looking(volume, (0.15, 1, 0.1), height=8.0)
    step = TransferFunction(np.array([0, 0.47, 0.47, 1]), np.array([COLOR] * 4), np.array([0.02, 0.02, 0.2, 0.2]))
    placed = kind == "post"  # the others interpolate the step, or find it
    yield HardCase(
        f"a step, {kind}",
        scene(volume, step, camera),
        partial(bounds.misplaced, jump=0.18, within=0.5 if placed else 15 * 2.0**-22)
        if kind in AFTER
        else bounds.trilinear,
        f"the step is placed to {'half a slab' if placed else '2^-22 of the values'}" if kind in AFTER else LINEAR,
        1.0,
    )
    if kind == "integrated":
        aside = looking(volume, (0.15, 1, 0.1), TURN, height=8.0)
        yield HardCase(
            f"a turn of {TURN:g} rad before a step, {kind}",
            scene(volume, step, camera),
            lambda drawing: 2 * bounds.misplaced(drawing, jump=0.18, within=15 * 2.0**-22),
            "the step is placed to 2^-22 of the values, before and after",
            1.0,
            turned=scene(volume, step, aside),
        )
    colors = np.array([(1, 0.2, 0)] * 2 + [(0, 0.2, 1)] * 2)
    wall = TransferFunction(np.array([0, 0.47, 0.47, 1]), colors, np.array([0.02, 0.02, np.inf, np.inf]))
    within = {"slab": 1.0, "extinction": 0.5, "post": 0.5, "integrated": 15 * 2.0**-22}[kind]
    yield HardCase(
        f"opacity 1 per unit length, {kind}",
        scene(volume, wall, camera),
        partial(bounds.hidden, haze=0.02, within=within),
        "haze in front of a wall placed to "
        + {"slab": "its cell, in which opacity grows", "integrated": "2^-22 of the values"}.get(kind, "half a slab"),
        1.0,
    )
    spike = TransferFunction(np.array([100.2, 100.5, 100.8]), np.array([COLOR] * 3), np.array([0, 50.0, 0]))
    whys = {
        "post": "hit or missed altogether",
        "integrated": "the spike's outer points to 2^-26 of 255, each side 0.3 wide",
    }
    yield HardCase(
        f"a spike within one data level, {kind}",
        scene(levels, spike, camera),
        partial(bounds.spiked, width=0.3),
        whys.get(kind, "no sample has such a value"),
        1.0,
    )


def formats() -> Iterator[HardCase]:
    volume = ramp()
    camera = Camera.framing(volume, "perspective")
    for kind in BEFORE:
        for texel, why in (
            ("rgba8", "half a level for the texel and each of three interpolations, all along"),
            ("rgba16f", "2^-11 of every texel"),
            ("rgba32f", "as any"),
        ):
            scene = Scene(volume, linear_medium(volume), camera, classification=kind)  # type: ignore[arg-type]
            options = FLOAT32 | {"texture_format": texel}
            slack = "roundings along a ramp cancel" if texel != "rgba32f" else ""
            bound = partial(bounds.with_texels, texel_format=texel)
            yield HardCase(f"{texel} texels, {kind}", scene, bound, f"{why}; {LINEAR}", 0.25, options, slack=slack)
    for kind in AFTER:
        for values in (np.uint8, np.uint16, np.float16, np.float32):
            data = ramp(kind=values)
            top = float(np.iinfo(values).max) if np.dtype(values).kind == "u" else 1.0
            scene = Scene(data, linear_medium(data, values=(0, top)), camera, classification=kind)  # type: ignore[arg-type]
            name = f"{np.dtype(values).name} values, {kind}"
            yield HardCase(name, scene, bounds.trilinear, LINEAR, 0.25)
    for kind in CLASSIFICATIONS:
        for target, why in (
            ("rgba8", "half a level for what comes and half for its product, every blend"),
            ("rgba16f", "2^-12 for what comes and for the sum, every blend"),
            ("rgba32f", "as any"),
        ):
            scene = Scene(volume, linear_medium(volume), camera, classification=kind)  # type: ignore[arg-type]
            options = FLOAT32 | {"target_format": target}
            bound = partial(bounds.with_target, target_format=target)
            yield HardCase(f"{target} target, {kind}", scene, bound, f"{why}; {LINEAR}", 0.25, options)


def emissions() -> Iterator[HardCase]:
    """A glow beyond the range of half floats, in half-float texels."""
    volume = ramp()
    camera = Camera.framing(volume, "perspective")
    for kind in BEFORE:
        for glow in (1e6, 1e-9):
            medium = TransferFunction(np.array([0, 1.0]), np.array([(glow,) * 3] * 2), np.zeros(2), emissive=True)
            scene = Scene(volume, medium, camera, classification=kind)  # type: ignore[arg-type]
            yield HardCase(
                f"emission {glow:g} in half-float texels, {kind}",
                scene,
                bounds.glowing,
                "2^-11 of the texel; 4 roundings of float32",
                1.0,
                FLOAT32 | {"texture_format": "rgba16f"},
            )
    for kind in ("extinction", "post"):
        for glow in (1e6, 1e-9):
            medium = TransferFunction(np.array([0, 1.0]), np.array([(glow,) * 3] * 2), np.zeros(2), emissive=True)
            yield HardCase(
                f"emission {glow:g} in a half-float target, {kind}",
                Scene(volume, medium, camera, classification=kind),  # type: ignore[arg-type]
                partial(bounds.with_target, target_format="rgba16f"),
                "2^-12 for what comes and for the sum, every blend",
                1.0,
                FLOAT32 | {"target_format": "rgba16f"},
            )


def turns() -> Iterator[HardCase]:
    volume = ramp()
    for kind in CLASSIFICATIONS:
        for name, line_of_sight in (
            ("an axis", (0, 1, 0)),
            ("a space diagonal", (1, 1, 1)),
            ("no symmetry", (5, 2, 3)),
        ):
            scenes = [
                Scene(volume, linear_medium(volume), looking(volume, line_of_sight, beside, 20.0), classification=kind)  # type: ignore[arg-type]
                for beside in (0.0, TURN)
            ]
            yield HardCase(
                f"a turn of {TURN:g} rad from {name}, {kind}",
                scenes[0],
                partial(bounds.turning, angle=TURN),
                "a change of slope moves against the planes by R θ",
                1.0,
                turned=scenes[1],
            )


def hard_cases() -> list[HardCase]:
    """All of them, by subject."""
    groups = (geometry, numbers_of_slabs, depths, kinds_of_values, transfer_functions, formats, emissions, turns)
    return [case for group in groups for case in group()]
