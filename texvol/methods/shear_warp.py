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
not interpolated; the warp blurs by up to a sample. Order 2 in the spacing of smooth media. Where a medium reaches the
sides of the box, and at edges of opaque matter, the blur is of order 1, and only a finer grid removes it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.methods.affine_warp import resample
from texvol.methods.grid_view import GridView, grid_view
from texvol.methods.method import LEAST_TRANSMITTANCE, Method, Numbers, Size, classified, visible, with_background
from texvol.methods.run_lengths import encoded, in_slice
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.ray_casting.common.rays import over_rows
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene


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
        self._encoded = [encoded(samples, seen, axis) for axis in range(3)]

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, see `Method.picture`."""
        view = grid_view(self.volume, camera, size)
        axis = int(np.abs(view.step).argmax())
        intermediate, corner, slice_number = self._composited(view, axis)
        picture = np.empty((size[1], size[0], 4))
        maps = _warp(view, axis, slice_number) - np.array([[0, 0, corner[0]], [0, 0, corner[1]]])
        over_rows(lambda rows: resample(intermediate, maps, rows.start, picture[rows]), picture.shape)
        return with_background(picture, self.scene)

    def _composited(self, view: GridView, axis: int) -> tuple[Numbers, NDArray[np.int64], int]:
        """Return the intermediate picture, the index of its first pixel, and the slice in which that index counts."""
        a, b = in_slice(axis)
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
        numbers = (counts[a], counts[b], slices, front, forward)
        offset = -view.depth @ view.middle - view.near
        place = (*low, *shear, 1 / abs(view.step[axis]), *depth, offset)

        def composite(rows: slice) -> None:
            part = picture[rows], links[rows]
            _composite(self._encoded[axis], numbers, place, self.least_transmittance, rows.start, *part)

        over_rows(composite, picture.shape)
        return picture, low.astype(np.int64), front


def _warp(view: GridView, axis: int, slice_number: int) -> Numbers:
    """Return the affine map, shape (2, 3), from column, row and 1 to the index at which a ray meets a slice."""
    maps = np.column_stack([view.across, view.down, view.start])
    meeting = -maps[axis] + np.array([0, 0, slice_number])
    return (maps + np.outer(view.step / view.step[axis], meeting))[in_slice(axis)]


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
def _add(picture, v, u, medium, path):  # type: ignore[no-untyped-def]
    """Composite a path through a constant medium behind a pixel; return what is still let through."""
    opacity = -np.expm1(-medium[3] * path)
    left = 1 - picture[v, u, 3]
    weight = left * (opacity / medium[3] if medium[3] > 0 else path)
    for channel in range(3):
        picture[v, u, channel] += weight * medium[channel]
    picture[v, u, 3] += left * opacity
    return 1 - picture[v, u, 3]


@compiled
def _gather(media, runs, run, run_end, i, left, right):  # type: ignore[no-untyped-def]
    """Weighted sum of the media of a position, if the run holds it, else 0."""
    if run == run_end or runs[run, 0] > i:
        return 0.0, 0.0, 0.0, 0.0
    p = runs[run, 2] + i - runs[run, 0]
    return (
        left * media[p, 0] + right * media[p + 1, 0],
        left * media[p, 1] + right * media[p + 1, 1],
        left * media[p, 2] + right * media[p + 1, 2],
        left * media[p, 3] + right * media[p + 1, 3],
    )


@compiled
def _scanline(encoded, lines, start, fy, slope, ends, eye, path, least, picture, v, links):  # type: ignore[no-untyped-def]
    """Add two scanlines of a slice to one of the picture, whose pixel u has the position `start` + u."""
    first, runs, media = encoded
    shift, fx, count = start
    r, r_end, s, s_end = first[lines[0]], first[lines[0] + 1], first[lines[1]], first[lines[1] + 1]
    u = 0
    while u < picture.shape[1]:
        i = u + shift
        while r < r_end and runs[r, 1] <= i:
            r += 1
        while s < s_end and runs[s, 1] <= i:
            s += 1
        if r == r_end and s == s_end:
            return
        begin = min(runs[r, 0] if r < r_end else count, runs[s, 0] if s < s_end else count)
        to = _open(links, max(begin - shift, u))
        if to > u:  # skip what is transparent or hidden
            u = to
            continue
        a = _gather(media, runs, r, r_end, i, (1 - fy) * (1 - fx), (1 - fy) * fx)
        b = _gather(media, runs, s, s_end, i, fy * (1 - fx), fy * fx)
        medium = a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]
        low, high = _part(i + fx, slope, count, ends[0], ends[1])
        low = max(low, -(eye[0] + eye[1] * (i + fx)) / path)
        if high > low and _add(picture, v, u, medium, (high - low) * path) <= least:
            links[u] = u + 1
        u += 1


@compiled_and_cached
def _composite(encoded, numbers, place, least, row, picture, links):  # type: ignore[no-untyped-def]
    """Add all slices, front to back, to rows of the intermediate picture from `row` on."""
    na, nb, slices, front, forward = numbers
    low_a, low_b, shear_a, shear_b, path, depth_a, depth_b, depth_k, offset = place
    for n in range(slices):
        k = front + n * forward
        x0, y0 = low_a + (k - front) * shear_a, low_b + (k - front) * shear_b
        start = int(np.floor(x0)), x0 - np.floor(x0), na
        for v in range(picture.shape[0]):
            y = y0 + row + v
            j = int(np.floor(y))
            if j < -1 or j >= nb:
                continue
            lines = k * nb + max(j, 0), k * nb + min(j + 1, nb - 1)
            ends = _part(y, shear_b * forward, nb, -0.5, 0.5)
            eye = depth_b * y + depth_k * k + offset, depth_a
            slope = shear_a * forward
            _scanline(encoded, lines, start, y - j, slope, ends, eye, path, least, picture, v, links[v])
