"""Projection in the frequency domain (section 6.5.1; Dunne, Napel, Rutt 1990; Malzbender 1993): X-ray pictures only.

Once, the 3-D transform of the volume; for each view, the slice through its origin, and the inverse 2-D transform of
that: see `spectrum`. What lies in front is not told from what lies behind, and rays must be parallel.

Cost: n³ log n once; n² log n for each view, to which the interpolation of n² frequencies adds a large factor; a complex
number for each sample, of 8 bytes, times padding³.

The error comes from the interpolation of the spectrum. A factor for it in space is what linear interpolation does: it
darkens towards the borders of the period, by up to (sin πx / πx)² = 0.41 at x = 1/2, and leaves ghosts, replicas of the
volume that wrap around. Padding with zeros keeps to the middle of a larger period; cubic interpolation has a flatter
factor; `premultiplied` divides the samples by the factor beforehand (Malzbender), which leaves the ghosts. A box that
is cut off at high values has edges that no band holds: they ring with reconstruction "ideal".
"""

from __future__ import annotations

from texvol.methods.method import Method, Numbers, Size
from texvol.methods.spectrum import ORDERS, RECONSTRUCTIONS, Spectrum, check_eye, plane_of
from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene
from texvol.util.errors import InputError


class Fourier(Method):
    """Integral of the value along parallel rays, by slices of the volume's spectrum.

    Parameters
    ----------
    interpolation : "linear" or "cubic"
        Of the spectrum.
    padding : 1 or 2
        Size of the period, in sizes of the volume.
    reconstruction : "linear" or "ideal"
        What stands between the samples in space: trilinear interpolation, or the band-limited function.
    premultiplied : bool
        True to divide the samples by what linear interpolation of the spectrum will multiply them by.
    """

    name = "fourier"
    source = "Dunne et al. 1990, Malzbender 1993, section 6.5.1"
    order = "projection"
    defaults = ("linear", 1)  # interpolation and padding

    def __init__(
        self,
        scene: CompleteScene,
        *,
        interpolation: str | None = None,
        padding: int | None = None,
        reconstruction: str = "linear",
        premultiplied: bool = False,
    ) -> None:
        super().__init__(scene)
        interpolation = self.defaults[0] if interpolation is None else interpolation
        self.padding = self.defaults[1] if padding is None else padding
        if interpolation not in ORDERS:
            raise InputError(f"interpolation must be one of {', '.join(ORDERS)}, got {interpolation!r}")
        if self.padding not in (1, 2):
            raise InputError(f"padding must be 1 or 2, got {self.padding!r}")
        if reconstruction not in RECONSTRUCTIONS:
            raise InputError(f"reconstruction must be one of {', '.join(RECONSTRUCTIONS)}, got {reconstruction!r}")
        self.reconstruction = reconstruction
        if premultiplied and interpolation != "linear":
            raise InputError(f"premultiplied needs interpolation linear, got {interpolation}")
        self.spectrum = Spectrum(self.volume.values, self.padding, ORDERS[interpolation], premultiplied)

    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the integral along each ray, shape (height, width); 0 beside the box."""
        check_eye(self.name, self.volume, camera)
        plane = plane_of(camera, size, self.volume.centre)
        return self.spectrum.projection(self.volume.world_from_index, plane, self.reconstruction, self.padding)

    @property
    def memory(self) -> int:
        """Bytes of the spectrum."""
        return self.spectrum.values.nbytes


class FourierPadded(Fourier):
    """The same in a period of twice the volume's size."""

    name = "fourier-padded"
    defaults = ("linear", 2)


class FourierCubic(Fourier):
    """The same in a period of twice the volume's size, with cubic interpolation."""

    name = "fourier-cubic"
    defaults = ("cubic", 2)
