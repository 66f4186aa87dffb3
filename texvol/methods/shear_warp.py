"""Shear-warp: slices sheared so that all rays run along an axis, composited, and the picture warped into place.

Lacroute and Levoy 1994, section 6.4 and algorithm 6.4 of the survey. The view is factored: rays of any direction go
along the principal axis k, the one along which they cross most slices, once slice k is moved by k times the shear.

1. Prepared: three run-length encodings of the classified volume, one for each principal axis. A scanline is a list of
   runs that show; what lies between two runs is not stored and not looked at.
2. Slices, front to back, are added to an intermediate picture of one pixel per sample. All pixels of a slice lie
   equally between samples, so bilinear weights are constants. Opaque pixels are skipped by links: each pixel knows the
   next one that is not opaque, and paths of links are shortened when they are followed.
3. The intermediate picture is resampled to the pixels by an affine 2-D map, bilinearly.

A slice stands for a slab from half a sample before to half a sample behind it. Its extinction is interpolated, and
exponentiated for the path of the view through the slab: that is the opacity correction, which Lacroute looks up for
each sample before interpolation. At the sides of the box and at the eye the path is the part of it inside.

Cost: samples that show and are not hidden, times four, plus pixels. Three copies of what shows.

Error: one sample of the ray per slice, at distances of up to √3 spacings (oblique views); the value between slices is
not interpolated; the warp blurs by up to a sample, so edges of the box and of opaque matter keep an error that only a
finer grid removes. Order 2 in the spacing of smooth media.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.methods.grid_view import GridView, grid_view
from texvol.methods.method import LEAST_TRANSMITTANCE, Method, Numbers, Size, classified, visible, with_background
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.ray_casting.common.rays import over_rows
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene


class Encoded(NamedTuple):
    """Scanlines of one principal axis; a position i stands for the samples i and i + 1, -1 and n for the edges."""

    first: NDArray[np.int64]  # first run of each scanline, (slices rows + 1)
    runs: NDArray[np.int64]  # first position, one past the last, and place of the first sample in `media`, (runs, 3)
    media: NDArray[np.float32]  # emission and extinction, (samples, 4)


class ShearWarp(Method):
    """Shear-warp for parallel rays.

    Parameters
    ----------
    least_opacity : float
        A sample of less emission and optical depth per smallest spacing is not stored.
    least_transmittance : float
        A pixel that lets no more through is opaque.
    """

    name = "shear-warp"
    source = "Lacroute and Levoy 1994, section 6.4"

    def __init__(
        self, scene: CompleteScene, least_opacity: float = 1e-6, least_transmittance: float = LEAST_TRANSMITTANCE
    ) -> None:
        super().__init__(scene)
        self.least_transmittance = least_transmittance
        samples = classified(scene)
        seen = visible(scene, samples, least_opacity)
        self._encoded = [_encoded(samples, seen, axis) for axis in range(3)]

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view = grid_view(self.volume, camera, size)
        axis = int(np.abs(view.step).argmax())
        intermediate, corner, slice_number = self._composited(view, axis)
        picture = np.empty((size[1], size[0], 4))
        maps = _warp(view, axis, slice_number) - np.array([[0, 0, corner[0]], [0, 0, corner[1]]])
        over_rows(lambda rows: _resample(intermediate, maps, rows.start, picture[rows]), size[1])
        return with_background(picture, self.scene)

    def _composited(self, view: GridView, axis: int) -> tuple[Numbers, NDArray[np.int64], int]:
        """Return the intermediate picture, the index of its first pixel, and the slice in which that index counts."""
        a, b = _in_slice(axis)
        counts = np.array(self.volume.dimensions)
        slices = int(counts[axis])
        forward = 1 if view.step[axis] > 0 else -1
        front = 0 if forward > 0 else slices - 1
        shear = view.step[[a, b]] / view.step[axis]
        # Indices from -1 to n of all slices, seen along the view in the front slice.
        ends = [[at - (k - front) * shear for k in (0, slices - 1)] for at in (np.full(2, -1.0), counts[[a, b]])]
        low, high = np.floor(np.min(ends, axis=(0, 1))), np.ceil(np.max(ends, axis=(0, 1)))
        width, height = (high - low).astype(int) + 1
        picture = np.zeros((height, width, 4))
        links = np.tile(np.arange(width + 1), (height, 1))
        depth = view.depth[[a, b, axis]]
        corners = (view.depth @ (np.array(corner) * counts - 0.5 - view.middle) for corner in product((0, 1), repeat=3))
        numbers = (counts[a], counts[b], slices, front, forward)
        offset = -view.depth @ view.middle - view.near
        place = (*low, *shear, 1 / abs(view.step[axis]), *depth, offset, min(corners) < view.near)

        def composite(rows: slice) -> None:
            _composite(*self._encoded[axis], numbers, place, self.least_transmittance, rows.start, picture[rows], links[rows])

        over_rows(composite, height)
        return picture, low.astype(np.int64), front


def _in_slice(axis: int) -> list[int]:
    """Return the axes along and across the scanlines of slices along `axis`."""
    return [each for each in range(3) if each != axis]


def _warp(view: GridView, axis: int, slice_number: int) -> Numbers:
    """Return the affine map, shape (2, 3), from column, row and 1 to the index at which a ray meets a slice."""
    maps = np.column_stack([view.across, view.down, view.start])
    meeting = -maps[axis] + np.array([0, 0, slice_number])
    return (maps + np.outer(view.step / view.step[axis], meeting))[_in_slice(axis)]


def _encoded(samples: NDArray[np.float32], seen: NDArray[np.bool_], axis: int) -> Encoded:
    """Return the encoding for a principal axis, of media (z, y, x, 4) and which samples show (z, y, x)."""
    along, across = _in_slice(axis)
    order = [2 - each for each in (axis, across, along)]
    shape = tuple(seen.shape[each] for each in order)
    strides = tuple(seen.strides[each] for each in order)  # of one byte each
    flat, shows = samples.reshape(-1, 4), seen.reshape(-1)
    first = np.zeros(shape[0] * shape[1] + 1, np.int64)
    none = Encoded(first, np.empty((0, 3), np.int64), np.empty((0, 4), np.float32))
    runs, voxels = _encode(flat, shows, shape, strides, none, False)
    encoded = Encoded(first, np.empty((runs, 3), np.int64), np.empty((voxels, 4), np.float32))
    _encode(flat, shows, shape, strides, encoded, True)
    return encoded


@compiled_and_cached
def _encode(samples, shows, shape, strides, encoded, fill):  # type: ignore[no-untyped-def]
    """Count runs and stored samples, and fill the encoding if asked to."""
    runs = voxels = 0
    last = shape[2] - 1
    for line in range(shape[0] * shape[1]):
        encoded.first[line] = runs
        start = line // shape[1] * strides[0] + line % shape[1] * strides[1]
        inside = False
        for i in range(-1, last + 2):  # position last + 1 ends the last run
            place = start + max(i, 0) * strides[2]
            showing = i <= last and (shows[place] or shows[start + min(i + 1, last) * strides[2]])
            if showing and not inside:
                if fill:
                    encoded.runs[runs, 0], encoded.runs[runs, 2] = i, voxels
                runs += 1
            if inside and not showing and fill:
                encoded.runs[runs - 1, 1] = i
            if showing or inside:  # the sample after the last position belongs to the run
                if fill:
                    encoded.media[voxels] = samples[start + min(max(i, 0), last) * strides[2]]
                voxels += 1
            inside = showing
    encoded.first[-1] = runs
    return runs, voxels


@compiled
def _part(x, slope, count, low, high):  # type: ignore[no-untyped-def]
    """Part of a path from `low` to `high` on which x + slope t is from -1/2 to count - 1/2."""
    if slope == 0:
        return low, high if -0.5 <= x < count - 0.5 else low
    ends = (-0.5 - x) / slope, (count - 0.5 - x) / slope
    return max(low, min(ends)), min(high, max(ends))


@compiled
def _open(links, u):  # type: ignore[no-untyped-def]
    """Next pixel from u on that is not opaque; the links on the way are shortened."""
    while links[u] != u:
        links[u] = links[links[u]]
        u = links[u]
    return u


@compiled
def _add(pixel, q0, q1, q2, tau, path):  # type: ignore[no-untyped-def]
    """Composite a path through a constant medium behind a pixel; return what is still let through."""
    opacity = -np.expm1(-tau * path)
    left = 1 - pixel[3]
    weight = left * (opacity / tau if tau > 0 else path)
    pixel[0] += weight * q0
    pixel[1] += weight * q1
    pixel[2] += weight * q2
    pixel[3] += left * opacity
    return 1 - pixel[3]


@compiled_and_cached
def _composite(first, runs, media, numbers, place, least, row, picture, links):  # type: ignore[no-untyped-def]
    """Add all slices, front to back, to rows of the intermediate picture from `row` on."""
    na, nb, slices, front, forward = numbers
    low_a, low_b, shear_a, shear_b, path, depth_a, depth_b, depth_k, offset, cut = place
    for n in range(slices):
        k = front + n * forward
        x0, y0 = low_a + (k - front) * shear_a, low_b + (k - front) * shear_b
        shift, fx = int(np.floor(x0)), x0 - np.floor(x0)
        for v in range(picture.shape[0]):
            y = y0 + row + v
            j = int(np.floor(y))
            if j < -1 or j >= nb:
                continue
            fy = y - j
            near_end, far_end = _part(y, shear_b * forward, nb, -0.5, 0.5)
            lines = k * nb + max(j, 0), k * nb + min(j + 1, nb - 1)
            r, r_end, s, s_end = first[lines[0]], first[lines[0] + 1], first[lines[1]], first[lines[1] + 1]
            u = 0
            while True:
                i = u + shift
                while r < r_end and runs[r, 1] <= i:
                    r += 1
                while s < s_end and runs[s, 1] <= i:
                    s += 1
                if r == r_end and s == s_end:
                    break
                begin = min(runs[r, 0] if r < r_end else na, runs[s, 0] if s < s_end else na)
                to = _open(links[v], max(begin - shift, u))
                if to > u:  # skip what is transparent or hidden
                    u = to
                    if u == picture.shape[1]:
                        break
                    continue
                q0 = q1 = q2 = tau = 0.0
                for line in range(2):
                    run, run_end, weight = (r, r_end, 1 - fy) if line == 0 else (s, s_end, fy)
                    if run < run_end and runs[run, 0] <= i:
                        p = runs[run, 2] + i - runs[run, 0]
                        left, right = weight * (1 - fx), weight * fx
                        q0 += left * media[p, 0] + right * media[p + 1, 0]
                        q1 += left * media[p, 1] + right * media[p + 1, 1]
                        q2 += left * media[p, 2] + right * media[p + 1, 2]
                        tau += left * media[p, 3] + right * media[p + 1, 3]
                low, high = _part(i + fx, shear_a * forward, na, near_end, far_end)
                if cut:  # the eye is inside the box
                    at = depth_a * (i + fx) + depth_b * y + depth_k * k + offset
                    low = max(low, -at / path)
                if high > low and _add(picture[v, u], q0, q1, q2, tau, (high - low) * path) <= least:
                    links[v, u] = u + 1
                u += 1


@compiled_and_cached
def _resample(intermediate, maps, row, picture):  # type: ignore[no-untyped-def]
    """Fill rows of the picture from `row` on with the intermediate picture at affine positions, bilinearly."""
    rows, columns = intermediate.shape[:2]
    for v in range(picture.shape[0]):
        for u in range(picture.shape[1]):
            x = maps[0, 0] * u + maps[0, 1] * (v + row) + maps[0, 2]
            y = maps[1, 0] * u + maps[1, 1] * (v + row) + maps[1, 2]
            i, j = int(np.floor(x)), int(np.floor(y))
            picture[v, u] = 0.0
            for corner in range(4):
                a, b = i + corner % 2, j + corner // 2
                if 0 <= a < columns and 0 <= b < rows:
                    weight = (1 - abs(x - a)) * (1 - abs(y - b))
                    picture[v, u] += weight * intermediate[b, a]
