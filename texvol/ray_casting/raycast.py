"""The exact ray caster: emission and absorption integrated along each ray without a step length, in float64.

`marcher` approximates the same integral by many short steps. Here, each ray is cut at every face of the trilinear
cells; a cell lies between eight sample centres. Between two faces any trilinear field is a cubic in s:

- *pre-classified* (`slab`, `extinction`): q and τ of the eight samples are interpolated, so both are cubics.
- *post-classified* (`post`, `integrated`): the value is a cubic, and is cut again where it meets a control point of
  the transfer function. Between two cuts, colour and τ are linear in the value, so they are cubics too.

The optical depth of a piece is then a quartic, in closed form; its emission is integrated by Gauss-Legendre quadrature.
All polynomials are in Bernstein form over their piece (parameter t from 0 to 1), as tuples of coefficients: no
coefficient of a cubic that trilinear filtering makes lies outside the range of the samples, so small depths lose no
digits.

Volumes that overlap add up, q = Σ q_v and τ = Σ τ_v. Light, depth cues and media that depend on the gradient make no
polynomials; they are integrated over intervals that are halved until the halves agree with the whole.

Where a clip plane or crop box cuts a medium open, the cut may be a *cap*: an opaque surface of the medium's colour. It
has the colour of an interval too short for the medium to change, divided by its opacity; where several volumes overlap
it is the colour of their sum.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.rays import (
    Choose,
    Numbers,
    Rays,
    Trace,
    ends_at,
    middle_of,
    over_rows,
    position_rounding,
    rays_in,
    rays_of,
    s_of_depth,
    transformed,
)
from texvol.ray_casting.plain import tracer as plain
from texvol.scene.lighting import casts_shadows, checked_shadow_nodes
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.refinement import refined_scene
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.volume import Volume

if TYPE_CHECKING:
    from texvol.ray_casting.surfaces.layers import Layer

_PACE: dict[tuple[object, ...], float] = {}  # least seconds per pixel of each kind of scene, so far
_SHORT = 2.0**-26  # of a cap, in smallest spacings: half of float64's digits are left for the optical depth
_STEPS = (8, 4, 2, 1)  # pixels between two of a progressive picture
Tell = Callable[[float], None]
Draw = Callable[[Choose, Tell], Numbers]
TraceInterval = Callable[[Numbers, Numbers], None]  # adds what lies between ends of rays to a picture of zeros


def raycast(
    scene: Scene,
    size: AnySize = (512, 512),
    *,
    texture_refinement: int = 1,
    shadow_nodes: int | None = None,
    tell: Tell = lambda fraction: None,
) -> NDArray[np.float64]:
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
    texture_refinement : 1, 2 or 4
        The medium of the classifications slab and extinction is that of a grid so many times finer, as in
        `Renderer.render`.
    shadow_nodes : int, optional
        Shadows are interpolated between so many nodes along the longest edge of the box, as in `Renderer.render`.
        Without it they are exact, to about 1e-6.
    tell : callable
        Is told again and again what fraction of the pixels is there.

    Raises
    ------
    InputError
        If the size is not at least one pixel in each direction, or the grid of the scene cannot be refined.
    """
    scene.check_size(size := checked_size(size))
    refined = refined_scene(scene.completed(size), texture_refinement)
    if shadow_nodes is not None:
        scene.check_unchanged()
        return _drawer(refined, size, checked_shadow_nodes(shadow_nodes))(lambda array: array, tell)
    return _timed(refined, size, lambda array: array, tell)


def raycast_pixels(
    scene: Scene, size: tuple[int, int], pixels: NDArray[np.intp], tell: Tell = lambda fraction: None
) -> Numbers:
    """Return some pixels of the picture that `raycast` returns, shape (n, 4).

    Parameters
    ----------
    size : (width, height)
        Of the whole picture.
    pixels : array of shape (n, 2)
        Column and row of each, counted from the top left.
    tell : callable
        Is told again and again what fraction of them is there.
    """
    scene.check_size(size := checked_size(size))
    columns, rows = pixels.T
    return _timed(scene, size, lambda array: array[rows, columns][:, np.newaxis], tell)[:, 0]


def raycast_progressively(
    scene: Scene,
    size: AnySize = (512, 512),
    *,
    texture_refinement: int = 1,
    tell: Callable[[float], None] = lambda fraction: None,
) -> Iterator[tuple[int, Numbers]]:
    """Yield four pictures, from coarse to that of `raycast`, bit for bit; each pixel is computed once.

    With each comes the distance of its pixels along both axes: 8, 4, 2 and 1. A pixel that is not there yet has the
    colour of the next one above it and to its left.

    Parameters
    ----------
    tell : callable
        Is told again and again what fraction of the last picture's pixels is there.

    Raises
    ------
    InputError
        As `raycast`.
    """
    scene.check_size(size := checked_size(size))
    width, height = size
    complete = refined_scene(scene.completed(size), texture_refinement)
    complete.check_unchanged()
    draw, picture, done = _drawer(complete, size), np.zeros((height, width, 4)), 0

    def draw_lattice(row: int, column: int, apart: int) -> int:
        """Draw pixels that are `apart`, and return their number."""
        lattice = slice(row, None, apart), slice(column, None, apart)
        count = picture[lattice].shape[0] * picture[lattice].shape[1]
        if count:
            picture[lattice] = draw(
                lambda array: array[lattice], lambda fraction: tell((done + fraction * count) / (width * height))
            )
        return count

    start, drawing = time.perf_counter(), 0.0
    for step in _STEPS:
        for row, column, apart in _lattices(step):
            done += draw_lattice(row, column, apart)
        drawing += time.perf_counter() - start
        if done == width * height:
            _remember(scene, drawing / done)
        yield step, np.repeat(np.repeat(picture[::step, ::step], step, 0), step, 1)[:height, :width]
        start = time.perf_counter()


def _lattices(step: int) -> Iterator[tuple[int, int, int]]:
    """Yield first row, first column and distance of the pixels that a picture of that step adds."""
    if step == _STEPS[0]:
        yield 0, 0, step
        return
    for row, column in ((0, step), (step, 0), (step, step)):
        yield row, column, 2 * step


def _timed(scene: Scene, size: tuple[int, int], choose: Choose, tell: Tell) -> Numbers:
    scene.check_unchanged()
    start = time.perf_counter()
    picture = _drawer(scene.completed(size), size)(choose, tell)
    _remember(scene, (time.perf_counter() - start) / max(picture.shape[0] * picture.shape[1], 1))
    return picture


def _remember(scene: Scene, seconds: float) -> None:
    """Remember the seconds that a pixel of a scene took."""
    kind = _kind_of(scene)
    _PACE[kind] = min(seconds, _PACE.get(kind, np.inf))


def _kind_of(scene: Scene) -> tuple[object, ...]:
    """Return what decides which functions are compiled for a scene."""
    volumes = tuple((each.nearest, each.colors is None) for each in scene.volumes)
    masks = tuple(mask and mask.array.dtype for mask in (scene.mask, *(each.mask for each in scene.added)))
    graded = scene.transfer_function is not None and scene.transfer_function.needs_gradient
    lighting = scene.lighting is not None, casts_shadows(scene.lighting)
    lit = (*lighting, scene.depth_cue is not None, graded, scene.cutting.caps)
    before = scene.classification in ("slab", "extinction")
    return (scene.mode, before, volumes, masks, lit, tuple(type(each) for each in scene.geometry))


def seconds_per_pixel(scene: Scene) -> float | None:
    """Return the seconds that a pixel of a scene of this kind has taken; None before the first, which compiles."""
    return _PACE.get(_kind_of(scene))


def _drawer(scene: CompleteScene, size: tuple[int, int], shadow_nodes: int | None = None) -> Draw:
    """Return the function that draws chosen pixels, and tells what fraction of them is done."""
    if scene.mode != "composite":
        from texvol.ray_casting.projection.pictures import project

        return partial(project, scene, size)
    return partial(_draw, scene, size, tracer_for(scene, shadow_nodes))


def _draw(scene: CompleteScene, size: tuple[int, int], trace: Trace, choose: Choose, tell: Tell) -> Numbers:
    eyes, directions = map(choose, scene.camera.rays(size))
    picture = np.zeros((*eyes.shape[:2], 4))
    surfaces = _surfaces(scene, size, choose)
    depths = None if scene.depth is None else choose(scene.depth.at_size(size))

    def trace_rows(rows: slice) -> None:
        of_rows = rays_of(scene, eyes[rows], directions[rows])
        layers = [layer.chosen(lambda array: array[rows]) for layer in surfaces]
        if depths is not None:
            until = s_of_depth(scene.camera, of_rows, depths[rows])
            of_rows, layers = ends_at(of_rows, until), [layer.until(until) for layer in layers]
        thin = _thin_ends(scene, of_rows) if scene.cutting.caps else None

        def trace_interval(ends: Numbers, part: Numbers) -> None:
            trace(of_rows._replace(ends=ends), part)
            if thin is not None:
                caps = np.zeros_like(part)
                trace(of_rows._replace(ends=_caps_within(thin, ends)), caps)
                _put_in_front(caps, part)

        _trace_between(layers, of_rows.ends, trace_interval, picture[rows])

    over_rows(trace_rows, picture.shape, tell)
    optical_depth = picture[..., 3].copy()
    picture[..., :3] += np.exp(-optical_depth)[..., np.newaxis] * np.array(scene.background)
    picture[..., 3] = -np.expm1(-optical_depth)  # 1 - exp(-1e-17) would be 0
    return picture


def _surfaces(scene: CompleteScene, size: tuple[int, int], choose: Choose) -> list[Layer]:
    """Return the surfaces on all rays, see `surfaces.layers`, which is imported when a scene has geometry."""
    if not scene.geometry:
        return []
    from texvol.ray_casting.surfaces.layers import surface_layers

    return surface_layers(scene, size, choose)


def _trace_between(layers: list[Layer], ends: Numbers, trace_interval: TraceInterval, picture: Numbers) -> None:
    """Write light and, in the last channel, optical depth of rays through medium and surfaces to a picture of zeros."""
    here = np.full(ends.shape[:2], -np.inf)
    for layer in [*layers, None]:
        there = np.full_like(here, np.inf) if layer is None else layer.s
        interval = np.zeros_like(picture)
        trace_interval(np.stack([np.maximum(ends[..., 0], here), np.minimum(ends[..., 1], there)], axis=-1), interval)
        _put_behind(interval[..., :3], interval[..., 3], picture)
        if layer is not None:
            alpha = layer.color[..., 3]
            with np.errstate(divide="ignore"):
                _put_behind(layer.color[..., :3] * alpha[..., np.newaxis], -np.log1p(-alpha), picture)
        here = there


def _put_behind(light: Numbers, depth: Numbers, picture: Numbers) -> None:
    picture[..., :3] += np.exp(-picture[..., 3:]) * light
    picture[..., 3] += depth


def tracer_for(scene: CompleteScene, shadow_nodes: int | None = None) -> Trace:
    """Return the function that traces rays through the volumes of a scene, without geometry and caps.

    Shadows are exact, or interpolated between `shadow_nodes` along the longest edge of the box.

    `lit` and `several` are imported, and compiled, when the first scene needs them.
    """
    volume = scene.volume
    if scene.added or scene.mask is not None or volume.nearest or volume.colors is not None:
        from texvol.ray_casting.lit.shadows import shadows_in
        from texvol.ray_casting.several import tracer as several

        # Rays are found from the first volume's centre, which may be far from the other volumes.
        farthest = np.abs(scene.camera.eye) + np.abs(volume.centre)
        roundings = np.stack([position_rounding(each, farthest) for each in scene.volumes])
        return several.tracer(scene, roundings, shadows_in(scene, shadow_nodes, tracer_for))
    rounding = position_rounding(volume, scene.camera.eye)
    if scene.lighting is not None or scene.depth_cue is not None or scene.medium.needs_gradient:
        from texvol.ray_casting.lit import tracer as lit
        from texvol.ray_casting.lit.shadows import shadows_in

        return lit.tracer(scene, rounding, shadows_in(scene, shadow_nodes, tracer_for))
    return plain.tracer(scene, rounding)


def _thin_ends(scene: Scene, rays: Rays) -> Numbers:
    """Return the ends (…, 2) of a short interval behind each cut; empty where a ray begins at a box or the eye."""
    first, last = rays.ends[..., 0], rays.ends[..., 1]
    is_cut_open = np.zeros(first.shape, np.bool_)
    for volume, start, step in _rays_of_volumes(scene, rays):
        low, high = np.full(3, -0.5), np.array(volume.dimensions) - 0.5
        with np.errstate(divide="ignore", invalid="ignore"):
            faces = np.stack([(low - start) / step, (high - start) / step])
        enters = np.nan_to_num(faces.min(axis=0), nan=-np.inf).max(axis=-1)
        leaves = np.nan_to_num(faces.max(axis=0), nan=np.inf).min(axis=-1)
        is_cut_open |= (first > np.maximum(enters, rays.eye)) & (first < leaves)
    short = _SHORT * scene.smallest_spacing
    return np.stack([first, np.where(is_cut_open, np.minimum(first + short, last), -np.inf)], axis=-1)


def _rays_of_volumes(scene: Scene, rays: Rays) -> Iterator[tuple[Volume, Numbers, Numbers]]:
    """Yield each volume with starts and steps of rays in its index space."""
    first = scene.volume
    yield first, rays.start, rays.step
    if scene.added:
        nearest = transformed(rays.start - middle_of(first), first.world_from_index)
        directions = transformed(rays.step, first.world_from_index)
        for each in scene.added:
            yield each.volume, *rays_in(each.volume, first, nearest, directions)


def _caps_within(thin: Numbers, interval: Numbers) -> Numbers:
    """Return those intervals of `_thin_ends` that begin in an interval of the ray, the others empty."""
    first, last = thin[..., 0], thin[..., 1]
    begins = (first >= interval[..., 0]) & (first < interval[..., 1])
    return np.stack([first, np.where(begins, last, -np.inf)], axis=-1)


def _put_in_front(caps: Numbers, picture: Numbers) -> None:
    """Put opaque caps into a picture; both hold light and, in the last channel, optical depth."""
    met = caps[..., 3] > 0
    picture[met, :3] = caps[met, :3] / -np.expm1(-caps[met, 3:])
    picture[met, 3] = np.inf
