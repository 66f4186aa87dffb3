"""Images of other libraries that are unusual: units, axes of length one, other types, and what is no image."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import texvol
from texvol.scene.volume import Volume

VALUES = np.arange(4 * 3 * 2, dtype=np.int16).reshape(4, 3, 2)


def field(names: str = "zyx", values: np.ndarray = VALUES, units: str = "", **more: Any) -> Any:
    xarray = pytest.importorskip("xarray")
    places = {
        name: (name, np.arange(float(size)), {"units": units}) for name, size in zip("zyx", (4, 3, 2), strict=True)
    }
    return xarray.DataArray(values, places, tuple(names), **more)


@pytest.mark.parametrize(
    ("word", "short"),
    [
        ("micrometers", "µm"), ("Micrometres", "µm"), ("meters", "m"), ("metres", "m"), ("centimeters", "cm"),
        ("angstroms", "Å"), ("inches", "in"), ("1", ""), ("furlong", "furlong"), ("mms", "mms"),
    ],
)  # fmt: skip
def test_units_in_the_plural_are_known(word: str, short: str) -> None:
    assert Volume.from_xarray(field(units=word)).unit == short


def test_plural_units_are_compared_with_others() -> None:
    array = field(units="millimeters")
    array.z.attrs["units"] = "micrometers"
    assert Volume.from_xarray(array).spacing.tolist() == pytest.approx([1, 1, 1e-3])


def test_an_unknown_dimension_of_length_one_is_left_out() -> None:
    found = Volume.from_xarray(field("qzyx", VALUES[np.newaxis]))
    np.testing.assert_array_equal(found.values, VALUES)
    many = np.stack([VALUES, VALUES])
    with pytest.raises(texvol.InputError, match=r"got q, z, y, x; .* array.isel\(q=0\) leaves it out"):
        Volume.from_xarray(field("qzyx", many))
    with pytest.raises(texvol.InputError, match=r"got x, y, q; array.rename\(q='z'\) names one"):
        Volume.from_xarray(pytest.importorskip("xarray").DataArray(np.zeros((2, 3, 1)), dims=("x", "y", "q")))


@pytest.mark.parametrize("take", [Volume.from_xarray, Volume.from_nibabel, Volume.from_sitk, Volume.from_pyvista])
@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (None, "NoneType$"), (VALUES, "ndarray; texvol.Volume is one of an array"),
        ("head.nii", "str; texvol.load reads a file"),
    ],
)  # fmt: skip
def test_what_is_no_image_is_refused(take: Any, thing: Any, words: str) -> None:
    with pytest.raises(texvol.InputError, match=f"image must be an? .*, got {words}"):
        take(thing)


def test_nibabel_s_further_axes_of_length_one_are_left_out() -> None:
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(VALUES.T[..., np.newaxis], np.diag([1, 2, 3, 1]))
    np.testing.assert_array_equal(Volume.from_nibabel(image).values, VALUES)


def test_lengths_become_units_that_the_other_library_has() -> None:
    nibabel, _ = pytest.importorskip("nibabel"), pytest.importorskip("SimpleITK")
    cells = Volume(VALUES, (1, 2, 3), (10, 20, 30), unit="µm")
    assert cells.to_sitk().GetSpacing() == pytest.approx((1e-3, 2e-3, 3e-3))
    assert cells.to_sitk().GetOrigin() == pytest.approx((1e-2, 2e-2, 3e-2))
    assert cells.to_nibabel().header.get_xyzt_units()[0] == "micron"
    image = Volume(VALUES, (1, 2, 3), unit="cm").to_nibabel()
    assert image.header.get_xyzt_units()[0] == "mm"
    assert nibabel.affines.voxel_sizes(image.affine) == pytest.approx([10, 20, 30])
    odd = Volume(VALUES, (1, 2, 3), unit="degrees")
    assert odd.to_sitk().GetSpacing() == (1, 2, 3)
    assert odd.to_nibabel().header.get_xyzt_units()[0] == "unknown"


def test_label_maps_of_simpleitk_are_refused() -> None:
    sitk = pytest.importorskip("SimpleITK")
    labels = sitk.Cast(sitk.GetImageFromArray(VALUES.astype(np.uint8)), sitk.sitkLabelUInt8)
    with pytest.raises(texvol.InputError, match=r"got label of 8-bit .*; SimpleITK.Cast\(image, SimpleITK.sitkUInt8\)"):
        Volume.from_sitk(labels)


def test_cells_of_a_flat_image_are_one_slice() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(3, 4, 1), origin=(0, 0, 7))
    image.cell_data["heat"] = np.arange(6.0)
    found = Volume.from_pyvista(image)
    assert (found.dimensions, found.origin.tolist()) == ((2, 3, 1), [0.5, 0.5, 7])


def test_words_and_halves_of_vtk() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(2, 3, 4))
    image.point_data["words"] = np.array(["a"] * 24)
    for scalars in (None, "words"):
        with pytest.raises(texvol.InputError, match="array words must hold numbers"):
            Volume.from_pyvista(image, scalars=scalars)
    half = Volume(VALUES.astype(np.float16)).to_pyvista()
    np.testing.assert_array_equal(Volume.from_pyvista(half).values, VALUES)


def test_hidden_samples_of_vtk_are_missing() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(2, 3, 4))
    image.point_data["heat"] = VALUES.ravel()
    hidden = np.zeros(24, np.uint8)
    hidden[5] = 2
    image.point_data["vtkGhostType"] = hidden
    image.set_active_scalars("heat")
    assert np.flatnonzero(np.isnan(Volume.from_pyvista(image).values)).tolist() == [5]


def test_labels_in_an_array_have_the_names_of_a_table(tmp_path: Path) -> None:
    table = tmp_path / "seg.txt"
    table.write_text("0 Unknown 0 0 0 0\n1 Liver 255 0 0 0\n2 Spleen 0 255 0 0\n", encoding="utf-8")
    labels = VALUES % 3
    picture = texvol.render(labels, 32, label_names=table)
    assert picture.scene is not None
    volume = picture.scene.volume
    assert volume.labels and volume.label_table is not None
    np.testing.assert_array_equal(picture, texvol.render(_saved(tmp_path, labels), 32, label_names=table))
    assert texvol.render(labels, 16, label_names="none", labels=True).scene.volume.label_table is None
    with pytest.raises(texvol.InputError, match=r"nowhere\.txt: cannot be read"):
        texvol.render(labels, 16, label_names="nowhere.txt")


def _saved(folder: Path, values: np.ndarray) -> Path:
    np.save(folder / "labels.npy", values)
    return folder / "labels.npy"
