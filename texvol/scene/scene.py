"""A Scene is what is to be drawn, as data: no picture size, no accuracy, no device."""

from __future__ import annotations

import operator
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from texvol.scene.added_volume import AddedVolume, common_box
from texvol.scene.air import Air, checked_air
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, Cutting, Range, checked_crop
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.hidden_samples import without_hidden
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.mask import Mask
from texvol.scene.shapes import Lines, Mesh, checked_geometry
from texvol.scene.transfer import NO_MEDIUM, TransferFunction, preset, proposed_for
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, check_type

Classification = Literal["slab", "extinction", "post", "integrated"]
CLASSIFICATIONS: tuple[str, ...] = get_args(Classification)
Mode = Literal["composite", "xray", "mip", "minip", "average", "isosurface"]
MODES: tuple[str, ...] = get_args(Mode)
NUMBER_MODES = ("xray", "mip", "minip", "average")  # whose pictures hold numbers, and no light
Coloring = Literal["grey", "tf"]
COLORINGS: tuple[str, ...] = get_args(Coloring)
# Optional parts of a scene and their types.
_PARTS: dict[str, type] = {
    "transfer_function": TransferFunction,
    "camera": Camera,
    "lighting": Lighting,
    "depth_cue": DepthCue,
    "mask": Mask,
}


@dataclass(frozen=True)
class Scene:
    """A volume, its transfer function, a camera, a background and where the transfer function is applied.

    Parameters
    ----------
    volume : Volume
    transfer_function : TransferFunction, optional
        Without one, `transfer.proposed_for(volume)`.
    camera : Camera, optional
        Without one, the whole box is framed.
    background : (r, g, b)
        Linear light that enters each ray from behind, as (1 - opacity) times itself.
    classification : "slab", "extinction", "post" or "integrated"
        What the 3D texture holds, see `slab_texture`; the oracle integrates the pre-classified medium for the first
        two, the post-classified one for the others.
    lighting : Lighting, optional
        Lights, and how matter answers them. Without it matter shows its own colour.
    gradient : Estimator
        How gradients are estimated where something needs them.
    depth_cue : DepthCue, optional
    mode : "composite", "xray", "mip", "minip", "average" or "isosurface"
        Emission and absorption; the value's integral, maximum, minimum or average along each ray; or the first surface
        of `isovalue` that each ray meets.
    isovalue : float, optional
        In data units; wanted by "isosurface", and by it alone.
    clip : sequence of ClipPlane
        Only what lies on the inner side of all of them is seen, and casts shadows.
    crop : ((x0, x1), (y0, y1), (z0, z1)), optional
        Only what lies in this box is seen; world units.
    caps : bool
        Whether matter that clip planes and crop box cut open is opaque where they do, in the colour that it has there.
    geometry : sequence of Mesh and Lines
        Surfaces and lines that stand in the volume, or beside it; in mode composite and isosurface.
    mask : Mask, optional
        What of the volume is hidden, or faded.
    added : sequence of AddedVolume
        Further volumes; in mode composite.
    air : float or "hounsfield", optional
        In mode xray, the value of air: what is integrated is how much the value is above it, see `texvol.scene.air`.
        Without it that is the value itself.
    coloring : "grey" or "tf"
        How pictures of 8 bits show the numbers of xray, mip, minip and average: as grey, or in the colours that the
        transfer function has for them.
    """

    volume: Volume
    transfer_function: TransferFunction | None = None
    camera: Camera | None = None
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    classification: Classification = "slab"
    lighting: Lighting | None = None
    gradient: Estimator = CENTRAL
    depth_cue: DepthCue | None = None
    mode: Mode = "composite"
    isovalue: float | None = None
    clip: tuple[ClipPlane, ...] = ()
    crop: tuple[Range, Range, Range] | None = None
    caps: bool = False
    geometry: tuple[Mesh | Lines, ...] = ()
    mask: Mask | None = None
    added: tuple[AddedVolume, ...] = ()
    air: Air = None
    coloring: Coloring = "grey"

    def __post_init__(self) -> None:
        self._check_types()
        background = np.asarray(self.background)
        if background.shape != (3,) or background.dtype.kind not in "iuf" or not (background >= 0).all():
            raise InputError(f"scene: background is three numbers from 0 upwards, and is {self.background!r}")
        object.__setattr__(self, "background", tuple(background.astype(np.float64).tolist()))
        if self.classification not in CLASSIFICATIONS:
            wanted = ", ".join(CLASSIFICATIONS)
            raise InputError(f"scene: classification is one of {wanted}, and not {self.classification!r}")
        if self.mode not in MODES:
            raise InputError(f"scene: mode is one of {', '.join(MODES)}, and not {self.mode!r}")
        if self.coloring not in COLORINGS:
            raise InputError(f"scene: coloring must be one of {', '.join(COLORINGS)}, got {self.coloring!r}")
        self._check_isovalue()
        self._check_air()
        self._check_medium()
        self._check_cutting()
        self._check_geometry()
        self._check_volumes()

    def _check_types(self) -> None:
        check_type("scene: volume", self.volume, Volume, "make one of an array by texvol.Volume(values)")
        if isinstance(self.transfer_function, str):
            object.__setattr__(self, "transfer_function", preset(self.transfer_function, self.volume))
        for name, kind in _PARTS.items():
            if (part := getattr(self, name)) is not None:
                check_type(f"scene: {name}", part, kind)
        check_type("scene: gradient", self.gradient, Estimator)

    def check_unchanged(self) -> None:
        """Raise InputError if an array of a volume or a mask was changed in place since something was made of it."""
        for volume in self.volumes:
            volume.check_unchanged()
        for mask in (self.mask, *(each.mask for each in self.added)):
            if mask is not None:
                mask.check_unchanged()

    @property
    def volumes(self) -> tuple[Volume, ...]:
        """The volume, and those that are added."""
        return (self.volume, *(each.volume for each in self.added))

    @cached_property
    def box(self) -> Volume:
        """Of several volumes a box around all, of one itself: see `common_box`."""
        return common_box(self.volumes)

    @property
    def smallest_spacing(self) -> float:
        """Of all volumes, in world units; the measure of the sampling rate."""
        return min(volume.smallest_spacing for volume in self.volumes)

    def completed(self, size: tuple[int, int]) -> CompleteScene:
        """Settle the camera, the transfer functions and the mask for a picture.

        Everything that draws a scene begins with this. The same scene and size give the same object, so that it can
        stand for what was drawn.

        Parameters
        ----------
        size : (width, height)
            In pixels; a scene without a camera is framed for their ratio.
        """
        known: tuple[tuple[int, int], CompleteScene] | None = self.__dict__.get("_completed")
        if known is None or known[0] != size:
            known = (size, self._complete(size))
            object.__setattr__(self, "_completed", known)
        return known[1]

    def _complete(self, size: tuple[int, int]) -> CompleteScene:
        parts: dict[str, Any] = {each.name: getattr(self, each.name) for each in fields(Scene)}
        parts["camera"] = self.camera_for(size)
        if self.mask is not None and self.mode != "composite":
            parts |= {"volume": without_hidden(self.volume, self.mask), "mask": None}
        # An isosurface without a transfer function has a colour of its own; other pictures of numbers are grey.
        if self.mode == "composite" or (self.mode in NUMBER_MODES and self.coloring == "tf"):
            parts["transfer_function"] = self.transfer_function or proposed_for(self.volume)
        parts["added"] = tuple(
            each if each.transfer_function else replace(each, transfer_function=proposed_for(each.volume))
            for each in self.added
        )
        return CompleteScene(**parts)

    @property
    def cutting(self) -> Cutting:
        """What is left of the box by clip planes and crop box."""
        return Cutting(self.clip, self.crop, self.caps and bool(self.clip or self.crop))

    @property
    def needs_gradient(self) -> bool:
        """Whether anything in the scene depends on the gradient of the value."""
        if self.mode == "isosurface":
            return True
        graded = self.transfer_function is not None and self.transfer_function.needs_gradient
        return self.mode == "composite" and (self.lighting is not None or graded)

    def _check_isovalue(self) -> None:
        if self.mode != "isosurface" and self.isovalue is not None:
            raise InputError(f"scene: an isovalue is for mode isosurface, and the mode is {self.mode}")
        if self.mode == "isosurface" and not (self.isovalue is not None and np.isfinite(self.isovalue)):
            raise InputError(f"scene: mode isosurface needs a finite isovalue, and it is {self.isovalue!r}")

    def _check_air(self) -> None:
        try:
            object.__setattr__(self, "air", checked_air(self.air))
        except InputError as error:
            raise InputError(f"scene: {error}") from None
        if self.air is not None and self.mode != "xray":
            raise InputError(f"scene: air is for mode xray, and the mode is {self.mode}")

    def _check_cutting(self) -> None:
        object.__setattr__(self, "clip", tuple(self.clip))
        for plane in self.clip:
            check_type("scene: each of clip", plane, ClipPlane)
        if self.crop is not None:
            object.__setattr__(self, "crop", checked_crop(self.crop))
        if self.caps and self.mode != "composite":
            raise InputError(f"scene: caps are of matter, in mode composite, and the mode is {self.mode}")

    def _check_volumes(self) -> None:
        object.__setattr__(self, "added", tuple(self.added))
        if self.mask is not None:
            self.mask.check_fits(self.volume)
        for each in self.added:
            check_type("scene: each of added", each, AddedVolume)
        if self.added and self.mode != "composite":
            raise InputError(f"scene: matter of several volumes adds up in mode composite, and the mode is {self.mode}")
        if self.mode != "composite" and any(volume.colors is not None or volume.labels for volume in self.volumes):
            raise InputError(f"scene: colours and labels are of matter, in mode composite, and the mode is {self.mode}")
        without = replace(self, added=(), geometry=()) if self.added else self
        for each in self.added:
            replace(without, **_own_parts(each))  # is checked like any scene

    def _check_geometry(self) -> None:
        object.__setattr__(self, "geometry", checked_geometry(self.geometry))
        if self.geometry and self.mode not in ("composite", "isosurface"):
            raise InputError(
                f"scene: geometry stands among matter, in mode composite, or beside an isosurface, and the mode is "
                f"{self.mode}, whose pictures hold numbers"
            )

    def _check_medium(self) -> None:
        medium = self.transfer_function
        if self.mode == "isosurface" and self.lighting is not None and self.lighting.shadows:
            raise InputError("scene: shadows are those of matter, in mode composite, and the mode is isosurface")
        if medium is None or self.mode != "composite":
            return
        if self.lighting is not None and medium.emissive:
            raise InputError("scene: an emissive transfer function glows by itself, and light is for associated ones")
        if self.classification == "integrated" and (medium.graded or medium.contours):
            raise InputError(
                "scene: integrated needs matter that depends on the value alone, and some depends on the gradient: "
                "use post, extinction or slab"
            )

    def camera_for(self, size: tuple[int, int]) -> Camera:
        """Return the scene's camera, or the one that frames the box in a picture of (width, height) pixels."""
        return self.camera or Camera.framing(self.box, aspect=size[0] / size[1])


class CompleteScene(Scene):
    """Scene with nothing left to choose, see `Scene.completed`.

    It has a camera; a mask only in mode composite; and transfer functions wherever they matter for the picture.
    """

    if TYPE_CHECKING:
        camera: Camera

    @property
    def medium(self) -> TransferFunction:
        """Transfer function of the volume; of a picture of the values themselves one that shows nothing."""
        return self.transfer_function or NO_MEDIUM

    def completed(self, size: tuple[int, int]) -> CompleteScene:
        """Return the scene itself."""
        return self

    def each_alone(self) -> tuple[CompleteScene, ...]:
        """Return for each volume the scene without the others, seen and cued as it is in this one.

        Opacities of slabs do not add up, extinctions do: `slab` for one volume is `extinction` for several.
        """
        if not self.added:
            return (self,)
        cue = self.depth_cue
        if cue is not None:
            near, far = cue.range_for(self.box, self.camera)
            cue = replace(cue, near=near, far=far)
        kind = "extinction" if self.classification == "slab" else self.classification
        first = replace(self, added=(), depth_cue=cue, classification=kind)
        return (first, *(replace(first, **_own_parts(each)) for each in self.added))


def _own_parts(added: AddedVolume) -> dict[str, Any]:
    """Return the parts of a scene that an added volume has of its own."""
    return {"volume": added.volume, "transfer_function": added.transfer_function, "mask": added.mask}


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """(width, height) as whole numbers of at least 1, or InputError."""
    try:
        width, height = (operator.index(side) for side in size)
    except (TypeError, ValueError):
        raise InputError(f"size is (width, height) in whole pixels, and is {size!r}") from None
    if min(width, height) < 1:
        raise InputError(f"size {width}x{height}: a picture has at least one pixel along each side")
    return width, height
