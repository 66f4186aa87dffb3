"""Spectrum of samples, and their projections by slices through it: the Fourier projection-slice theorem.

    p(u, v) = ∫ f ds   ⇔   P(k_u, k_v) = F(k_u right + k_v up)

The spectrum of a projection is the slice of the 3-D spectrum through its origin, parallel to the picture (section
6.5.1; Dunne 1990, Malzbender 1993). F is known at the frequencies of the discrete transform and interpolated between
them. Its period is that of the samples; what takes the place of the samples in space is the reconstruction, a factor H
of F:

    H = 1 up to half a period and 0 beyond: band-limited; or
    H = Π_axes (sin πν / πν)², ν in periods: trilinear interpolation, whose replicas fade with ν²

The picture's pixels need not be the samples of the slice's inverse transform: the chirp z-transform (Bluestein 1968)
evaluates that anywhere on an equidistant grid at the cost of a fast transform.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, missing_extra

Numbers = NDArray[np.float64]
_BAND = {"ideal": 0.5, "linear": 1.0}  # periods on either side of 0; the trilinear rest beyond is 5 % at most
RECONSTRUCTIONS = tuple(_BAND)
ORDERS = {"linear": 1, "cubic": 3}  # of interpolations


class Pixels(NamedTuple):
    """Equidistant positions along one side of a picture, relative to the middle of the samples: world units."""

    first: float
    pitch: float
    number: int


class Plane(NamedTuple):
    """Orientation of a picture: rows of `frame` are right and up, in world units."""

    frame: Numbers  # (2, 3)
    columns: Pixels
    rows: Pixels  # from the top: the pitch is negative

    def window(self, reach: Numbers) -> tuple[Plane, tuple[slice, slice]]:
        """Return the part within `reach` (along right, up) of the middle, and its rows and columns in the picture."""
        across, above = (_within(*each) for each in zip((self.columns, self.rows), reach, strict=True))
        return Plane(self.frame, across[0], above[0]), (above[1], across[1])


def _within(pixels: Pixels, reach: float) -> tuple[Pixels, slice]:
    """Return the pixels at -`reach` to `reach`, and their place among all."""
    ends = (np.array([-reach, reach]) - pixels.first) / pixels.pitch
    low, high = np.clip([np.ceil(ends.min()), np.floor(ends.max()) + 1], 0, pixels.number).astype(int)
    return Pixels(pixels.first + low * pixels.pitch, pixels.pitch, max(high - low, 0)), slice(low, max(high, low))


def plane_of(camera: Camera, size: tuple[int, int], middle: ArrayLike) -> Plane:
    """Return the plane of an orthographic picture of `size` (width, height), about the world position `middle`."""
    rays = camera.pixel_rays(size, np.asarray(middle, np.float64))
    frame = np.stack([camera.right, camera.upward])
    u, v = frame @ rays.point
    pitch = 2 * camera.half_height / size[1]
    width, height = size
    columns = Pixels(u - (width - 1) / 2 * pitch, pitch, width)
    return Plane(frame, columns, Pixels(v + (height - 1) / 2 * pitch, -pitch, height))


def check_eye(name: str, volume: Volume, camera: Camera) -> None:
    """Raise InputError if part of the box lies behind the eye: a projection cannot leave it out."""
    depth = camera.in_eye_space(volume.corners_from_centre, volume.centre)[:, 2]
    if depth.min() < 0:
        raise InputError(f"{name}: eye must be outside the box and look at all of it; equal-steps draws the others")


class Spectrum:
    """Fourier transform of samples (z, y, x), possibly padded with zeros, and its slices.

    Parameters
    ----------
    samples : array of shape (z, y, x)
    padding : int
        The period in space, in sizes of the volume: finer samples of the spectrum are easier to interpolate.
    order : 1 or 3
        Of the interpolation: linear, or cubic by B-splines.
    premultiplied : bool
        True to divide the samples by what linear interpolation of the spectrum multiplies them by.
    """

    def __init__(self, samples: NDArray, padding: int, order: int, premultiplied: bool) -> None:
        try:
            from scipy import fft, ndimage
        except ImportError as error:
            raise missing_extra("scipy", "methods", "Fourier projection") from error
        self.order = order
        self.shape = np.array(samples.shape)
        self.period = np.array([fft.next_fast_len(padding * count) for count in samples.shape])
        padded = np.zeros(self.period, np.float32)
        # With the middle at 0 the phase turns slowest, and less is lost between two frequencies.
        middle = self.shape // 2
        factor = _darkening(self.shape, middle, self.period) if premultiplied else 1.0
        padded[tuple(map(slice, samples.shape))] = samples / factor
        spectrum = fft.fftn(np.roll(padded, -middle, axis=(0, 1, 2)), workers=-1)
        self.values = spectrum.astype(np.complex64)
        if order > 1:
            self.values = ndimage.spline_filter(self.values, order, np.complex64, mode="grid-wrap")
        self._beside = middle - (self.shape - 1) / 2  # from the middle of the samples to what stands at 0

    def at(self, frequency: Numbers, reconstruction: str) -> NDArray[np.complex128]:
        """Return the spectrum of the field at frequencies (…, 3) in z, y, x: periods per sample."""
        from scipy import ndimage

        band = _BAND[reconstruction]
        inside = (np.abs(frequency) <= band).all(axis=-1)
        ours = frequency[inside]
        found = ndimage.map_coordinates(
            self.values, (ours * self.period).T, order=self.order, mode="grid-wrap", prefilter=False
        )
        found = found * np.exp(-2j * np.pi * (ours @ self._beside))
        if reconstruction == "linear":
            found *= np.square(np.sinc(ours)).prod(axis=-1)
        spectrum = np.zeros(frequency.shape[:-1], np.complex128)
        spectrum[inside] = found
        return spectrum

    def projection(self, world_from_index: Numbers, plane: Plane, reconstruction: str, padding: int) -> Numbers:
        """Return ∫ f ds in a picture, shape (rows, columns); 0 beyond the period of the slice.

        Parameters
        ----------
        world_from_index : array of shape (3, 3)
            What an index step along x, y and z is in the world.
        padding : int
            Period of the picture, in sizes of the box's projection.
        """
        edges = world_from_index * self.shape[::-1]
        # A frequency of the world, (right, up) → x, y, z in periods per sample.
        to_samples = plane.frame @ world_from_index
        reach = np.abs(plane.frame @ edges).sum(axis=1)  # of the box, along right and up
        apart = 1 / (padding * reach)
        most = _BAND[reconstruction] * np.abs(plane.frame @ np.linalg.inv(world_from_index).T).sum(axis=1)
        half = np.floor(most / apart).astype(int)
        across, above = (np.arange(-h, h + 1) * step for h, step in zip(half, apart, strict=True))
        k = above[:, np.newaxis, np.newaxis] * to_samples[1] + across[:, np.newaxis] * to_samples[0]
        piece = self.at(k[..., ::-1], reconstruction) * (abs(np.linalg.det(world_from_index)) * apart.prod())
        piece = _inverse(piece, half[1], apart[1], plane.rows, axis=0)
        return _inverse(piece, half[0], apart[0], plane.columns, axis=1).real


def _darkening(shape: NDArray, middle: NDArray, period: NDArray) -> Numbers:
    """Return what linear interpolation between the frequencies multiplies samples (z, y, x) by."""
    position = [np.arange(count) - at for count, at in zip(shape, middle, strict=True)]
    factors = [np.square(np.sinc(each / whole)) for each, whole in zip(position, period, strict=True)]
    return np.multiply.outer(np.multiply.outer(factors[0], factors[1]), factors[2])


def _inverse(spectrum: NDArray, half: int, apart: float, pixels: Pixels, axis: int) -> NDArray[np.complex128]:
    """Return Σ_n spectrum_n e^(2πi n `apart` x) at pixels along an axis, n from -half; 0 beyond the period."""
    from scipy.signal import CZT

    turn = 2j * np.pi * apart
    transform = CZT(2 * half + 1, pixels.number, w=np.exp(turn * pixels.pitch), a=np.exp(-turn * pixels.first))
    position = pixels.first + pixels.pitch * np.arange(pixels.number)
    factor = np.where(np.abs(position) * apart <= 0.5, np.exp(-turn * half * position), 0)
    return transform(spectrum, axis=axis) * (factor[:, np.newaxis] if axis == 0 else factor)
