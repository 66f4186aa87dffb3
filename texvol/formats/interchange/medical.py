"""Volumes from and to the images of nibabel (world axes right, anterior, superior) and of SimpleITK (left, posterior).

Lengths are millimetres unless a header says otherwise, as those libraries' formats have it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.formats.readers.samples import FileFault, grid_from_columns
from texvol.formats.units import metres_of
from texvol.scene.spaces import turned
from texvol.scene.volume import Volume
from texvol.util.arrays import check_is
from texvol.util.errors import InputError, missing_extra, missing_library

RAS, LPS = "right-anterior-superior", "left-posterior-superior"
_UNPACKED = "SimpleITK.Cast(image, SimpleITK.sitkUInt8) makes samples of it"
_SHORT = {"mm": "mm", "meter": "m", "micron": "µm", "unknown": "mm"}
_MILLIMETRE = 1e-3
_WORDS = {"mm": "mm", "m": "meter", "µm": "micron"}


def from_nibabel(image: Any, *, name: str = "image", labels: bool = False, value_unit: str = "") -> Volume:
    """Return the volume of an image of nibabel, scaled as its header says.

    Raises
    ------
    InputError
        If it has not three axes, or its affine leaves no volume.
    """
    check_is(image, "an image of nibabel", "dataobj", "affine")
    while len(image.shape) > 3 and image.shape[-1] == 1:
        image = image.slicer[..., 0]
    if len(image.shape) != 3:
        advice = "image.slicer[..., t] is one step" if len(image.shape) == 4 else "a volume has three"
        raise InputError(f"{name}: the image must have 3 axes, got shape {tuple(image.shape)}; {advice}")
    grid: dict[str, Any] = {}
    if image.affine is not None:
        try:
            spacing, direction = grid_from_columns(image.affine[:3, :3])
        except FileFault as fault:
            raise InputError(f"{name}: {fault}") from None
        grid = {"spacing": spacing, "direction": direction, "origin": image.affine[:3, 3], "space": RAS}
    units = getattr(image.header, "get_xyzt_units", lambda: ("mm", ""))()
    values = np.asanyarray(image.dataobj).transpose(2, 1, 0)
    return Volume(values, **grid, unit=_SHORT.get(units[0], "mm"), name=name, labels=labels, value_unit=value_unit)


def to_nibabel(volume: Volume) -> Any:
    """Return the volume as an image of nibabel (Nifti1Image), in the same type.

    A volume that does not say where its world axes point to keeps its numbers, as an unnamed world.
    """
    try:
        import nibabel
    except ImportError as error:
        raise missing_extra("nibabel", "formats", "an image of nibabel") from error

    moved = turned(volume.whole, RAS)
    factor = 1.0 if moved.unit in _WORDS else _millimetres(moved)
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = factor * moved.world_from_index, factor * moved.origin
    values = moved.values
    if values.dtype == np.float16:
        values = values.astype(np.float32)  # the format has no smaller one
    image = nibabel.Nifti1Image(values.transpose(2, 1, 0), affine, dtype=values.dtype)
    known = "mm" if metres_of(moved.unit) else "unknown"
    image.header.set_xyzt_units(_WORDS.get(moved.unit, known))
    return image


def from_sitk(image: Any, *, name: str = "image", labels: bool = False, value_unit: str = "") -> Volume:
    """Return the volume of an image of SimpleITK; the samples are copied.

    Raises
    ------
    InputError
        If it has not three axes, or several components for each sample.
    """
    check_is(image, "an image of SimpleITK", "GetDirection", "GetPixelIDTypeAsString")
    import SimpleITK

    kind = image.GetPixelIDTypeAsString()
    if kind.startswith("label of"):  # SimpleITK ends the process if it is asked for more
        raise InputError(f"{name}: the image must hold samples, got {kind}; {_UNPACKED}")
    if image.GetDimension() != 3:
        raise InputError(f"{name}: the image must have 3 axes, got {image.GetDimension()}")
    if image.GetNumberOfComponentsPerPixel() != 1:
        count = image.GetNumberOfComponentsPerPixel()
        advice = "SimpleITK.VectorIndexSelectionCast(image, N) is one of them"
        raise InputError(f"{name}: the image must have 1 component, got {count}; {advice}")
    return Volume(
        SimpleITK.GetArrayFromImage(image),
        image.GetSpacing(), image.GetOrigin(), np.reshape(image.GetDirection(), (3, 3)),
        unit="mm", space=LPS, name=name, labels=labels, value_unit=value_unit,
    )  # fmt: skip


def to_sitk(volume: Volume) -> Any:
    """Return the volume as an image of SimpleITK, in the same type; known units of length become millimetres."""
    try:
        import SimpleITK
    except ImportError as error:
        raise missing_library("SimpleITK", "an image of SimpleITK") from error
    moved = turned(volume.whole, LPS)
    values = moved.values.astype(np.float32) if moved.dtype == np.float16 else moved.values
    image = SimpleITK.GetImageFromArray(values)
    factor = _millimetres(moved)
    image.SetSpacing((factor * moved.spacing).tolist())
    image.SetOrigin((factor * moved.origin).tolist())
    image.SetDirection(moved.direction.ravel().tolist())
    return image


def _millimetres(volume: Volume) -> float:
    """Return the millimetres of the volume's unit; 1 for a unit that is no known length."""
    metres = metres_of(volume.unit)
    return 1.0 if metres is None else metres / _MILLIMETRE
