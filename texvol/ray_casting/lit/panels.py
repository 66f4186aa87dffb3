"""Transmittance of the lights along rays: exact at the nodes of panels, between which it is a parabola.

A ray is cut into panels no longer than a sample's spacing. The transmittance T is found at both ends and in the middle
of a panel, and once more in the middles of its halves. If the parabola through the first three is off by e there, the
parabolas of the halves are off by about e / 8 where T is smooth, and e / 4 at a kink. With w the fraction of the ray's
light that comes from a half, which is at most 1, a half is accepted if

    e <= TOLERANCE    or    w e <= TOLERANCE / panels of the ray

and else is a panel itself. So the error of a pixel is a few times TOLERANCE at most, by estimate. Panels that nothing
is seen of are not looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.ray_casting.common.rays import Numbers

TOLERANCE = 1e-6
_MOST_HALVINGS = 40  # of a panel: at a jump of T it is shorter than any digit of it shows
_NODES = 3
_BEHIND = 700.0  # optical depth behind which nothing is seen in float64
# From numbers of rays and (first, last) s on them to light and, in the last channel, optical depth, shape (n, 4).
View = Callable[[NDArray[np.int64], Numbers], Numbers]
# From numbers of rays and s on them to the transmittance of each light, shape (n, columns).
Transmittance = Callable[[NDArray[np.int64], Numbers], Numbers]


class Panels(NamedTuple):
    """Panels of rays, one after the other: first and last s, and the transmittances at three nodes, by columns."""

    rows: Numbers  # shape (panels, 2 + 3 columns)
    first: NDArray[np.intp]  # number of the first panel of each ray
    end: NDArray[np.intp]  # number after the last one


class _Some(NamedTuple):
    """Some panels."""

    ray: NDArray[np.int64]
    ends: Numbers  # (n, 2)
    values: Numbers  # (n, 3, columns)
    before: Numbers  # optical depth in front of the panel

    def chosen(self, which: NDArray[np.bool_]) -> _Some:
        return _Some(self.ray[which], self.ends[which], self.values[which], self.before[which])


def panels_along(spans: Numbers, longest: float, most_light: float, view: View, transmittance: Transmittance) -> Panels:
    """Return the panels of rays.

    Parameters
    ----------
    spans : array of shape (n, 2)
        First and last s on each ray.
    longest : float
        Length of a panel, world units.
    most_light : float
        Upper bound of the factors by which lights change emission.
    """
    ray, ends, count = _cut(spans, longest)
    glows = view(ray, ends)
    before = _before(ray, glows[:, 3], count)
    # Where there is but one panel it may be as thin as a cap, whose colour is relative to its opacity.
    shows = (_weight(glows, before, most_light) > TOLERANCE / count[ray]) | (count[ray] == 1)
    at = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)
    known = transmittance(np.repeat(ray[shows], _NODES), at[shows].reshape(-1))
    values = np.ones((len(ray), _NODES, known.shape[1]))
    values[shows] = known.reshape(-1, _NODES, known.shape[1])
    panels = _Some(ray, ends, values, before)
    done, left = [panels.chosen(~shows)], panels.chosen(shows)
    for _ in range(_MOST_HALVINGS):
        if not left.ray.size:
            break
        halves, off = _halves(left, transmittance)
        glows = view(halves.ray, halves.ends)
        depth = np.minimum(glows[:, 3].reshape(-1, 2), _BEHIND)
        halves.before.reshape(-1, 2)[:, 1] += depth[:, 0]
        weight = _weight(glows, halves.before, most_light)
        accepted = (off <= TOLERANCE) | (weight * off <= TOLERANCE / count[halves.ray])
        done.append(halves.chosen(accepted))
        left = halves.chosen(~accepted)
    return _sorted(_Some(*(np.concatenate(each) for each in zip(*done, left, strict=True))), len(spans))


def _cut(spans: Numbers, longest: float) -> tuple[NDArray[np.int64], Numbers, NDArray[np.int64]]:
    """Return the panels of rays, by ray and along each: the ray, and first and last s; and their number on each ray."""
    lengths = spans[:, 1] - spans[:, 0]
    count = np.where(lengths > 0, np.ceil(np.where(lengths > 0, lengths, 0.0) / longest), 0).astype(np.int64)
    ray = np.repeat(np.arange(len(spans)), count)
    place = np.arange(len(ray)) - np.repeat(np.cumsum(count) - count, count)
    step = lengths[ray] / count[ray]
    first = spans[ray, 0] + place * step
    last = np.where(place + 1 == count[ray], spans[ray, 1], first + step)
    return ray, np.stack([first, last], axis=1), count


def _before(ray: NDArray[np.int64], depth: Numbers, count: NDArray[np.int64]) -> Numbers:
    """Return the optical depth in front of each panel, of panels that lie by ray and along each."""
    place = np.arange(len(ray)) - (np.cumsum(count) - count)[ray]
    # A sum over all panels would be rounded otherwise among other rays.
    of_rays = np.zeros((len(count), int(count.max(initial=0))))
    of_rays[ray, place] = np.minimum(depth, _BEHIND)
    return np.asarray((np.cumsum(of_rays, axis=1) - of_rays)[ray, place])


def _weight(glows: Numbers, before: Numbers, most_light: float) -> Numbers:
    """Return at most what panels add to a pixel, per transmittance."""
    most = np.maximum(glows[:, :3].max(axis=1, initial=0.0), -np.expm1(-glows[:, 3]))
    return np.asarray(most_light * most * np.exp(-before))


def _halves(panels: _Some, transmittance: Transmittance) -> tuple[_Some, Numbers]:
    """Return the halves of panels, and how far the parabolas of the panels are off in their middles."""
    a, b = panels.ends.T
    at = np.stack([0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b], axis=1)
    low, middle, high = (panels.values[:, node] for node in range(_NODES))
    found = transmittance(np.repeat(panels.ray, 2), at.reshape(-1)).reshape(len(a), 2, low.shape[1])
    expected = np.stack([3 * low + 6 * middle - high, 3 * high + 6 * middle - low], axis=1) / 8
    off = np.abs(found - expected).max(axis=2).reshape(-1)
    cut = panels.ends.mean(axis=1)
    ends = np.stack([np.stack([a, cut], axis=1), np.stack([cut, b], axis=1)], axis=1).reshape(-1, 2)
    first, second = np.stack([low, found[:, 0], middle], axis=1), np.stack([middle, found[:, 1], high], axis=1)
    values = np.stack([first, second], axis=1).reshape(len(off), *first.shape[1:])
    return _Some(np.repeat(panels.ray, 2), ends, values, np.repeat(panels.before, 2)), off


def _sorted(panels: _Some, rays: int) -> Panels:
    """Return the panels by ray and along each."""
    order = np.lexsort((panels.ends[:, 0], panels.ray))
    rows = np.concatenate(
        [panels.ends, panels.values.reshape(len(panels.ray), _NODES * panels.values.shape[2])], axis=1
    )[order]
    first, end = (np.searchsorted(panels.ray[order], np.arange(rays), side) for side in ("left", "right"))
    return Panels(np.ascontiguousarray(rows), first, end)
