"""A camera says which ray belongs to which pixel, in float64.

Right-handed: x to the right of the picture, y up, the camera looks along -z of its own (eye) space from `eye` to
`target`. Rays pass through pixel centres, row 0 is the top, and start in the plane of the eye: what lies behind it is
not seen, in orthographic projection too. This is the only module that uses pyrr, whose matrices multiply row vectors;
they are transposed here, once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pyrr import matrix44

from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.util.late import ShownInNotebooks

Projection = Literal["orthographic", "perspective"]
Vector = NDArray[np.float64]
Triple = tuple[float, float, float]

DEFAULT_FOV = 40.0
FRAMING_MARGIN = 1.05  # a twentieth of air around a framed box


@dataclass(frozen=True)
class PixelRays:
    """Rays of a picture, affine in the pixel: `point` + x `point_per_column` + y `point_per_row`, likewise `velocity`.

    (x, y) counts pixels from the middle of the picture, y upwards. `point` is where the ray meets the plane of
    constant depth through a reference point, relative to that point; `velocity` is the path of the ray while
    its depth grows by one world unit (so its length is 1/cos of the angle to the view). Kept relative to the volume,
    so that float32 has digits left when the world's coordinates are large.
    """

    point: Vector
    point_per_column: Vector
    point_per_row: Vector
    velocity: Vector
    velocity_per_column: Vector
    velocity_per_row: Vector
    reference_depth: float  # depth of the reference point, seen from the eye


@dataclass(frozen=True, repr=False)
class Camera(ShownInNotebooks):
    """An eye, what it looks at, and how it projects; made by `perspective`, `orthographic` or `framing`."""

    projection: Projection
    eye: Triple
    target: Triple
    up: Triple
    fov: float = DEFAULT_FOV  # degrees from bottom to top, perspective
    height: float = 1.0  # world units from bottom to top, orthographic

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            object.__setattr__(self, name, _finite_triple(getattr(self, name), name))
        view = np.subtract(self.target, self.eye)
        if not np.linalg.norm(view) > 0:
            raise InputError(f"camera: eye and target must differ, got {_text(self.eye)}")
        if not np.linalg.norm(self.up) > 0:
            raise InputError("camera: up must not be zero")
        # Under 1e-6 rad between up and view, the picture's roll would be decided by rounding.
        sine = np.linalg.norm(np.cross(view / np.linalg.norm(view), np.array(self.up) / np.linalg.norm(self.up)))
        if not sine > 1e-6:
            raise InputError(f"camera: up must not be parallel to the view, got {_text(self.up)}")
        if self.projection not in ("orthographic", "perspective"):
            raise InputError(f"camera: projection must be orthographic or perspective, got {self.projection!r}")
        if not 0 < self.fov < 180:
            raise InputError(f"camera: fov must be an angle between 0 and 180 degrees, got {self.fov:g}")
        if not 0 < self.height < np.inf:
            raise InputError(f"camera: height must be positive and finite, got {self.height:g}")

    def __repr__(self) -> str:
        extent = f"fov={self.fov:.6g}" if self.projection == "perspective" else f"height={self.height:.6g}"
        places = ", ".join(f"{name}=({_text(getattr(self, name))})" for name in ("eye", "target", "up"))
        return f"Camera.{self.projection}({places}, {extent})"

    @classmethod
    def perspective(cls, eye: ArrayLike, target: ArrayLike, up: ArrayLike, fov: float = DEFAULT_FOV) -> Camera:
        """Camera whose rays start at `eye` (world units); `fov` is the angle from bottom to top, in degrees."""
        return cls("perspective", *_places(eye, target, up), fov=fov)

    @classmethod
    def orthographic(cls, eye: ArrayLike, target: ArrayLike, up: ArrayLike, height: float) -> Camera:
        """Camera of parallel rays; `height` is what the picture shows from bottom to top, in world units."""
        return cls("orthographic", *_places(eye, target, up), height=height)

    @classmethod
    def framing(
        cls,
        volume: Volume,
        projection: Projection = "orthographic",
        *,
        eye: ArrayLike | None = None,
        target: ArrayLike | None = None,
        up: ArrayLike | None = None,
        fov: float | None = None,
        height: float | None = None,
        aspect: float = 1.0,
    ) -> Camera:
        """Camera that shows the whole box where the arguments leave a choice; `aspect` is width over height."""
        fov = DEFAULT_FOV if fov is None else fov
        aim = volume.centre if target is None else np.array(_finite_triple(target, "target"))
        position = aim - _default_view(volume) if eye is None else np.array(_finite_triple(eye, "eye"))
        upward = _default_up(aim - position) if up is None else up
        height_so_far = 1.0 if height is None else height
        camera = cls(projection, *_places(position, aim, upward), fov=fov, height=height_so_far)
        if projection == "orthographic" and height is None:
            across, above, _ = np.abs(camera.in_eye_space(volume.corners_from_centre, volume.centre)).T
            reach = max(float(above.max()), float(across.max()) / aspect)
            camera = replace(camera, height=2 * FRAMING_MARGIN * reach)
        if eye is not None:
            return camera
        distance = 2 * volume.radius if projection == "orthographic" else camera.fitting_distance(volume, aspect)
        return camera.at_distance(distance)

    @property
    def target_distance(self) -> float:
        """Distance from the eye to the target, in world units."""
        return float(np.linalg.norm(np.subtract(self.target, self.eye)))

    def fitting_distance(self, volume: Volume, aspect: float) -> float:
        """Return the distance from the target at which every corner of the box is in the picture, in perspective."""
        across, above, depth = self.in_eye_space(volume.corners_from_centre, volume.centre).T
        slope = self.half_height / FRAMING_MARGIN
        needed = np.maximum(np.abs(above) / slope, np.abs(across) / (slope * aspect)) - (depth - self.target_distance)
        return float(needed.max())

    def at_distance(self, distance: float) -> Camera:
        """Return the camera with its eye moved along the view to `distance` from the target, in world units."""
        return replace(self, eye=tuple(np.array(self.target) - distance * self.forward))

    @cached_property
    def eye_from_world(self) -> NDArray[np.float64]:
        """Matrix of shape (4, 4) that takes world coordinates to eye space."""
        return matrix44.create_look_at(self.eye, self.target, self.up, dtype=np.float64).T

    @property
    def right(self) -> Vector:
        """Unit vector of the world that points to the right of the picture."""
        return self.eye_from_world[0, :3]

    @property
    def upward(self) -> Vector:
        """Unit vector of the world that points up in the picture."""
        return self.eye_from_world[1, :3]

    @property
    def forward(self) -> Vector:
        """Unit vector of the world that points away from the eye, along the view."""
        return -self.eye_from_world[2, :3]

    @property
    def half_height(self) -> float:
        """Half of the picture's height: world units (orthographic), or world units at depth 1 (perspective)."""
        return self.height / 2 if self.projection == "orthographic" else float(np.tan(np.radians(self.fov) / 2))

    def largest_obliquity(self, size: tuple[int, int]) -> float:
        """Length of the most oblique ray of a picture between two planes at distance 1 across the view."""
        if self.projection == "orthographic":
            return 1.0
        return float(np.sqrt(1 + self.half_height**2 * (1 + (size[0] / size[1]) ** 2)))

    def clip_from_eye(self, aspect: float, near: float, far: float) -> NDArray[np.float64]:
        """Matrix of shape (4, 4) that takes eye space, in which the view goes along -z, to clip coordinates.

        `aspect` is width over height; nothing nearer than `near` or farther than `far` is kept, in world units.
        """
        if self.projection == "perspective":
            return matrix44.create_perspective_projection(self.fov, aspect, near, far, dtype=np.float64).T
        right, top = self.half_height * aspect, self.half_height
        return matrix44.create_orthogonal_projection(-right, right, -top, top, near, far, dtype=np.float64).T

    def in_eye_space(self, points: NDArray[np.float64], about: Vector) -> NDArray[np.float64]:
        """Right, up and depth, world units, of `points`, shape (..., 3), given relative to the world point `about`."""
        axes = np.stack([self.right, self.upward, self.forward])
        # einsum: many points times three numbers are slower by the threads of a matrix product.
        return np.einsum("...k,jk->...j", points, axes) + axes @ (about - self.eye)

    def rays(self, size: tuple[int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """World origins and unit directions of every pixel's ray, both of shape (height, width, 3), row 0 on top."""
        width, height = size
        pixel = 2 * self.half_height / height
        x = (np.arange(width) - (width - 1) / 2)[np.newaxis, :, np.newaxis] * pixel
        y = ((height - 1) / 2 - np.arange(height))[:, np.newaxis, np.newaxis] * pixel
        across = x * self.right + y * self.upward
        if self.projection == "orthographic":
            return self.eye + across, np.broadcast_to(self.forward, across.shape).copy()
        directions = self.forward + across
        directions /= np.linalg.norm(directions, axis=2, keepdims=True)
        return np.broadcast_to(np.array(self.eye), across.shape).copy(), directions

    def pixel_rays(self, size: tuple[int, int], about: Vector) -> PixelRays:
        """Rays of a picture, affine in the pixel and relative to the world point `about`."""
        pixel = 2 * self.half_height / size[1]
        depth = float(self.forward @ (about - self.eye))
        to_axis = self.eye + depth * self.forward - about  # from the reference point to the middle of the picture
        right, up, zero = pixel * self.right, pixel * self.upward, np.zeros(3)
        if self.projection == "orthographic":
            return PixelRays(to_axis, right, up, self.forward, zero, zero, depth)
        return PixelRays(to_axis, depth * right, depth * up, self.forward, right, up, depth)


def _default_view(volume: Volume) -> Vector:
    """Default view: at the front of a patient, from the left and a little above; up is +z."""
    anterior = 1.0 if volume.space.lower() in ("right-anterior-superior", "left-anterior-superior") else -1.0
    return volume.radius * np.array([-0.5, -anterior, -0.35])


def _default_up(view: Vector) -> Triple:
    """+z, or +y where the view goes along z."""
    along_z = np.linalg.norm(np.cross(view, (0, 0, 1))) < 1e-3 * np.linalg.norm(view)
    return (0.0, 1.0, 0.0) if along_z else (0.0, 0.0, 1.0)


def _places(eye: ArrayLike, target: ArrayLike, up: ArrayLike) -> tuple[Triple, Triple, Triple]:
    return _finite_triple(eye, "eye"), _finite_triple(target, "target"), _finite_triple(up, "up")


def _finite_triple(numbers: Any, name: str) -> Triple:
    try:
        triple = tuple(float(number) for number in numbers)
    except (TypeError, ValueError):
        triple = ()
    if len(triple) != 3 or not np.isfinite(triple).all():
        raise InputError(f"camera: {name} must be three finite numbers x, y, z, got {numbers!r}")
    if max(map(abs, triple)) > 1e100:  # its square has to be a number, too
        raise InputError(f"camera: {name} must be at most 1e100 in size, got {_text(triple)}")
    return triple


def _text(triple: Sequence[float]) -> str:
    return ",".join(f"{number:g}" for number in triple)
