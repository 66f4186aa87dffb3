"""Path of a camera through saved views.

Between two views at times t_i and t_(i+1), with u from 0 to 1 between them, every quantity of the camera is a cubic
Hermite curve: it has the value of the view at each end, and a rate of change that both sides of the view share, so that
the camera never jerks. At a view where the camera stops, and at the ends of an open path, the rate is 0, and the curve
is u² (3 - 2 u). At other views the rate is the mean of the rates on both sides, weighted by the time on the other side;
for numbers that must not overshoot it is their harmonic mean, or 0 at a turning point (Fritsch, Butland 1984).

The quantities are the target; the logarithm of the height h that the picture shows there; the slope s = tan(fov / 2)
of the upper border, 0 in orthographic projection, from which the distance of a perspective eye follows, h / (2 s); the
distance of an orthographic eye; and the orientation, a unit quaternion q (Kim, Kim, Shin 1995):

    q(u) = q_i exp(b_1 ω_i / 3) exp(b_2 ω) exp(b_3 ω_(i+1) / 3)
    b_1 = 1 - (1 - u)³        b_2 = u² (3 - 2 u)        b_3 = u³

with the angular velocities ω_i and ω_(i+1) in the camera's own axes, and ω such that q(1) = q_(i+1). If all views have
the same `up`, the camera is turned about its view until `up` points up in the picture, as on a turntable.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from texvol.scene import quaternions
from texvol.scene.camera import Camera, Vector
from texvol.scene.quaternions import Quaternion
from texvol.util.errors import InputError, check_type

DEFAULT_SECONDS = 2.0
LONGEST_SECONDS = 3600.0
# Below, a perspective picture of 1000 pixels differs from the orthographic one by a fifth of a pixel: the eye is
# 2500 heights away.
_FLAT = 2e-4
_ON_TIME = 1e-9  # of a tour's seconds: a time so near to that of a view is meant to be it
_LEVELLED = 0.2  # sine of the angle between view and `up` from which on the picture is wholly levelled


@dataclass(frozen=True)
class SavedView:
    """Camera with a name.

    Parameters
    ----------
    name : str
        One line, not empty.
    camera : Camera
    seconds : float
        Time from this view to the next one of a tour.
    """

    name: str
    camera: Camera
    seconds: float = DEFAULT_SECONDS

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name.strip() or not self.name.isprintable():
            raise InputError(f"saved view: name must be one line of text, got {self.name!r}")
        check_type("saved view: camera", self.camera, Camera)
        number = isinstance(self.seconds, int | float) and not isinstance(self.seconds, bool)
        if not number or not 0 < self.seconds <= LONGEST_SECONDS:
            raise InputError(
                f"saved view: seconds must be a positive number, {LONGEST_SECONDS:g} at most, got {self.seconds!r}"
            )


@dataclass(frozen=True)
class Tour:
    """Saved views in order, and the way in which the camera goes through them.

    Parameters
    ----------
    views : sequence of SavedView
    closed : bool
        True if the path leads from the last view to the first.
    stops : bool
        True if the camera stops at each view, False if it passes through the views between.
    """

    views: tuple[SavedView, ...] = ()
    closed: bool = False
    stops: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "views", tuple(self.views))

    @cached_property
    def times(self) -> list[float]:
        """Time of each view, and at the end that of the path's end, in seconds."""
        steps = self._steps
        return np.concatenate([[0.0], np.cumsum(steps)]).tolist() if steps else [0.0]

    @property
    def seconds(self) -> float:
        """Duration of the path."""
        return self.times[-1]

    @property
    def _steps(self) -> list[float]:
        """Seconds of each step."""
        found = [each.seconds for each in self.views]
        return found if self.closed and len(found) > 1 else found[:-1]

    def pictures(self, rate: float) -> int:
        """Return the number of pictures of a film at `rate` pictures per second."""
        return max(1, round(self.seconds * rate) + (0 if self.closed and len(self.views) > 1 else 1))

    def cameras(self, count: int) -> list[Camera]:
        """Return the cameras of a film of `count` pictures; that of a closed path ends before it begins again.

        Raises
        ------
        InputError
            If there are fewer than two views.
        """
        if len(self.views) < 2:
            raise InputError(f"tour: at least 2 saved views are needed, got {len(self.views)}")
        parts = count if self.closed else max(count - 1, 1)
        return [self.at(self.seconds * number / parts) for number in range(count)]

    def at(self, seconds: float) -> Camera:
        """Return the camera at a time; at the time of a view it is that view's own."""
        times = self.times
        seconds = min(max(seconds, 0.0), self.seconds)
        nearest = int(np.abs(np.subtract(times, seconds)).argmin())
        if abs(times[nearest] - seconds) <= _ON_TIME * self.seconds:
            return self.views[nearest % len(self.views)].camera
        step = bisect_right(times, seconds) - 1
        return self._path.at(step, (seconds - times[step]) / (times[step + 1] - times[step]))

    @cached_property
    def _path(self) -> _Path:
        return _Path([each.camera for each in self.views], self._steps, self.closed, self.stops)


def between(first: Camera, second: Camera) -> Tour:
    """Return the path of one second from one camera to another."""
    return Tour((SavedView("from", first, 1.0), SavedView("to", second)))


class _Path:
    """Quantities of cameras at the views, and their rates of change per second."""

    def __init__(self, cameras: Sequence[Camera], steps: Sequence[float], closed: bool, stops: bool) -> None:
        self._cameras = [*cameras, cameras[0]] if closed else list(cameras)
        self._steps = list(steps)
        numbers = np.array([_numbers(each) for each in self._cameras])
        self._numbers, self._turns = numbers, [_orientation(each) for each in self._cameras]
        self._rates = np.zeros_like(numbers)
        self._spins = [np.zeros(3) for _ in self._cameras]
        if not stops:
            self._pass(closed)
        self._up = _common_up(cameras)

    def _pass(self, closed: bool) -> None:
        """Set the rates at views that the camera passes through."""
        count = len(self._steps)
        slopes = np.diff(self._numbers, axis=0) / np.array(self._steps)[:, np.newaxis]
        spins = [
            quaternions.log(quaternions.product(quaternions.inverse(one), other)) / seconds
            for one, other, seconds in zip(self._turns[:-1], self._turns[1:], self._steps, strict=True)
        ]
        for after in range(0 if closed else 1, count):
            before = (after - 1) % count
            weights = self._steps[after], self._steps[before]
            self._spins[after] = np.average([spins[before], spins[after]], axis=0, weights=weights)
            self._rates[after] = np.average([slopes[before], slopes[after]], axis=0, weights=weights)
            self._rates[after, 3:] = _monotone(slopes[before, 3:], slopes[after, 3:])
        if closed:
            self._rates[-1], self._spins[-1] = self._rates[0], self._spins[0]

    def at(self, step: int, u: float) -> Camera:
        """Return the camera at a fraction of a step."""
        seconds, following = self._steps[step], step + 1
        b2 = u * u * (3 - 2 * u)
        numbers = self._numbers[step] + b2 * (self._numbers[following] - self._numbers[step])
        numbers += seconds * (u * (1 - u) ** 2 * self._rates[step] - u * u * (1 - u) * self._rates[following])
        one, other = (self._spins[each] * (seconds / 3) for each in (step, following))
        turn = quaternions.product(quaternions.inverse(quaternions.exp(one)), quaternions.inverse(self._turns[step]))
        turn = quaternions.product(turn, self._turns[following])
        turn = quaternions.product(turn, quaternions.inverse(quaternions.exp(other)))
        found = quaternions.product(self._turns[step], quaternions.exp((1 - (1 - u) ** 3) * one))
        found = quaternions.product(found, quaternions.exp(b2 * quaternions.log(turn)))
        found = quaternions.product(found, quaternions.exp(u**3 * other))
        axes = quaternions.to_axes(quaternions.unit(found))
        if self._up is not None:
            axes = _level(axes, self._up)
        return _camera(axes, numbers, self._cameras[step])


def _numbers(camera: Camera) -> Vector:
    """Return target, logarithm of the height there, slope, and distance, shape (6)."""
    is_flat = camera.projection == "orthographic"
    distance = camera.target_distance
    height = camera.height if is_flat else 2 * camera.half_height * distance
    return np.array([*camera.target, np.log(height), 0.0 if is_flat else camera.half_height, distance])


def _camera(axes: Vector, numbers: Vector, like: Camera) -> Camera:
    """Return the camera of an orientation and of numbers as `_numbers` returns them."""
    target, (height, slope, distance) = numbers[:3], numbers[3:]
    parts: dict[str, Any] = {"projection": "orthographic", "height": float(np.exp(height))}
    if slope > _FLAT:
        distance = np.exp(height) / (2 * slope)
        parts = {"projection": "perspective", "fov": float(np.degrees(2 * np.arctan(slope)))}
    eye = target + distance * axes[:, 2]
    return replace(like, eye=tuple(eye), target=tuple(target), up=tuple(axes[:, 1]), **parts)


def _orientation(camera: Camera) -> Quaternion:
    return quaternions.from_axes(np.stack([camera.right, camera.upward, -camera.forward], axis=1))


def _common_up(cameras: Sequence[Camera]) -> Vector | None:
    """Return the unit vector that all cameras have as `up`; None if they differ."""
    ups = np.array([np.array(each.up) / np.linalg.norm(each.up) for each in cameras])
    return ups[0] if float(np.abs(ups - ups[0]).max()) < 1e-9 else None


def _level(axes: Vector, up: Vector) -> Vector:
    """Turn a camera's axes about the view until `up` points up in the picture; less so where the view is along `up`."""
    across, above = float(axes[:, 0] @ up), float(axes[:, 1] @ up)
    sine = float(np.hypot(across, above))
    if above <= 0 or sine == 0:
        return axes
    fraction = min(sine / _LEVELLED, 1.0)
    roll = np.arctan2(across, above) * fraction**2 * (3 - 2 * fraction)
    right, upward = axes[:, 0], axes[:, 1]
    turned = [np.cos(roll) * right - np.sin(roll) * upward, np.sin(roll) * right + np.cos(roll) * upward]
    return np.stack([*turned, axes[:, 2]], axis=1)


def _monotone(before: Vector, after: Vector) -> Vector:
    """Return the harmonic mean of two rates, and 0 where they differ in sign."""
    same = before * after > 0
    sums = np.where(same, before + after, 1.0)
    return np.where(same, 2 * before * after / sums, 0.0)
