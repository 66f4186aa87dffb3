"""Arguments of `Renderer.render` for accuracy, checked, with every choice made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from texvol.scene.display import NUMBER_MODES
from texvol.scene.large_volume import LargeVolume
from texvol.scene.lighting import SHADOW_NODES
from texvol.scene.scene import CompleteScene, Scene
from texvol.slicing.slabs import SLICINGS, Slicing
from texvol.textures.slab_texture import TEXEL_FORMATS
from texvol.textures.value_texture import REFERENCE
from texvol.util.errors import InputError
from texvol.util.numbers import AnyNumber, checked_number
from texvol.util.suggestions import check_one_of

ADAPTIVE = ("auto", "on", "off")  # whether slabs are divided where they are not nearly transparent
_LEAST_DIVIDED = 1 / 16  # optical depth of a path as long as the spacing, from which on slabs are divided
PARTS = 3  # of a slab that is divided, as in shaders/divided_slabs.glsl
INTERPOLATIONS = ("auto", "driver", "shader")  # what interpolates texels
DEFAULT_SAMPLING_RATE = 1.0
# In a dense medium it costs a tenth more time than 1/1024, and its error is below the rounding of a float32 picture.
# With a coarser default it would be the largest error of every fine picture.
DEFAULT_EARLY_TERMINATION = 2.0**-22
_TERMINATION_FRACTION, _MOST_TERMINATION = 1 / 16, 1 / 1024  # fraction of a requested error, and the most


@dataclass(frozen=True)
class Settings:
    """Arguments of `Renderer.render` with every choice made."""

    slab_thickness: float  # world units
    texture_format: str
    target_format: str
    early_termination: float
    skip_empty: bool
    slicing: str = "stacks"
    texture_refinement: int = 1  # texels along an axis for a sample
    shadow_nodes: int = SHADOW_NODES  # with a light transmittance, along the longest edge of the box
    level: int = 0  # of a large volume
    coarser_by_pixels: bool | None = None  # True if parts of it are as coarse as pixels show; `level` is the finest
    level_error: float | None = None  # that coarser levels of its parts may have
    # Rectangles of the picture that are drawn, (x, y, width, height) in pixels from below, if not all of it is.
    regions: tuple[tuple[int, int, int, int], ...] | None = None
    adaptive: str | None = None  # "on" if slabs are divided where they are not nearly transparent; "auto": to be chosen
    interpolation: str | None = None  # "shader" if eight texels are fetched for each sample; None: the driver's

    @property
    def thinnest(self) -> float:
        """Thickness of the thinnest slabs, or parts of slabs, world units."""
        return self.slab_thickness / (PARTS if self.adaptive == "on" else 1)

    def least_divided(self, scene: Scene) -> float | None:
        """Optical depth from which on slabs are divided: the same ones at each thickness; None if none are."""
        if self.adaptive != "on" or (scene.mode, scene.classification) != ("composite", "post"):
            return None
        return _LEAST_DIVIDED * self.slab_thickness / scene.smallest_spacing

    @property
    def exact(self) -> Settings:
        """Settings of a reference: float32 throughout, no ray ended early, no slab drawn whole that the box cuts short.

        So these count as errors of a picture. If rounding of values matters, theirs differs from the picture's.
        """
        whole = replace(self, early_termination=0.0, slicing="stacks", adaptive=None)
        return replace(whole, texture_format=REFERENCE, target_format="rgba32f")

    def skips(self, scene: Scene) -> bool:
        """True if empty cells are skipped; in pictures of numbers every cell counts."""
        return self.skip_empty and scene.mode in ("composite", "isosurface")


def arguments_of(settings: Settings, max_error: float | None = None) -> dict[str, Any]:
    """Return the arguments with which `Renderer.render` draws a picture again, by tiles if `max_error` found it."""
    found = {name: value for name, value in vars(settings).items() if value is not None}
    if max_error is not None:  # one thickness would draw another picture
        del found["slab_thickness"]
        found |= {"max_error": max_error, "adaptive": settings.adaptive or "off"}
    return found


def settings_asked_for(
    scene: Scene,
    thickness: tuple[float | None, ...],
    formats: tuple[str, str],
    early_termination: float | None,
    skip_empty: bool,
    slicing: Slicing,
    interpolation: str = "auto",
) -> Settings:
    """Return the settings of arguments of `Renderer.render`; the thickness is NaN if an error is to decide it.

    Parameters
    ----------
    thickness : (slab_thickness, sampling_rate, max_error)
    formats : (texture_format, target_format)

    Raises
    ------
    InputError
        If one of them is out of range, or several decide the thickness.
    """
    wanted = checked(scene, *thickness)
    checked_formats = checked_format(formats[0]), checked_target(formats[1], scene.mode)
    termination = checked_termination(early_termination, thickness[2])
    checked_slabs = wanted, *checked_formats, termination, skip_empty, slicing
    return Settings(*checked_slabs, interpolation=checked_interpolation(interpolation))


def numbers_asked_for(**named: AnyNumber | None) -> tuple[float | None, ...]:
    """Return numbers among the arguments of `Renderer.render` as floats; InputError names what is none."""
    return tuple(checked_number(name, number) for name, number in named.items())


def checked(scene: Scene, slab_thickness: float | None, sampling_rate: float | None, max_error: float | None) -> float:
    """Return the slab thickness in world units; NaN if `max_error` is to decide it.

    Raises
    ------
    InputError
        If more than one argument is given, or one is not positive and finite.
    """
    given = {"slab thickness": slab_thickness, "sampling rate": sampling_rate, "maximum error": max_error}
    chosen = {name: number for name, number in given.items() if number is not None}
    if len(chosen) > 1:
        raise InputError(f"{' and '.join(chosen)} all decide the slab thickness: give only one of them")
    for name, number in chosen.items():
        if not 0 < number < np.inf:
            raise InputError(f"{name} must be positive and finite, got {number:g}")
    if max_error is not None:
        return float("nan")
    thickness = slab_thickness or scene.smallest_spacing / (sampling_rate or DEFAULT_SAMPLING_RATE)
    return min(thickness, 2 * scene.box.radius)  # the box is no thicker


def checked_interpolation(interpolation: str) -> str | None:
    """Return the argument as settings have it: "shader", or None for the driver.

    Raises
    ------
    InputError
        If it is none of `INTERPOLATIONS`.
    """
    if interpolation not in INTERPOLATIONS:
        raise InputError(f"interpolation must be {', '.join(INTERPOLATIONS[:2])} or shader, got {interpolation!r}")
    return "shader" if interpolation == "shader" else None


def checked_adaptive(adaptive: str, scene: CompleteScene, settings: Settings, decided: bool) -> str | None:
    """Return the argument as settings have it: "on", "auto" if it is still to be chosen, or None.

    `decided` is True if an argument decides the slab thickness: then "auto" divides none.

    Raises
    ------
    InputError
        If it is none of `ADAPTIVE`, or "on" for a scene whose slabs are not divided.
    """
    check_one_of("adaptive", adaptive, ADAPTIVE)
    if adaptive == "off":
        return None
    beyond = {
        f"mode {scene.mode}": scene.mode != "composite",
        f"classification {scene.classification}": scene.classification != "post",
        "several volumes": bool(scene.added),
        "labels": scene.volume.nearest,
        "colours of samples": scene.volume.colors is not None,
        "a volume in a store": isinstance(scene.volume, LargeVolume),
        f"slicing {settings.slicing}": settings.slicing != "stacks",
    }
    found = [name for name, is_there in beyond.items() if is_there]
    if adaptive == "on" and found:
        raise InputError(f"adaptive slabs are of one volume drawn by classification post, got {' and '.join(found)}")
    return None if found or (adaptive == "auto" and decided) else adaptive


def checked_format(texture_format: str) -> str:
    """Return the format of the 3D texture.

    Raises
    ------
    InputError
        If there is no such format.
    """
    if texture_format not in ("auto", *TEXEL_FORMATS):
        raise InputError(f"texture format must be auto, rgba8, rgba16f or rgba32f, got {texture_format!r}")
    return texture_format


def checked_termination(early_termination: float | None, max_error: float | None) -> float:
    """Return the transmittance at which a ray ends: the argument, a fraction of the requested error, or the default.

    Raises
    ------
    InputError
        If it is not from 0 to below 1.
    """
    if early_termination is None:
        return min(_TERMINATION_FRACTION * max_error, _MOST_TERMINATION) if max_error else DEFAULT_EARLY_TERMINATION
    if not 0 <= early_termination < 1:
        raise InputError(f"early termination must be a transmittance from 0 to below 1, got {early_termination:g}")
    return early_termination


def checked_target(target_format: str, mode: str = "composite") -> str:
    """Return the format of the target: the argument, or single precision for "auto".

    A smaller target rounds each blend to 2^-11 or worse, which is more than the usual error of a whole picture, and
    saves no time that shows.

    Raises
    ------
    InputError
        If there is no such format, or it is too small for the numbers of the mode.
    """
    if target_format not in ("auto", *TEXEL_FORMATS):
        raise InputError(f"target format must be auto, rgba8, rgba16f or rgba32f, got {target_format!r}")
    if mode in NUMBER_MODES and target_format not in ("auto", "rgba32f"):
        wanted = f"target format must be auto or rgba32f in mode {mode}, whose numbers need digits"
        raise InputError(f"{wanted}, got {target_format}")
    return "rgba32f" if target_format == "auto" else target_format


def checked_slicing(slicing: Slicing, scene: CompleteScene, pipeline: str = "auto") -> Slicing:
    """Return the argument if the scene can be drawn in this way.

    Raises
    ------
    InputError
        If there is no such slicing, or it does not draw what the scene has, or the pipeline has no polygons of slabs.
    """
    if slicing not in SLICINGS:
        raise InputError(f"slicing must be stacks, polygons or wilson, got {slicing!r}")
    if pipeline == "compute" and slicing in ("polygons", "wilson"):
        raise InputError(
            f"pipeline compute does not draw slicing {slicing}: choose pipeline fragment or slicing stacks"
        )
    beyond = {
        "several volumes": bool(scene.added),
        "labels": scene.volume.labels,
        "blocks": scene.volume.blocks,
        f"mode {scene.mode}": scene.mode != "composite",
    }
    beyond_wilson = {
        f"classification {scene.classification}": scene.classification != "slab",
        "what is cut open": len(scene.cutting) > 0,
        "a depth cue": scene.depth_cue is not None,
        "meshes or lines": bool(scene.geometry),
        "a depth picture": scene.depth is not None,
    }
    other = "stacks" if any(beyond.values()) else "polygons or stacks"
    if slicing == "wilson":
        beyond |= beyond_wilson
    found = [name for name, is_there in beyond.items() if is_there]
    if slicing != "stacks" and found:
        raise InputError(f"slicing {slicing} does not draw {' or '.join(found)}: choose slicing {other}")
    return slicing
