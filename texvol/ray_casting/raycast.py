"""The exact ray caster: emission and absorption integrated along each ray without a step length, in float64.

    I = ∫ q(s) T(s) ds + T(s1) B,    T(s) = exp(-∫ τ(s) ds),    opacity = 1 - T(s1)

q is the emission and τ the extinction per world unit, s the distance from the eye, s1 where the ray leaves the box,
B the background. `marcher` approximates the same integral by many short steps. Here, each ray is cut at every face of
the trilinear cells; a cell lies between eight sample centres. Between two faces any trilinear field is a cubic in s:

- *pre-classified* (`slab`, `extinction`): q and τ of the eight samples are interpolated, so both are cubics.
- *post-classified* (`post`, `integrated`): the value is a cubic, and is cut again where it meets a control point of
  the transfer function. Between two cuts, colour and τ are linear in the value, so they are cubics too.

The optical depth of a piece is then a quartic, in closed form; its emission is integrated by Gauss-Legendre quadrature.
All polynomials are in Bernstein form over their piece (parameter t from 0 to 1), as tuples of coefficients: no
coefficient of a cubic that trilinear filtering makes lies outside the range of the samples, so small depths lose no
digits.

Volumes that overlap add up, q = Σ q_v and τ = Σ τ_v. Light, depth cues and media that depend on the gradient make no
polynomials; they are integrated over intervals that are halved until the halves agree with the whole.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.caps import caps_within, put_in_front, thin_ends
from texvol.ray_casting.common.rays import Choose, Numbers, over_rows, rays_of
from texvol.ray_casting.tracing import tracer_for
from texvol.scene.scene import CompleteScene, Scene, checked_size

_PACE: dict[tuple[object, ...], float] = {}  # least seconds per pixel of each kind of scene, so far
TraceInterval = Callable[[Numbers, Numbers], None]  # adds what lies between ends of rays to a picture of zeros


def raycast(scene: Scene, size: tuple[int, int] = (512, 512)) -> NDArray[np.float64]:
    """Return the exact picture of a scene, shape (height, width, 4), to about 1e-9.

    The picture is linear and premultiplied, row 0 on top; the background is included, times 1 - opacity. In the modes
    xray, mip, minip and average the colours are the values themselves, see `projection.project`.

    Parameters
    ----------
    scene : Scene
        In mode composite, the pre-classified medium is integrated for the classifications "slab" and "extinction", the
        post-classified medium for "post" and "integrated".
    size : (width, height)
        In pixels; one ray passes through the centre of each.

    Raises
    ------
    InputError
        If the size is not at least one pixel in each direction.
    """
    return _timed(scene, checked_size(size), lambda array: array)


def raycast_pixels(scene: Scene, size: tuple[int, int], pixels: NDArray[np.intp]) -> Numbers:
    """Return some pixels of the picture that `raycast` returns, shape (n, 4).

    Parameters
    ----------
    size : (width, height)
        Of the whole picture.
    pixels : array of shape (n, 2)
        Column and row of each, counted from the top left.
    """
    columns, rows = pixels.T
    return _timed(scene, checked_size(size), lambda array: array[rows, columns][:, np.newaxis])[:, 0]


def _timed(scene: Scene, size: tuple[int, int], choose: Choose) -> Numbers:
    scene.check_unchanged()
    start = time.perf_counter()
    picture = _raycast(scene.completed(size), size, choose)
    kind, seconds = _kind_of(scene), (time.perf_counter() - start) / max(picture.shape[0] * picture.shape[1], 1)
    _PACE[kind] = min(seconds, _PACE.get(kind, np.inf))
    return picture


def _kind_of(scene: Scene) -> tuple[object, ...]:
    """Return what decides which functions are compiled for a scene."""
    volumes = tuple((each.values.dtype, each.labels, each.colors is None) for each in scene.volumes)
    masks = tuple(mask and mask.array.dtype for mask in (scene.mask, *(each.mask for each in scene.added)))
    graded = scene.transfer_function is not None and scene.transfer_function.needs_gradient
    lit = (scene.lighting is not None, scene.depth_cue is not None, graded, scene.cutting.caps)
    before = scene.classification in ("slab", "extinction")
    return (scene.mode, before, volumes, masks, lit, tuple(type(each) for each in scene.geometry))


def seconds_per_pixel(scene: Scene) -> float | None:
    """Return the seconds that a pixel of a scene of this kind has taken; None before the first, which compiles."""
    return _PACE.get(_kind_of(scene))


def _raycast(scene: CompleteScene, size: tuple[int, int], choose: Choose) -> Numbers:
    if scene.mode != "composite":
        from texvol.ray_casting.projection.pictures import project

        return project(scene, size, choose)
    trace = tracer_for(scene)
    eyes, directions = map(choose, scene.camera.rays(size))
    picture = np.zeros((*eyes.shape[:2], 4))
    trace_between = _between_surfaces(scene, size, choose)

    def trace_rows(rows: slice) -> None:
        of_rows = rays_of(scene, eyes[rows], directions[rows])
        thin = thin_ends(scene, of_rows) if scene.cutting.caps else None

        def trace_interval(ends: Numbers, part: Numbers) -> None:
            trace(of_rows._replace(ends=ends), part)
            if thin is not None:
                caps = np.zeros_like(part)
                trace(of_rows._replace(ends=caps_within(thin, ends)), caps)
                put_in_front(caps, part)

        trace_between(rows, of_rows.ends, trace_interval, picture[rows])

    over_rows(trace_rows, len(picture))
    optical_depth = picture[..., 3].copy()
    picture[..., :3] += np.exp(-optical_depth)[..., np.newaxis] * np.array(scene.background)
    picture[..., 3] = -np.expm1(-optical_depth)  # 1 - exp(-1e-17) would be 0
    return picture


def _between_surfaces(
    scene: CompleteScene, size: tuple[int, int], choose: Choose
) -> Callable[[slice, Numbers, TraceInterval, Numbers], None]:
    """Return the function that traces rows of rays from one surface of the scene's geometry to the next."""
    if not scene.geometry:
        return lambda rows, ends, trace_interval, picture: trace_interval(ends, picture)
    from texvol.ray_casting.surfaces import layers

    all_layers = [
        layers.Layer(choose(layer.s), choose(layer.color)) for layer in layers.surface_layers(scene, scene.camera, size)
    ]

    def trace_between(rows: slice, ends: Numbers, trace_interval: TraceInterval, picture: Numbers) -> None:
        of_rows = [layers.Layer(layer.s[rows], layer.color[rows]) for layer in all_layers]
        layers.trace_between(of_rows, ends, trace_interval, picture)

    return trace_between
