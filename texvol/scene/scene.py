"""Scene: everything that a picture shows, as data, without picture size, accuracy or device."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, get_args

from numpy.typing import ArrayLike, NDArray

from texvol.scene.added_volume import AddedVolume, common_box
from texvol.scene.air import Air
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane, Cutting, Range
from texvol.scene.depth_picture import DepthPicture
from texvol.scene.framing import framed
from texvol.scene.gradient import CENTRAL, Estimator
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import DepthCue, Lighting
from texvol.scene.looks import Look, look_for, seen_as
from texvol.scene.mask import Mask, without_hidden
from texvol.scene.picture_size import AnySize, checked_size
from texvol.scene.scene_checks import (
    check_air,
    check_cutting,
    check_geometry,
    check_isovalue,
    check_medium,
    check_types,
)
from texvol.scene.shapes import Lines, Mesh
from texvol.scene.transfer import NO_MEDIUM, TransferFunction, proposed_for
from texvol.scene.volume import Volume
from texvol.util.color import linear_color
from texvol.util.errors import InputError, check_type
from texvol.util.late import ShownInNotebooks, late
from texvol.util.suggestions import check_one_of, did_you_mean

Classification = Literal["auto", "slab", "extinction", "post", "integrated"]
CLASSIFICATION_CHOICES: tuple[str, ...] = get_args(Classification)
CLASSIFICATIONS = CLASSIFICATION_CHOICES[1:]  # without auto, which becomes one of them
Mode = Literal["composite", "xray", "mip", "minip", "average", "isosurface"]
MODES: tuple[str, ...] = get_args(Mode)
NUMBER_MODES = ("xray", "mip", "minip", "average")  # their pictures hold numbers, not colours
Coloring = Literal["grey", "tf"]
COLORINGS: tuple[str, ...] = get_args(Coloring)


@dataclass(frozen=True, repr=False)
class Scene(ShownInNotebooks):
    """Volume with transfer function, camera, light and all else that decides how it looks.

    Parameters
    ----------
    volume : Volume
    transfer_function : TransferFunction, Look or name of a preset, optional
        A look, or a preset, comes with its light, unless `lighting` is given. By default `looks.look_for(volume)`, with
        the volume as it is seen there: values that look like labels are labels. A TransferFunction alone is unlit.
    camera : Camera, optional
        By default what shows is framed, see `texvol.scene.framing`.
    background : (r, g, b), name such as "white", or #RRGGBB
        Linear light behind the volume; it adds (1 - opacity) times itself to each pixel.
    classification : "auto", "slab", "extinction", "post" or "integrated"
        Content of the 3D texture, see `slab_texture`. "slab" and "extinction" apply the transfer function before
        interpolation, "post" and "integrated" after it. "auto" stands for the medium of "post", which a renderer draws
        by "slab" where that is as good and no dearer.
    lighting : Lighting, "none", "head" or the name of a set of lights, optional
        Lights and reflection of the medium. With "none", and with a TransferFunction without it, the medium shows its
        own colour.
    gradient : Estimator
        Method of gradient estimation.
    depth_cue : DepthCue, optional
    mode : "composite", "xray", "mip", "minip", "average" or "isosurface"
        Emission and absorption; the integral, maximum, minimum or average of the value along each ray; or the first
        surface of `isovalue` on each ray.
    isovalue : float, optional
        In data units; mode "isosurface" needs it, or `isosurfaces`, and no other mode has it.
    isosurfaces : sequence of Isosurface
        Several surfaces with colours and opacities, composited in order, in place of `isovalue`.
    clip : sequence of ClipPlane
        Only the part on the inner side of all planes shows and casts shadows.
    crop : ((x0, x1), (y0, y1), (z0, z1)), optional
        Only the part inside this box shows; world units.
    caps : bool
        True if the surface of a cut through the medium is opaque, in the colour of the medium there.
    geometry : sequence of Mesh and Lines
        Surfaces and lines inside or beside the volume; in modes composite and isosurface.
    mask : Mask, optional
        Weights that hide or fade samples of the volume.
    added : sequence of AddedVolume
        Further volumes, in mode composite.
    air : float or "hounsfield", optional
        Value of air in mode xray: the difference of the value from it is integrated, see `texvol.scene.air`. By
        default the value itself is integrated.
    depth : DepthPicture, optional
        Depths at which rays end, in modes composite and isosurface; of a picture of the same view and size.
    coloring : "grey" or "tf"
        Colours of the numbers of xray, mip, minip and average in pictures of 8 bits: grey, or those of the transfer
        function.

    Raises
    ------
    InputError
        If a part has the wrong type or is out of range, or parts do not go together.
    """

    volume: Volume
    transfer_function: TransferFunction | None = None
    camera: Camera | None = None
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)
    classification: Classification = "auto"
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
    depth: DepthPicture | None = None
    isosurfaces: tuple[Isosurface, ...] = ()

    if TYPE_CHECKING:  # what may be given, beside what is kept

        def __init__(
            self,
            volume: Volume,
            transfer_function: TransferFunction | Look | str | None = None,
            camera: Camera | None = None,
            background: ArrayLike = (0.0, 0.0, 0.0),
            classification: Classification = "auto",
            lighting: Lighting | str | None = None,
            gradient: Estimator = CENTRAL,
            depth_cue: DepthCue | None = None,
            mode: Mode = "composite",
            isovalue: float | None = None,
            clip: Sequence[ClipPlane] = (),
            crop: Sequence[Sequence[float]] | NDArray[Any] | None = None,
            caps: bool = False,
            geometry: Sequence[Mesh | Lines] = (),
            mask: Mask | None = None,
            added: Sequence[AddedVolume] = (),
            air: Air = None,
            coloring: Coloring = "grey",
            depth: DepthPicture | None = None,
            isosurfaces: Sequence[Isosurface] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        check_types(self)
        object.__setattr__(self, "background", linear_color(self.background, "scene: background"))
        for name, known in (("classification", CLASSIFICATION_CHOICES), ("mode", MODES), ("coloring", COLORINGS)):
            check_one_of(f"scene: {name}", getattr(self, name), known)
        check_isovalue(self)
        check_air(self)
        check_medium(self)
        check_cutting(self)
        check_geometry(self)
        self._check_volumes()

    def __repr__(self) -> str:
        parts = [f"{self.volume!r}", self.mode, self.classification]
        parts += [self.transfer_function.name] if self.transfer_function is not None else []
        parts += ["lit"] if self.lighting is not None else []
        parts += [f"{len(self.added)} more volumes"] if self.added else []
        return f"Scene({', '.join(parts)})"

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Return the scene of a scene file (TOML), as `texvol render --scene` draws it.

        Raises
        ------
        InputError
            If the file, or one that it names, can't be read.
        """
        loaded: Scene = late("load_scene", path)
        return loaded

    def save(self, path: str | os.PathLike[str], size: AnySize = (512, 512)) -> None:
        """Write a scene file (TOML) for pictures of `size`, and transfer functions beside it.

        Raises
        ------
        InputError
            If a volume, mask or mesh was not read from a file, or a file can't be written.
        """
        late("write_scene", path, self, checked_size(size))

    def replace(self, **parts: Any) -> Scene:
        """Return the scene with other parts, by the names of its parameters; see `Scene` for errors."""
        known = [each.name for each in fields(self)]
        for name in parts:
            if name not in known:
                raise InputError(
                    f"scene: unknown part {name!r}; parts are {', '.join(known)}{did_you_mean(name, known)}"
                )
        return replace(self, **parts)

    @property
    def looked(self) -> Scene:
        """The scene with a look: itself if it has a transfer function, or needs none; the same object every time."""
        if self.transfer_function is not None or self.mode != "composite":
            return self
        known: Scene | None = self.__dict__.get("_looked")
        if known is None:
            known = replace(self, **look_for(self.volume).parts_for(self), volume=seen_as(self.volume))
            object.__setattr__(self, "_looked", known)
        return known

    def check_for(self, size: tuple[int, int]) -> None:
        """Raise InputError if an array was changed in place, or depths are not those of (width, height) pixels."""
        self.check_unchanged()
        self.check_size(size)

    def check_size(self, size: tuple[int, int]) -> None:
        """Raise InputError if a depth picture is not that of a picture of (width, height) pixels."""
        if self.depth is not None:
            self.depth.check_size(size)

    def check_unchanged(self) -> None:
        """Raise InputError if an array of a volume or mask was changed in place since the first picture of it."""
        for volume in self.volumes:
            volume.check_unchanged()
        for mask in (self.mask, *(each.mask for each in self.added)):
            if mask is not None:
                mask.check_unchanged()

    @property
    def volumes(self) -> tuple[Volume, ...]:
        """All volumes, the scene's own first."""
        return (self.volume, *(each.volume for each in self.added))

    @cached_property
    def box(self) -> Volume:
        """Box around all volumes, see `common_box`."""
        return common_box(self.volumes)

    @property
    def smallest_spacing(self) -> float:
        """Smallest spacing of all volumes, in world units; the unit of the sampling rate."""
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
        scene = self.looked
        parts: dict[str, Any] = {each.name: getattr(scene, each.name) for each in fields(Scene)}
        parts["camera"] = self.camera or self._framed(size[0] / size[1])
        if self.mask is not None and self.mode != "composite":
            parts |= {"volume": without_hidden(self.volume, self.mask), "mask": None}
        # An isosurface without a transfer function has a colour of its own; other pictures of numbers are grey.
        if self.transfer_function is None and self.mode in NUMBER_MODES and self.coloring == "tf":
            parts["transfer_function"] = proposed_for(self.volume)
        if self.classification == "auto":
            parts["classification"] = "post"
        parts["added"] = tuple(replace(each, transfer_function=each.medium) for each in self.added)
        return CompleteScene(**parts)

    def _framed(self, aspect: float) -> Camera:
        """Return the camera for a picture of that width over height; it is one for all classifications."""
        known: dict[float, Camera] = self.__dict__.setdefault("_cameras", {})
        return known.get(aspect) or known.setdefault(aspect, framed(self.looked, aspect=aspect))

    def classified_as(self, classification: Classification) -> Scene:
        """Return the scene in another classification; the same object every time."""
        if classification == self.classification:
            return self
        known: dict[str, Scene] = self.__dict__.setdefault("_classified", {})
        if classification not in known:
            known[classification] = replace(self, classification=classification)
            known[classification].__dict__["_cameras"] = self.__dict__.setdefault("_cameras", {})
        return known[classification]

    def in_memory(self, what: str) -> Scene:
        """Return the scene with all volumes in memory, the same object every time; `what` needs them there.

        Raises
        ------
        InputError
            If a volume does not fit in memory.
        """
        if not any(isinstance(volume, LargeVolume) for volume in self.volumes):
            return self
        known: Scene | None = self.__dict__.get("_in_memory")
        if known is None:
            try:
                added = tuple(replace(each, volume=each.volume.whole) for each in self.added)
                known = replace(self, volume=self.volume.whole, added=added)
            except InputError as error:
                raise InputError(f"{error} ({what} cannot be drawn part by part)") from None
            object.__setattr__(self, "_in_memory", known)
        return known

    @property
    def cutting(self) -> Cutting:
        """Clip planes and crop box, with caps if there is a cut."""
        return Cutting(self.clip, self.crop, self.caps and bool(self.clip or self.crop))

    @property
    def needs_gradient(self) -> bool:
        """True if anything in the scene depends on the gradient."""
        if self.mode == "isosurface":
            return True
        graded = self.transfer_function is not None and self.transfer_function.needs_gradient
        return self.mode == "composite" and (self.lighting is not None or graded)

    @property
    def surface_lighting(self) -> Lighting | None:
        """Light on meshes, None if no mesh is lit: the scene's or a head light, without shadows, as on an isosurface.

        `texvol.scene.lighting` defines it with the normal on the side of the eye and a gradient confidence of 1.
        """
        if not any(isinstance(shape, Mesh) and shape.lit for shape in self.geometry):
            return None
        return replace(self.lighting or Lighting(), two_sided=True, fade=0.0, shadows=False)

    @property
    def isovalues(self) -> tuple[float, ...]:
        """Values of all isosurfaces, data units."""
        return tuple(each.value for each in self.isosurfaces) if self.isovalue is None else (self.isovalue,)

    def _check_volumes(self) -> None:
        object.__setattr__(self, "added", tuple(self.added))
        if self.mask is not None:
            self.mask.check_fits(self.volume)
        for each in self.added:
            check_type("scene: each of added", each, AddedVolume)
        if self.added and self.mode != "composite":
            raise InputError(f"scene: added volumes need mode composite, got mode {self.mode}")
        if self.mode != "composite" and any(volume.colors is not None or volume.nearest for volume in self.volumes):
            raise InputError(f"scene: volumes of colours, labels or blocks need mode composite, got mode {self.mode}")
        without = replace(self, added=(), geometry=()) if self.added else self
        for each in self.added:
            replace(without, **_own_parts(each))  # checked like any scene


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
