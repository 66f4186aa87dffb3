"""Layers of surfaces on rays: order and colour of the hits.

A ray x = p + s w, p perpendicular to w, meets a triangle abc if the volumes w · (b - p) × (c - p), one for each edge,
have one sign; they are the weights of the corners, and s is the mean of the corners' x · w with these weights. The
volumes of an edge that two triangles share differ in sign only, and 0 counts as positive for an edge that goes up in
the order of its corners' coordinates: so a ray through an edge meets one of the two triangles. A line is met where
the centre of a pixel lies near it in the picture. All numbers are float64.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.rays import Choose, Numbers
from texvol.ray_casting.common.surface_lighting import cued, reflected
from texvol.ray_casting.surfaces.hits import hits_of_lines, hits_of_triangles
from texvol.scene.scene import CompleteScene, Scene
from texvol.scene.shapes import Lines, Mesh

# Fraction of distance plus the box's radius: surfaces nearer to each other than this are at one position, and are in
# the order of the scene. Rounding is 2^-50, or somewhat more for a grazing ray.
_SAME = 2.0**-36
_BEFORE_THE_EYE = 1e-9  # depth at which lines are cut off, as a fraction of their depths: depth 0 has no pixel


class Layer(NamedTuple):
    """The next surface on each ray of a picture."""

    s: Numbers  # as in `Rays`, (height, width); infinite where there is no surface
    color: Numbers  # straight colour and opacity, (height, width, 4)

    def chosen(self, choose: Choose) -> Layer:
        """Return the layer of some rays."""
        return Layer(choose(self.s), choose(self.color))

    def until(self, end: Numbers) -> Layer:
        """Return the layer without surfaces behind the s `end`."""
        is_seen = self.s <= end
        return Layer(np.where(is_seen, self.s, np.inf), np.where(is_seen[..., np.newaxis], self.color, 0.0))


class _Hits(NamedTuple):
    pixel: NDArray[np.int64]
    s: Numbers
    weights: Numbers  # of the corners, (n, 3)
    primitive: NDArray[np.int64]  # number among all triangles and segments, in the order of the scene
    shape: NDArray[np.int64]

    def at(self, index: NDArray) -> _Hits:
        return _Hits(*(each[index] for each in self))


class _View(NamedTuple):
    """The rays of a picture, see `Rays`, relative to the centre of the scene's volume: shapes (height, width, …)."""

    scene: CompleteScene
    size: tuple[int, int]
    nearest: Numbers
    directions: Numbers
    eye: Numbers

    @property
    def diverges(self) -> bool:
        return self.scene.camera.projection == "perspective"

    def in_eye_space(self, points: Numbers) -> Numbers:
        """Return right, up and depth (n, 3) of points relative to the centre of the volume."""
        return self.scene.camera.in_eye_space(points, self.scene.volume.centre)

    def pixels(self, across: Numbers) -> Numbers:
        """Return columns and rows, from the centre of the first pixel, of right and up at depth 1."""
        scale = self.size[1] / 2 / self.scene.camera.half_height
        return across * (scale, -scale) + (np.array(self.size) - 1) / 2


def surface_layers(scene: CompleteScene, size: tuple[int, int], choose: Choose) -> list[Layer]:
    """Return the surfaces in front of the eye on chosen rays, front to back, up to the first opaque one."""
    eyes, directions = scene.camera.rays(size)
    from_centre = eyes - scene.volume.centre
    eye = (from_centre * directions).sum(axis=-1)
    view = _View(scene, size, from_centre - eye[..., np.newaxis] * directions, directions, eye)
    parts, count = [], 0
    for number, shape in enumerate(scene.geometry):
        found = _on_mesh(shape, view) if isinstance(shape, Mesh) else _on_lines(shape, view)
        pixel, s, weights, primitive = found
        parts.append(_Hits(pixel, s, weights, primitive + count, np.full(len(pixel), number)))
        count += len(shape.triangles if isinstance(shape, Mesh) else shape.segments)
    hits = _Hits(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
    hits = _in_order(_seen(hits, view), scene)
    return [layer.chosen(choose) for layer in _in_layers(hits, _colors(hits, view), size)]


def put_before(layers: list[Layer], until: Numbers, picture: Numbers) -> None:
    """Composite the surfaces at s < `until` over a picture of premultiplied colours and opacities."""
    light, left = np.zeros((*until.shape, 3)), np.ones((*until.shape, 1))
    for layer in layers:
        alpha = np.where(layer.s < until, layer.color[..., 3], 0.0)[..., np.newaxis]
        light += left * alpha * layer.color[..., :3]
        left *= 1 - alpha
    picture[..., :3] = light + left * picture[..., :3]
    picture[..., 3:] = 1 - left * (1 - picture[..., 3:])


def _on_mesh(mesh: Mesh, view: _View) -> tuple[NDArray, ...]:
    """Return pixels, s, weights and triangles of all hits of rays with a mesh, in front of the eye or behind it."""
    vertices = mesh.vertices - view.scene.volume.centre
    in_eye_space = view.in_eye_space(vertices)
    across, depths = in_eye_space[:, :2], in_eye_space[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        corners = view.pixels(across / depths[:, np.newaxis] if view.diverges else across)[mesh.triangles]
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    if view.diverges:
        through_eye = ~(depths[mesh.triangles] > 0).all(axis=1)
        boxes[through_eye] = 0, 0, view.size[0] - 1, view.size[1] - 1
    return hits_of_triangles(vertices[mesh.triangles], _whole(boxes, 1.0, view.size), view.nearest, view.directions)


def _on_lines(lines: Lines, view: _View) -> tuple[NDArray, ...]:
    """Return pixels, s, weights and segments of all hits of rays with lines."""
    ends = view.in_eye_space(lines.points - view.scene.volume.centre)[lines.segments]  # (m, 2, 3)
    kept = np.arange(len(ends))
    if view.diverges:
        least = _BEFORE_THE_EYE * np.abs(ends[..., 2]).max(axis=1)
        kept = np.flatnonzero((ends[..., 2] > least[:, np.newaxis]).any(axis=1))
        ends = np.stack([_cut_off(ends[kept], least[kept]), _cut_off(ends[kept, ::-1], least[kept])], axis=1)
    weights = 1 / ends[..., 2:] if view.diverges else np.ones((len(ends), 2, 1))
    positions = view.pixels(ends[..., :2] * weights)
    boxes = np.concatenate([positions.min(axis=1), positions.max(axis=1)], axis=1)
    table = np.concatenate([positions, weights, ends[..., 2:]], axis=-1)
    boxes = _whole(boxes, lines.width / 2 + 1, view.size)
    pixel, depth, segment = hits_of_lines(table, boxes, lines.width / 2, view.size)
    along = (view.directions.reshape(-1, 3) @ view.scene.camera.forward)[pixel]
    s = view.eye.reshape(-1)[pixel] + depth / along
    return pixel, s, np.zeros((len(pixel), 3)), kept[segment]


def _cut_off(ends: Numbers, least: Numbers) -> Numbers:
    """Return the first of two ends (n, 2, 3), moved to the depth `least` where its depth is less."""
    a, b = ends[:, 0], ends[:, 1]
    rise = b[:, 2] - a[:, 2]
    is_cut = a[:, 2] < least
    fraction = np.divide(least - a[:, 2], rise, out=np.zeros_like(rise), where=is_cut)
    return a + fraction[:, np.newaxis] * (b - a)


def _whole(boxes: Numbers, margin: float, size: tuple[int, int]) -> NDArray[np.int64]:
    """Return first column and row and last column and row (n, 4) of pixels that boxes of positions may touch."""
    most = np.array([*size, *size]) - 1
    boxes = np.nan_to_num(boxes, nan=0.0, posinf=1e9, neginf=-1e9)
    low = np.floor(boxes[:, :2] - margin).clip(0, most[:2] + 1)
    high = np.ceil(boxes[:, 2:] + margin).clip(-1, most[2:])
    return np.concatenate([low, high], axis=1).astype(np.int64)


def _seen(hits: _Hits, view: _View) -> _Hits:
    """Return the hits in front of the eye that are not cut away."""
    scene, is_seen = view.scene, hits.s >= view.eye.reshape(-1)[hits.pixel]
    if scene.cutting:
        is_cut = np.array([shape.cut for shape in scene.geometry])[hits.shape]
        first, last = scene.cutting.interval(scene.volume, view.nearest, view.directions)
        inside = (first.reshape(-1)[hits.pixel] <= hits.s) & (hits.s <= last.reshape(-1)[hits.pixel])
        is_seen &= inside | ~is_cut
    return hits.at(is_seen)


def _in_order(hits: _Hits, scene: Scene) -> _Hits:
    """Return hits pixel by pixel, front to back: of each Lines the nearest, and none behind the first opaque one."""
    hits = hits.at(np.lexsort((hits.s, hits.pixel)))
    apart = np.diff(hits.s, prepend=-np.inf) > _SAME * (np.abs(hits.s) + scene.volume.radius)
    is_next = apart | (np.diff(hits.pixel, prepend=-1) > 0)
    hits = hits.at(np.lexsort((hits.primitive, np.cumsum(is_next))))
    is_line = np.array([isinstance(shape, Lines) for shape in scene.geometry])[hits.shape]
    pairs = np.where(is_line, hits.pixel * len(scene.geometry) + hits.shape, -1 - np.arange(len(hits.pixel)))
    hits = hits.at(np.sort(np.unique(pairs, return_index=True)[1]))
    is_opaque = np.array([shape.opacity == 1 for shape in scene.geometry])[hits.shape].astype(np.int64)
    passed = np.cumsum(is_opaque) - is_opaque
    return hits.at(passed == passed[_first_of_pixel(hits)])


def _first_of_pixel(hits: _Hits) -> NDArray[np.int64]:
    """Return, for each hit, the index of the first hit in its pixel."""
    starts = np.flatnonzero(np.diff(hits.pixel, prepend=-1))
    return np.repeat(starts, np.diff(starts, append=len(hits.pixel)))


def _colors(hits: _Hits, view: _View) -> Numbers:
    """Return straight colour, lit and cued, and opacity of hits, shape (n, 4)."""
    scene, camera = view.scene, view.scene.camera
    looks = np.array([(*shape.color, shape.opacity) for shape in scene.geometry])
    colors = looks[hits.shape]
    to_eye = -view.directions.reshape(-1, 3)[hits.pixel]
    lighting = scene.surface_lighting
    if lighting is not None:
        is_lit = np.array([isinstance(shape, Mesh) and shape.lit for shape in scene.geometry])[hits.shape]
        positions = view.nearest.reshape(-1, 3)[hits.pixel] - hits.s[:, np.newaxis] * to_eye
        slopes = -_normals(hits, scene)
        diffuse, specular = reflected(lighting, scene.volume, slopes[is_lit], positions[is_lit], to_eye[is_lit])
        colors[is_lit, :3] = colors[is_lit, :3] * diffuse + specular
    if scene.depth_cue is not None:
        depth = (hits.s - view.eye.reshape(-1)[hits.pixel]) * -(to_eye @ camera.forward)
        colors[:, :3] = cued(scene.depth_cue, scene.box, camera, colors[:, :3], depth)
    return colors


def _normals(hits: _Hits, scene: Scene) -> Numbers:
    """Return normals (n, 3): interpolated where a mesh has normals, else of the triangles; 0 if not lit."""
    normals = np.zeros((len(hits.pixel), 3))
    first = 0
    for number, shape in enumerate(scene.geometry):
        here = np.flatnonzero(hits.shape == number)
        if isinstance(shape, Mesh) and shape.lit:
            triangles = shape.triangles[hits.primitive[here] - first]
            if shape.normals is None:
                a, b, c = (shape.vertices[triangles[:, corner]] for corner in range(3))
                normals[here] = np.cross(_unit(b - a), _unit(c - a))
            else:
                normals[here] = (hits.weights[here][..., np.newaxis] * _unit(shape.normals[triangles])).sum(axis=1)
        first += len(shape.triangles if isinstance(shape, Mesh) else shape.segments)
    return normals


def _unit(vectors: Numbers) -> Numbers:
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    wide = np.divide(vectors, largest, out=np.zeros_like(vectors), where=largest > 0)
    length = np.linalg.norm(wide, axis=-1, keepdims=True)
    return np.divide(wide, length, out=np.zeros_like(wide), where=length > 0)


def _in_layers(hits: _Hits, colors: Numbers, size: tuple[int, int]) -> list[Layer]:
    width, height = size
    rank = np.arange(len(hits.pixel)) - _first_of_pixel(hits)
    layers = []
    for number in range(rank.max(initial=-1) + 1):
        here = rank == number
        layer = Layer(np.full(height * width, np.inf), np.zeros((height * width, 4)))
        layer.s[hits.pixel[here]], layer.color[hits.pixel[here]] = hits.s[here], colors[here]
        layers.append(Layer(layer.s.reshape(height, width), layer.color.reshape(height, width, 4)))
    return layers
