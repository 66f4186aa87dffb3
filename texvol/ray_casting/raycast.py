"""The oracle: emission and absorption integrated along each ray without a step length, in float64.

    I = ∫ q(s) T(s) ds + T(s1) B,    T(s) = exp(-∫ τ(s) ds),    opacity = 1 - T(s1)

q is the emission and τ the extinction per world unit, s the distance from the eye, s1 where the ray leaves the box,
B the background. Each ray is cut at every face of the trilinear cells; a cell lies between eight sample centres.
Between two faces any trilinear field is a cubic in s:

- *pre-classified* (`slab`, `extinction`): q and τ of the eight samples are interpolated, so both are cubics.
- *post-classified* (`post`, `integrated`): the value is a cubic, and is cut again where it meets a control point of
  the transfer function. In between, colour and τ are linear in the value, so they are cubics too.

The optical depth of a piece is then a quartic, in closed form; its emission is integrated by Gauss-Legendre. All
polynomials are in Bernstein form over their piece (parameter t from 0 to 1), as tuples of coefficients: no coefficient
of a cubic that trilinear filtering makes lies outside the range of the samples, so tiny depths lose no digits.

Several volumes add up, q = Σ q_v and τ = Σ τ_v; for them, and for masks, labels and colours, there is `several_walk`.
Light, depth cues and matter that depends on the gradient make no polynomials: `lit_scene`, `lit_walk` and `collocation`
integrate those in stretches that are halved until they agree; `shadows` finds what is left of the lights. The other
modes are in `projection`. Geometry cuts rays into stretches, see `surfaces`.

Read on in `walk` (from cell to cell), `cells` (through one), `matter` (what a piece does to the light) and
`bernstein` (the polynomials). None of it is shared with the renderer, but for the scene and the camera's rays.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.bernstein import EPSILON
from texvol.ray_casting.caps import caps_within, put_in_front, thin_ends
from texvol.ray_casting.common_positions import middle_of
from texvol.ray_casting.medium import medium_of
from texvol.ray_casting.walk import trace_rays
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene, Scene, checked_size
from texvol.scene.volume import Volume
from texvol.util.kept_arrays import read_only

Numbers = NDArray[np.float64]
Chosen = Callable[[Numbers], Numbers]  # rows of the pixels that are wanted, of something that a picture has for each
_PACE: dict[tuple[object, ...], float] = {}  # seconds per pixel of each kind of scene that there was
ROWS_AT_ONCE = 8  # rows of a picture that one thread does in one go; Ctrl-C waits for no more than these


def raycast(scene: Scene, size: tuple[int, int] = (512, 512)) -> NDArray[np.float64]:
    """Picture of shape (height, width, 4): linear, premultiplied, row 0 on top; exact to about 1e-9.

    The background is part of it, as (1 - opacity) times itself. Of the modes xray, mip, minip and average it holds the
    numbers themselves, see `projection`.

    Parameters
    ----------
    scene : Scene
        Of mode composite `classification` decides which medium is integrated: the pre-classified one for "slab" and
        "extinction".
    size : (width, height)
        In pixels; one ray goes through the centre of each.

    Raises
    ------
    InputError
        If the size is not at least one pixel each way.
    """
    return _timed(scene, checked_size(size), lambda of_all: of_all)


def raycast_pixels(scene: Scene, size: tuple[int, int], pixels: NDArray[np.intp]) -> Numbers:
    """Some pixels of `raycast`, shape (n, 4).

    Parameters
    ----------
    size : (width, height)
        Of the whole picture.
    pixels : array of shape (n, 2)
        Column and row of each, from the top left.
    """
    columns, rows = pixels.T
    return _timed(scene, checked_size(size), lambda of_all: of_all[rows, columns][:, np.newaxis])[:, 0]


def _timed(scene: Scene, size: tuple[int, int], chosen: Chosen) -> Numbers:
    scene.check_unchanged()
    start = time.perf_counter()
    picture = _raycast(scene.completed(size), size, chosen)
    kind, seconds = _kind_of(scene), (time.perf_counter() - start) / max(picture.shape[0] * picture.shape[1], 1)
    _PACE[kind] = min(seconds, _PACE.get(kind, np.inf))
    return picture


def _kind_of(scene: Scene) -> tuple[object, ...]:
    """Key of the functions that are compiled for a scene."""
    volumes = tuple((each.values.dtype, each.labels, each.colors is None) for each in scene.volumes)
    masks = tuple(mask and mask.array.dtype for mask in (scene.mask, *(each.mask for each in scene.added)))
    graded = scene.transfer_function is not None and scene.transfer_function.needs_gradient
    lit = (scene.lighting is not None, scene.depth_cue is not None, graded, scene.cutting.caps)
    before = scene.classification in ("slab", "extinction")
    return (scene.mode, before, volumes, masks, lit, tuple(type(each) for each in scene.geometry))


def seconds_per_pixel(scene: Scene) -> float | None:
    """Seconds that a pixel of a scene of this kind has taken; None where there was none, so that it may be compiled."""
    return _PACE.get(_kind_of(scene))


def _raycast(scene: CompleteScene, size: tuple[int, int], chosen: Chosen) -> Numbers:
    if scene.mode != "composite":  # see `projection` for what masks do there
        from texvol.ray_casting.projection import project

        return project(scene, size, chosen)
    camera = scene.camera
    trace = _tracer_for(scene, camera)
    eyes, directions = map(chosen, camera.rays(size))
    picture = np.zeros((*eyes.shape[:2], 4))

    trace_between = _between_surfaces(scene, camera, size, chosen)

    def trace_rows(rows: slice) -> None:
        starts, steps, s_of_eyes, ends = rays_of(scene, eyes[rows], directions[rows])
        thin = thin_ends(scene, starts, steps, ends, s_of_eyes) if scene.cutting.caps else None

        def trace_interval(interval: Numbers, part: Numbers) -> None:
            trace(starts, steps, interval, s_of_eyes, directions[rows], part)
            if thin is not None:
                caps = np.zeros_like(part)
                trace(starts, steps, caps_within(thin, interval), s_of_eyes, directions[rows], caps)
                put_in_front(caps, part)

        trace_between(rows, ends, trace_interval, picture[rows])

    over_rows(trace_rows, len(picture))
    optical_depth = picture[..., 3].copy()
    picture[..., :3] += np.exp(-optical_depth)[..., np.newaxis] * np.array(scene.background)
    picture[..., 3] = -np.expm1(-optical_depth)  # 1 - exp(-1e-17) would be 0
    return picture


def _between_surfaces(
    scene: Scene, camera: Camera, size: tuple[int, int], chosen: Chosen
) -> Callable[[slice, Numbers, Callable[[Numbers, Numbers], None], Numbers], None]:
    """What has stretches of rows traced: the whole way where there are no surfaces, or from one to the next."""
    if not scene.geometry:
        return lambda rows, ends, trace_interval, picture: trace_interval(ends, picture)
    from texvol.ray_casting import surfaces

    layers = [
        surfaces.Layer(chosen(layer.s), chosen(layer.color)) for layer in surfaces.surface_layers(scene, camera, size)
    ]

    def trace_between(
        rows: slice, ends: Numbers, trace_interval: Callable[[Numbers, Numbers], None], picture: Numbers
    ) -> None:
        of_rows = [surfaces.Layer(layer.s[rows], layer.color[rows]) for layer in layers]
        surfaces.trace_between(of_rows, ends, trace_interval, picture)

    return trace_between


def over_rows(trace_rows: Callable[[slice], None], height: int) -> None:
    """Trace all rows of a picture, a few at a time, in threads."""
    threads = ThreadPoolExecutor()
    try:
        for _ in threads.map(trace_rows, (slice(row, row + ROWS_AT_ONCE) for row in range(0, height, ROWS_AT_ONCE))):
            pass
    finally:
        threads.shutdown(cancel_futures=True)


def _tracer_for(
    scene: CompleteScene, camera: Camera
) -> Callable[[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers], None]:
    """What traces rows: starts, steps, ends and eyes as `rays_of` has them, directions, the picture."""
    volume = scene.volume
    if scene.added or scene.mask is not None or volume.labels or volume.colors is not None:
        return _tracer_for_several(scene, camera)
    transfer = scene.medium
    rounding = _position_rounding(volume, camera.eye)
    if scene.lighting is not None or scene.depth_cue is not None or transfer.needs_gradient:
        from texvol.ray_casting.lit_walk import rows_tracer

        return rows_tracer(scene, transfer, camera, rounding)
    medium = medium_of(transfer)
    preclassified = scene.classification in ("slab", "extinction")
    values = read_only(volume.values.astype(np.float32)) if volume.values.dtype == np.float16 else volume.values

    def trace(
        starts: Numbers, steps: Numbers, ends: Numbers, eyes: Numbers, directions: Numbers, picture: Numbers
    ) -> None:
        trace_rays(values, medium, preclassified, starts, steps, ends, rounding, picture)

    return trace


def _tracer_for_several(
    scene: CompleteScene, camera: Camera
) -> Callable[[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers], None]:
    from texvol.ray_casting.several_walk import rows_tracer

    scenes = scene.each_alone()
    transfers = [each.medium for each in scenes]
    # Rays are found from the first volume's centre, wherever the others are.
    farthest = np.abs(camera.eye) + np.abs(scene.volume.centre)
    rounding = np.stack([_position_rounding(volume, farthest) for volume in scene.volumes])
    return rows_tracer(scene, scenes, transfers, camera, rounding)


def rays_of(scene: Scene, eyes: Numbers, directions: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Rays as `start` + s `step` (index space), s in world units; the s of the eye; the ends (…, 2) of what is seen.

    s is 0 where the ray passes nearest to the centre of the box: neither a far eye nor a far origin costs digits. Of
    several volumes that is the box of the first.
    """
    volume = scene.volume
    from_centre = eyes - volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    nearest = from_centre - eye[..., np.newaxis] * directions
    to_index = volume.index_from_world.T
    first, last = scene.cutting.interval(volume, nearest, directions)
    ends = np.stack([np.maximum(first, eye), last], axis=-1)
    return nearest @ to_index + middle_of(volume), directions @ to_index, eye, ends


def _position_rounding(volume: Volume, eye: tuple[float, float, float] | Numbers) -> Numbers:
    """How far rounding may have moved a ray, in index space along each axis: a few ulps of the largest coordinate.

    Matters only where the picture jumps: a ray that runs this near beside a face counts as lying in it.
    """
    reach = np.abs(eye) + np.abs(volume.centre) + np.abs(volume.box_edges).sum(axis=1)
    ulps = EPSILON * (np.abs(volume.index_from_world) @ reach + np.array(volume.dimensions))
    return np.minimum(16 * ulps, 1e-6)
