"""A computed chest: the CT, PET and label volumes of the pages' examples, from ellipsoids, tubes and a random tree.

Positions are in mm, x to the left, y to the back, z up (left-posterior-superior, as DICOM has it), with the origin in
the middle of the chest. Values of the CT are Hounsfield units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
Point = tuple[float, float, float]
AIR, FAT, MUSCLE, LUNG, VESSEL, LIVER, BLOOD, MARROW, CORTEX = -1000, -95, 50, -860, 20, 95, 290, 280, 1000
EXTENT = (336.0, 240.0, 320.0)  # of the box, along x, y, z
LABELS = {"bones": 1, "left lung": 2, "right lung": 3, "heart": 4, "aorta": 5, "liver": 6, "kidneys": 7}
_CAGE = (122.0, 82.0)  # half axes of the rib cage, along x and y, at its widest
_SPINE_Y = 74.0


@dataclass(frozen=True)
class Grid:
    """Positions of samples, broadcast to (z, y, x), and their distance in mm."""

    x: Array
    y: Array
    z: Array
    spacing: float

    @staticmethod
    def of(spacing: float) -> Grid:
        """The grid that fills EXTENT with samples `spacing` apart."""
        x, y, z = (
            ((np.arange(round(edge / spacing)) + 0.5) * spacing - edge / 2).astype(np.float32) for edge in EXTENT
        )
        return Grid(x, y[:, None], z[:, None, None], spacing)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(z, y, x)."""
        return self.z.shape[0], self.y.shape[0], self.x.shape[0]

    def inside(self, distance: Array) -> Array:
        """Fraction of a sample inside a shape, from the signed distance in mm to its surface."""
        return np.clip(0.5 - distance / (1.5 * self.spacing), 0, 1)

    def ellipsoid(self, centre: Point, radii: Point) -> Array:
        """Distance to an ellipsoid, in mm near its surface."""
        scaled = [(axis - c) / r for axis, c, r in zip((self.x, self.y, self.z), centre, radii, strict=True)]
        return (np.sqrt(sum(each * each for each in scaled)) - 1) * min(radii)

    def capsule(self, start: Point, end: Point, radius: float) -> Array:
        """Distance to a rod with round ends."""
        a, b = np.array(start, np.float32), np.array(end, np.float32)
        axis = b - a
        relative = (self.x - a[0], self.y - a[1], self.z - a[2])
        along = np.clip(sum(r * d for r, d in zip(relative, axis, strict=True)) / (axis @ axis), 0, 1)
        return np.sqrt(sum((r - along * d) ** 2 for r, d in zip(relative, axis, strict=True))) - radius


def chest(spacing: float, beat: float = 0.0) -> Array:
    """The CT (z, y, x); `beat` from 0 to 1 is how far the heart has contracted."""
    grid = Grid.of(spacing)
    values = np.full(grid.shape, AIR, np.float32)
    layers = [(body(grid, 0), FAT), (body(grid, 11), MUSCLE)]
    for side in (1, -1):
        layers.append((grid.inside(lung(grid, side)), LUNG))
    layers += [(vessels(grid), VESSEL), (grid.inside(liver(grid)), LIVER), (grid.inside(kidneys(grid)), 190)]
    layers += [(grid.inside(heart(grid, beat)), MUSCLE + 70), (grid.inside(heart(grid, beat) + 9), BLOOD)]
    layers.append((grid.inside(aorta(grid)), BLOOD))
    skeleton = bones(grid)
    layers += [(grid.inside(skeleton), CORTEX), (grid.inside(skeleton + 3), MARROW)]
    for weight, value in layers:
        values += weight * (value - values)
    return blurred(values)


def blurred(values: Array) -> Array:
    """The values as a scanner sees them: weights 1, 2, 1 along each axis."""
    for axis in range(values.ndim):
        padded = np.pad(values, [(int(each == axis),) * 2 for each in range(values.ndim)], mode="edge")
        low, middle, high = (np.take(padded, np.arange(values.shape[axis]) + k, axis) for k in range(3))
        values = ((low + high) / 4 + middle / 2).astype(np.float32)
    return values


def pet(spacing: float) -> Array:
    """Uptake of a tracer: the heart's wall, the kidneys, faintly the liver, and a small tumour in the right lung."""
    grid = Grid.of(spacing)
    wall = heart(grid, 0)
    uptake = 4 * np.exp(-(((wall + 5) / 6) ** 2)) + 2.5 * grid.inside(kidneys(grid)) + 0.8 * grid.inside(liver(grid))
    tumour = np.exp(-((grid.ellipsoid((-62, 18, 62), (9, 9, 9)).clip(-9) + 9) ** 2) / 90)
    return (uptake + 8 * tumour + 0.25 * body(grid, 0)).astype(np.float32)


def organs(spacing: float) -> NDArray[np.uint8]:
    """The label of each sample, as in LABELS; 0 elsewhere."""
    grid = Grid.of(spacing)
    shapes = {
        "left lung": lung(grid, 1), "right lung": lung(grid, -1), "heart": heart(grid, 0), "aorta": aorta(grid),
        "liver": liver(grid), "kidneys": kidneys(grid), "bones": bones(grid),
    }  # fmt: skip
    labels = np.zeros(grid.shape, np.uint8)
    for name, distance in shapes.items():
        labels[distance < 0] = LABELS[name]
    return labels


def body(grid: Grid, depth: float) -> Array:
    """Fraction of each sample that lies more than `depth` mm under the skin."""
    waist = 1 - 0.10 * np.cos(grid.z / 95) - 0.10 * np.clip((grid.z - 90) / 70, 0, 1) ** 2
    scaled = (np.abs(grid.x / (156 * waist)) ** 2.4 + np.abs(grid.y / (106 * waist)) ** 2.4) ** (1 / 2.4)
    return grid.inside((scaled - 1) * 106 + depth)


def lung(grid: Grid, side: int) -> Array:
    """Distance to the left lung (side 1) or the right one (-1): an ellipsoid, less the dome of the diaphragm."""
    outer = grid.ellipsoid((58 * side, 2, 10), (49, 66, 122))
    dome = grid.ellipsoid((58 * side, 0, -150), (75, 95, 102 + 8 * (side < 0)))
    return np.maximum(np.maximum(outer, -dome), -(heart(grid, 0) - 5))


def liver(grid: Grid) -> Array:
    """Distance to the liver, under the right lung."""
    return np.maximum(grid.ellipsoid((-46, -4, -104), (70, 66, 46)), grid.ellipsoid((-58, 0, -150), (71, 90, 97)))


def kidneys(grid: Grid) -> Array:
    """Distance to the nearer kidney."""
    return np.minimum(*(grid.ellipsoid((50 * side, 44, -128), (19, 17, 32)) for side in (1, -1)))


def heart(grid: Grid, beat: float) -> Array:
    """Distance to the heart: an egg whose tip points to the left, to the front and down."""
    axis = np.array((0.62, -0.42, -0.66), np.float32)
    centre = (20.0, -22.0, -22.0)
    relative = (grid.x - centre[0], grid.y - centre[1], grid.z - centre[2])
    along = sum(r * a for r, a in zip(relative, axis, strict=True))
    across = np.sqrt(np.maximum(sum(r * r for r in relative) - along * along, 0))
    long, wide = 54 * (1 - 0.10 * beat), 41 * (1 - 0.22 * beat)
    return (np.hypot(along / long, across * (1 + 0.22 * along / long) / wide) - 1) * wide


def aorta(grid: Grid) -> Array:
    """Distance to the aorta: up from the heart, over an arch, and down before the spine."""
    angle = np.arctan2(grid.z - 56, grid.y - 16)
    ring = np.hypot(np.hypot(grid.y - 16, grid.z - 56) - 32, grid.x - 8 - 0.18 * (grid.y - 16)) - 12
    arch = np.where(angle > 0, ring, 1e3)
    rising = grid.capsule((2, -16, 56), (8, -16, 6), 13)
    falling = grid.capsule((14, 48, 56), (10, 50, -190), 11)
    return np.minimum(np.minimum(arch, rising), falling)


def bones(grid: Grid) -> Array:
    """Distance to the nearest bone."""
    parts = (spine, ribs, breastbone, collarbones, shoulder_blades)
    distance = np.full(grid.shape, 1e3, np.float32)
    for part in parts:
        distance = np.minimum(distance, part(grid))
    return distance


def spine(grid: Grid) -> Array:
    """Distance to the vertebrae, 27 mm apart, with discs between them and three processes each."""
    height = (grid.z + 13.5) % 27 - 13.5
    waist = 17.5 - 2.5 * np.cos(height / 10.5 * np.pi / 2)
    trunk = np.maximum(np.hypot(grid.x, (grid.y - _SPINE_Y) * 1.15) - waist, np.abs(height) - 10.5)
    canal = 8.5 - np.hypot(grid.x, grid.y - _SPINE_Y - 21)
    arch = np.maximum(np.hypot(grid.x, grid.y - _SPINE_Y - 21) - 13, np.abs(height) - 7)
    aside = np.hypot(grid.y - _SPINE_Y - 17 - 0.12 * np.abs(grid.x), height) - 4.5
    aside = np.maximum(aside, np.abs(grid.x) - 36)
    behind = np.maximum(np.hypot(grid.x * 1.6, height + 0.5 * (grid.y - _SPINE_Y - 30)) - 6, grid.y - _SPINE_Y - 48)
    behind = np.maximum(behind, _SPINE_Y + 28 - grid.y)
    processes = np.minimum(np.minimum(arch, aside), behind)
    return np.minimum(trunk, np.maximum(processes, canal))


def ribs(grid: Grid) -> Array:
    """Distance to the ribs: slanting rings about a dome that end beside the spine and before the breastbone."""
    distance = np.full(grid.shape, 1e3, np.float32)
    for number in range(10):
        level = 116.0 - 24 * number
        wide = np.sqrt(max(1 - ((level + 52) / 240) ** 2, 0.05))
        a, b = _CAGE[0] * wide, _CAGE[1] * (0.35 + 0.65 * wide)
        scale = np.hypot(grid.x / a, grid.y / b)
        ring = (scale - 1) * np.hypot(grid.x, grid.y) / np.maximum(scale, 1e-3)
        slanting = grid.z - level - (0.42 + 0.012 * number) * grid.y + 0.0022 * np.abs(grid.x) ** 1.6
        rib = (np.hypot(ring / 3.6, slanting * 0.9 / 6.4) - 1) * 3.6
        front = -grid.y / b  # 1 at the breastbone
        ends = 0.93 + 0.05 * (number < 7) - 0.05 * max(number - 6, 0)
        distance = np.minimum(distance, np.maximum(rib, (front - ends) * b))
    return distance


def breastbone(grid: Grid) -> Array:
    """Distance to the breastbone."""
    level = np.clip((grid.z + 36) / 110, 0, 1)
    plane = grid.y + 80 - 14 * level
    width = 12 + 9 * np.clip((grid.z - 48) / 24, 0, 1)
    flat = np.maximum(np.abs(plane) - 4.5, np.abs(grid.x) - width)
    return np.maximum(flat, np.maximum(grid.z - 76, -64 - grid.z))


def collarbones(grid: Grid) -> Array:
    """Distance to the collarbones."""
    pairs = [
        grid.capsule((16 * side, -62, 82), (74 * side, -66, 94), 6) for side in (1, -1)
    ] + [grid.capsule((74 * side, -66, 94), (128 * side, -22, 104), 5) for side in (1, -1)]  # fmt: skip
    return np.minimum.reduce(pairs)


def shoulder_blades(grid: Grid) -> Array:
    """Distance to the shoulder blades: bent plates behind the ribs, each with a ridge."""
    x = np.abs(grid.x) - 84
    plate = grid.y - 80 + 0.55 * x + 0.10 * (grid.z - 40)
    triangle = np.maximum(np.abs(x) - 0.42 * (grid.z + 28), grid.z - 92)
    ridges = (
        grid.capsule((64 * side, 96, 62), (126 * side, 52, 92), 5.5) for side in (1, -1)
    )  # fmt: skip
    return np.minimum(np.maximum(np.abs(plate) - 2.6, triangle), np.minimum(*ridges))


def vessels(grid: Grid) -> Array:
    """Fraction of each sample that the vessels of the lungs fill: a random tree on each side."""
    filled = np.zeros(grid.shape, np.float32)
    # RandomState, because its numbers are promised to stay the same.
    random = np.random.RandomState(1628)
    for side in (1, -1):
        room = grid.inside(lung(grid, side) + 3)
        tree = np.zeros(grid.shape, np.float32)
        _branch(grid, tree, random, np.array((16.0 * side, 12, 22)), np.array((side * 1.0, 0.1, 0.0)), 34, 5.2, 7)
        filled = np.maximum(filled, tree * room)
    return filled


def _branch(grid: Grid, tree: Array, random: np.random.RandomState, start: NDArray, heading: NDArray,
            length: float, radius: float, generations: int) -> None:  # fmt: skip
    """Draw a vessel into `tree`, and those that branch off it."""
    end = start + heading / np.linalg.norm(heading) * length
    _draw_rod(grid, tree, start, end, radius)
    if generations == 0:
        return
    turns = random.standard_normal((2, 3)) * 0.38
    across = np.cross(heading, random.standard_normal(3))
    across *= 0.8 / np.linalg.norm(across)
    for turn, sign in zip(turns, (1, -1), strict=True):
        outward = heading / np.linalg.norm(heading) + sign * across + turn
        _branch(grid, tree, random, end, outward, length * 0.80, radius * 0.76, generations - 1)


def _draw_rod(grid: Grid, tree: Array, start: NDArray, end: NDArray, radius: float) -> None:
    """Draw one rod where it can reach."""
    reach = radius + 3 * grid.spacing
    bounds = np.stack([np.minimum(start, end) - reach, np.maximum(start, end) + reach], axis=1)
    axes = (grid.x, grid.y.ravel(), grid.z.ravel())
    x, y, z = (slice(*np.searchsorted(axis, ends)) for axis, ends in zip(axes, bounds, strict=True))
    part = Grid(grid.x[x], grid.y[y], grid.z[z], grid.spacing)
    if 0 in part.shape:
        return
    rod = part.inside(part.capsule(tuple(start), tuple(end), radius))
    # A rod thinner than a sample fills a part of it.
    thin = min(1.0, (2 * radius / grid.spacing) ** 2)
    tree[z, y, x] = np.maximum(tree[z, y, x], rod * thin)
