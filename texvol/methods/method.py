"""Interface of all methods: a name, a source, the scenes that they draw, and two steps, prepare and draw.

A method is a class. Its constructor does what does not depend on the view (classification, encoding, transforms);
`picture` draws one view of it. Each states, in the docstring of its module: the author, year and section of the survey,
the cost, and where its error comes from.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.errors import InputError, is_number

Numbers = NDArray[np.float64]
Size = tuple[int, int]
# A ray that lets no more through ends; the picture lacks up to this fraction of the light behind.
LEAST_TRANSMITTANCE = 1 / 1024
# The medium that a method's pictures go to: classified at the samples, then interpolated; or interpolated first.
Order = Literal["before", "after", "projection"]


class Method(ABC):
    """One method of the survey for one volume in one transfer function.

    Attributes
    ----------
    name : str
        As on the command line: "shear-warp".
    source : str
        Authors, year and section of the survey: "Lacroute and Levoy 1994, section 6.4".
    order : "before", "after" or "projection"
        Which oracle its pictures go to: that of `extinction` (classified before interpolation), that of `post`
        (classified after it), or that of mode xray.
    perspective : bool
        True if it draws perspective views.
    sampling_rate : float or None
        Samples or slabs per smallest spacing, of methods that have a choice.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    order: ClassVar[Order] = "before"
    perspective: ClassVar[bool] = False

    def __init__(self, scene: CompleteScene) -> None:
        self.check(scene)
        self.scene = scene
        self.volume = scene.volume

    @abstractmethod
    def picture(self, camera: Camera, size: Size) -> Numbers:
        """Return the picture, shape (height, width, 4), linear and premultiplied, row 0 on top.

        A method of order "projection" returns shape (height, width): the integral of the value along each ray, in data
        units times world units.
        """

    @classmethod
    def check(cls, scene: CompleteScene) -> None:
        """Raise InputError if the method cannot draw a scene; the message says what can."""
        mode = "xray" if cls.order == "projection" else "composite"
        if scene.mode != mode:
            raise InputError(
                f"{cls.name}: mode must be {mode}, got {scene.mode}; ray casting draws that (texvol raycast)"
            )
        if scene.camera.projection == "perspective" and not cls.perspective:
            raise InputError(
                f"{cls.name}: projection must be orthographic, got perspective; equal-steps and texvol render draw it"
            )
        present = {
            "light": scene.lighting is not None,
            "a depth cue": scene.depth_cue is not None,
            "clip planes or a crop box": bool(scene.clip or scene.crop),
            "geometry": bool(scene.geometry),
            "a mask": scene.mask is not None,
            "added volumes": bool(scene.added),
            "labels or blocks": scene.volume.nearest,
            "colours of samples": scene.volume.colors is not None,
            "air": scene.air is not None,
            "missing samples": scene.volume.has_missing,
            "infinite values": not scene.volume.has_missing and scene.volume.value_range != scene.volume.finite_range,
            "an opaque medium (infinite extinction)": not np.isfinite(scene.medium.extinctions).all(),
            "a medium that depends on the gradient": scene.medium.needs_gradient,
        }
        for what, is_there in present.items():
            if is_there:
                raise InputError(f"{cls.name}: the scene must not have {what}; slices draw it (texvol render)")

    @property
    def memory(self) -> int:
        """Bytes of what was prepared."""
        held = {id(each): each.nbytes for each in _arrays(vars(self)) if each is not self.volume.values}
        return sum(held.values())


def _arrays(thing: Any) -> list[NDArray]:
    """Return the arrays in an attribute: alone, or in tuples, lists and dictionaries."""
    if isinstance(thing, np.ndarray):
        return [thing]
    parts = thing.values() if isinstance(thing, dict) else thing if isinstance(thing, list | tuple) else ()
    return [array for part in parts for array in _arrays(part)]


def classified(scene: CompleteScene) -> NDArray[np.float32]:
    """Return emission and extinction of all samples, shape (z, y, x, 4), per world unit."""
    values = scene.volume.values
    samples = np.empty((*values.shape, 4), np.float32)
    for of_slice, slice_values in zip(samples, values, strict=True):  # float64 is held for one slice at a time
        of_slice[..., :3], of_slice[..., 3] = scene.medium.classify(slice_values)
    return samples


def visible(scene: CompleteScene, samples: NDArray[np.float32], least_opacity: float) -> NDArray[np.bool_]:
    """Return True for each of the `classified` samples that shows, shape (z, y, x).

    Parameters
    ----------
    least_opacity : float
        Largest optical depth and largest emission, per smallest spacing, of a sample that does not show.
    """
    red, green, blue, extinction = np.moveaxis(samples, -1, 0)  # a maximum along so short an axis takes twice the time
    largest = np.maximum(np.maximum(red, green), np.maximum(blue, extinction))
    return largest * scene.volume.smallest_spacing > least_opacity


def positive(name: str, number: float) -> float:
    """Return a setting, or raise InputError unless it is a positive and finite number."""
    if not (is_number(number) and 0 < number < np.inf):
        raise InputError(f"{name} must be positive and finite, got {number!r}")
    return float(number)


def with_background(picture: Numbers, scene: Scene) -> Numbers:
    """Add the background behind a premultiplied picture (h, w, 4), in place, and return it."""
    picture[..., :3] += (1 - picture[..., 3:]) * np.array(scene.background)
    return picture
