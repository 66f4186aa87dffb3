"""Projection of blocks in the frequency domain, then composited (section 6.5.1; Chiueh, He, Kaufman, Pfister 1994).

The volume is divided into blocks of M³ samples. Once, the emission and the extinction of each block are transformed;
for each view every block is projected by a slice through its spectrum (see `spectrum`), Q = ∫ q ds and D = ∫ τ ds,
and the blocks are composited front to back. Within a block a pixel is shown as if both were spread evenly over the ray:

    C = Q (1 - e^-D) / D,    A = 1 - e^-D

Cost: n³ log M / M for each view; memory: four complex numbers for each sample, times padding³, which Chiueh et al.
compress by dropping small ones. Blocks without any medium are not kept.

The blocks' trilinear parts add up to the whole, so the opacity is right but for the interpolation of the spectrum; its
ghosts are about a percent of a block's optical depth, and are seen beside an opaque medium. The colour has a further
error, of the order within a block: what is in front hides nothing of the same block. It falls with M, for which the
time grows.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
from numpy.typing import NDArray

from texvol.methods.method import Method, Numbers, Size, classified, with_background
from texvol.methods.rays import cyrus_beck
from texvol.methods.spectrum import ORDERS, Plane, Spectrum, check_eye, plane_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene
from texvol.util.errors import InputError

_PADDING = 2  # with less, a block's ghosts are seen at its borders
_MOST_BYTES = 8 * 2**30
_BYTES_PER_SAMPLE = 4 * 8 * _PADDING**3


class FourierBlocks(Method):
    """Blocks of emission and extinction, projected by Fourier slices and composited.

    Parameters
    ----------
    block : int
        Samples along an edge of a block, M.
    interpolation : "linear" or "cubic"
        Of the spectra. Linear takes half of the time and leaves ghosts, since blocks are filled to their edges.
    """

    name = "fourier-blocks"
    source = "Chiueh et al. 1994, section 6.5.1"

    def __init__(self, scene: CompleteScene, *, block: int = 16, interpolation: str = "cubic") -> None:
        super().__init__(scene)
        if not 2 <= block <= 256:
            raise InputError(f"block must be from 2 to 256 samples, got {block!r}")
        if interpolation not in ORDERS:
            raise InputError(f"interpolation must be one of {', '.join(ORDERS)}, got {interpolation!r}")
        self.block, self.interpolation = block, ORDERS[interpolation]
        samples = classified(scene)
        places = list(product(*(range(0, count, block) for count in samples.shape[:3])))
        filled = [each for each in places if self._part(samples, each).any()]
        needed = len(filled) * block**3 * _BYTES_PER_SAMPLE
        if needed > _MOST_BYTES:
            raise InputError(
                f"{self.name}: volume must need at most {_MOST_BYTES / 2**30:g} GiB of spectra, got "
                f"{needed / 2**30:.1f} GiB; equal-steps draws it"
            )
        # z, y, x of the first sample of each block that holds anything: spectra of its four channels
        self.spectra = {each: self._transformed(self._part(samples, each)) for each in filled}

    def _part(self, samples: NDArray, first: tuple[int, ...]) -> NDArray:
        return samples[tuple(slice(each, each + self.block) for each in first)]

    def _transformed(self, part: NDArray) -> list[Spectrum]:
        linear = self.interpolation == ORDERS["linear"]
        return [Spectrum(part[..., channel], _PADDING, self.interpolation, linear) for channel in range(4)]

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4)."""
        check_eye(self.name, self.volume, camera)
        picture = np.zeros((size[1], size[0], 4))
        # Parallel rays go through a grid of blocks along the axes' own order, whichever axis comes first.
        ahead = (self.volume.index_from_world @ camera.forward)[::-1] >= 0
        places = sorted(self.spectra, key=lambda first: [n if up else -n for n, up in zip(first, ahead, strict=True)])
        threads = ThreadPoolExecutor()
        try:
            for there, projected in threads.map(lambda first: self._projected(first, camera, size), places):
                _add(picture[there], projected)
        finally:
            threads.shutdown(cancel_futures=True)
        return with_background(picture, self.scene)

    def _projected(self, first: tuple[int, ...], camera: Camera, size: Size) -> tuple[tuple[slice, slice], Numbers]:
        """Return rows and columns that a block may reach, and ∫ q ds and ∫ τ ds there; rounding below 0 is left out."""
        shape = self.spectra[first][3].shape
        to_world = self.volume.world_from_index
        middle = self.volume.origin + to_world @ (np.array(first) + (shape - 1) / 2)[::-1]
        plane = plane_of(camera, size, middle)
        # Trilinear weights reach a whole spacing beyond the outer samples.
        reach = np.abs(plane.frame @ (to_world * (shape[::-1] + 1))).sum(axis=1) / 2
        window, there = plane.window(reach)
        if not (window.columns.number and window.rows.number):
            return there, np.zeros((window.rows.number, window.columns.number, 4))
        channels = [each.projection(to_world, window, "linear", _PADDING) for each in self.spectra[first]]
        # Beside the block there are only ghosts, and an opaque medium's would be seen.
        crossed = _crossed(window, camera.forward, np.linalg.inv(to_world), shape[::-1] + 1.0)
        return there, np.maximum(np.stack(channels, axis=-1), 0.0) * crossed[..., np.newaxis]

    @property
    def memory(self) -> int:
        """Bytes of the spectra."""
        return sum(each.values.nbytes for channels in self.spectra.values() for each in channels)


def _crossed(window: Plane, forward: Numbers, to_index: NDArray, edges: Numbers) -> NDArray[np.bool_]:
    """Return True for the pixels whose rays cross a box of so many `edges` (x, y, z) of samples, about the middle."""
    u, v = (each.first + each.pitch * np.arange(each.number) for each in (window.columns, window.rows))
    point = v[:, np.newaxis, np.newaxis] * window.frame[1] + u[:, np.newaxis] * window.frame[0]
    start, step = point @ to_index.T + edges / 2, np.broadcast_to(to_index @ forward, point.shape)
    near, far = cyrus_beck(start, step, edges)
    return far > near


def _add(picture: Numbers, projected: Numbers) -> None:
    """Add a block's projections behind a picture."""
    depth = projected[..., 3]
    opacity = -np.expm1(-depth)
    spread = np.divide(opacity, depth, out=np.ones_like(depth), where=depth > 1e-12)
    color = projected[..., :3] * spread[..., np.newaxis]
    picture += (1 - picture[..., 3:]) * np.concatenate([color, opacity[..., np.newaxis]], axis=-1)
