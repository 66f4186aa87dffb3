"""Volumes from and to other libraries: values, positions in the world, units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import texvol
from texvol.formats.interchange import volume_of
from texvol.scene.volume import Volume
from texvol.util.late import _FUNCTIONS, late

VALUES = np.arange(4 * 3 * 2, dtype=np.int16).reshape(4, 3, 2)
TURN = np.array([[0.0, -1.0, 0.0], [0.8, 0.0, -0.6], [0.6, 0.0, 0.8]])


def oblique(space: str = "right-anterior-superior") -> Volume:
    return Volume(VALUES, (1, 2, 3), (10, -20, 30), TURN, unit="mm", space=space, name="oblique")


def world(volume: Volume, x: int, y: int, z: int) -> np.ndarray:
    return volume.origin + volume.world_from_index @ np.array([x, y, z])


def assert_same_place(found: Volume, wanted: Volume, flip: tuple[int, int, int] = (1, 1, 1)) -> None:
    np.testing.assert_array_equal(found.values, wanted.values)
    for index in ((0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 2, 3)):
        np.testing.assert_allclose(world(found, *index), np.array(flip) * world(wanted, *index), atol=1e-5)


def test_each_late_function_is_there() -> None:
    for name in _FUNCTIONS:
        with pytest.raises(TypeError, match="missing|positional"):
            late(name)


def test_nibabel_and_back() -> None:
    nibabel = pytest.importorskip("nibabel")
    image = oblique().to_nibabel()
    np.testing.assert_allclose(image.affine @ [1, 2, 3, 1], [*world(oblique(), 1, 2, 3), 1], atol=1e-5)
    assert image.get_fdata()[1, 2, 3] == VALUES[3, 2, 1]
    assert image.header.get_xyzt_units()[0] == "mm"
    found = Volume.from_nibabel(nibabel.Nifti1Image.from_bytes(image.to_bytes()))
    assert_same_place(found, oblique())
    assert (found.unit, found.space) == ("mm", "right-anterior-superior")


def test_nibabel_has_the_world_of_a_volume_of_another() -> None:
    pytest.importorskip("nibabel")
    image = oblique("left-posterior-superior").to_nibabel()
    np.testing.assert_allclose(image.affine @ [0, 0, 0, 1], [-10, 20, 30, 1], atol=1e-5)


def test_nibabel_scales() -> None:
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(VALUES.T, np.eye(4))
    image.header.set_slope_inter(0.5, 7)
    found = Volume.from_nibabel(nibabel.Nifti1Image.from_bytes(image.to_bytes()))
    np.testing.assert_allclose(found.values, nibabel.Nifti1Image.from_bytes(image.to_bytes()).get_fdata().T)


def test_nibabel_of_four_axes_is_refused() -> None:
    nibabel = pytest.importorskip("nibabel")
    with pytest.raises(texvol.InputError, match=r"must have 3 axes, got shape \(2, 3, 4, 5\); image.slicer"):
        Volume.from_nibabel(nibabel.Nifti1Image(np.zeros((2, 3, 4, 5), np.float32), np.eye(4)))


def test_simpleitk_and_back(tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = oblique().to_sitk()
    np.testing.assert_allclose(image.TransformIndexToPhysicalPoint((1, 2, 3)), [-1, -1, 1] * world(oblique(), 1, 2, 3))
    assert image[1, 2, 3] == VALUES[3, 2, 1]
    found = Volume.from_sitk(image)
    assert_same_place(found, oblique(), (-1, -1, 1))
    sitk.WriteImage(image, str(tmp_path / "a.nrrd"))
    assert_same_place(texvol.load(tmp_path / "a.nrrd"), found)


def test_simpleitk_of_several_components_is_refused() -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(np.zeros((2, 2, 2, 3), np.float32), isVector=True)
    with pytest.raises(texvol.InputError, match="must have 1 component, got 3"):
        Volume.from_sitk(image)


def test_pyvista_and_back() -> None:
    pytest.importorskip("pyvista")
    image = oblique().to_pyvista()
    number = image.FindPoint(*world(oblique(), 1, 2, 3))
    assert image.active_scalars[number] == VALUES[3, 2, 1]
    assert_same_place(Volume.from_pyvista(image), oblique())


def test_vtk_values_of_cells_lie_in_their_middles() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(3, 4, 5), spacing=(1, 2, 3), origin=(7, 8, 9))
    image.cell_data["density"] = VALUES.ravel()
    found = Volume.from_pyvista(image)
    np.testing.assert_allclose(found.origin, (7.5, 9, 10.5))
    np.testing.assert_array_equal(found.values, VALUES)


def test_pyvista_names_its_arrays() -> None:
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(2, 3, 4))
    image.point_data["one"], image.point_data["two"] = VALUES.ravel(), VALUES.ravel() + 1
    np.testing.assert_array_equal(Volume.from_pyvista(image, scalars="two").values, VALUES + 1)
    with pytest.raises(texvol.InputError, match=r"scalars must name one of its arrays \(one, two\), got 'three'"):
        Volume.from_pyvista(image, scalars="three")
    with pytest.raises(texvol.InputError, match="must be an ImageData, got vtkPolyData"):
        Volume.from_pyvista(pyvista.Sphere())


def coordinates(**orders: np.ndarray) -> dict:
    return {name: (name, positions, {"units": "um"}) for name, positions in orders.items()}


def test_xarray_is_known_by_names_and_coordinates() -> None:
    xarray = pytest.importorskip("xarray")
    places = coordinates(x=5 + 0.5 * np.arange(2), y=2.0 * np.arange(3), z=9 - 3.0 * np.arange(4))
    array = xarray.DataArray(VALUES.T, places, ("x", "y", "z"), name="cells", attrs={"units": "K"})
    found = Volume.from_xarray(array)
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(world(found, 1, 2, 3), (5.5, 4, 0))
    assert (found.unit, found.value_unit, found.name) == ("µm", "K", "cells")
    back = found.to_xarray()
    np.testing.assert_allclose(back.sel(x=5.5, y=4, z=0), VALUES[3, 2, 1])
    assert back.z.attrs["units"] == "µm"


def test_xarray_of_the_earth() -> None:
    xarray = pytest.importorskip("xarray")
    places = {"lat": 50.0 - np.arange(3), "lon": np.arange(2.0), "level": np.arange(4.0)}
    array = xarray.DataArray(VALUES.transpose(1, 2, 0), places, ("lat", "lon", "level"))
    found = Volume.from_xarray(array)
    np.testing.assert_array_equal(found.values, VALUES)
    np.testing.assert_allclose(world(found, 1, 2, 3), (1, 48, 3))


def test_xarray_that_is_uneven_or_oblique_is_refused() -> None:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(VALUES, {"z": [0.0, 1.0, 2.0, 9.0]}, ("z", "y", "x"))
    with pytest.raises(texvol.InputError, match="its coordinates z must be even"):
        Volume.from_xarray(array)
    with pytest.raises(texvol.InputError, match="coordinates need axes along x, y, z"):
        oblique().to_xarray()


def test_xarray_in_parts_stays_in_parts() -> None:
    xarray, _ = pytest.importorskip("xarray"), pytest.importorskip("dask.array")
    array = xarray.DataArray(VALUES, dims=("z", "y", "x")).chunk({"z": 2})
    found = Volume.from_xarray(array)
    assert isinstance(found, texvol.LargeVolume)
    np.testing.assert_array_equal(found.whole.values, VALUES)


def test_xarray_has_an_accessor() -> None:
    xarray = pytest.importorskip("xarray")
    array = xarray.DataArray(VALUES.astype(np.float32), dims=("z", "y", "x"))
    np.testing.assert_array_equal(array.texvol.volume().values, VALUES)
    assert array.texvol.render(16).shape == (16, 16, 4)
    stretched = array.assign_coords(z=2.0 * np.arange(array.sizes["z"]))
    np.testing.assert_array_equal(
        stretched.texvol.show(16, interactive=False, tf="ct-bone"), texvol.render(stretched, 16, tf="ct-bone")
    )


def test_xarray_s_accessor_shows_the_window() -> None:
    xarray, _ = pytest.importorskip("xarray"), pytest.importorskip("anywidget")
    array = xarray.DataArray(VALUES.astype(np.float32), dims=("z", "y", "x"), name="field")
    widget = array.texvol.show((24, 16), light="none")
    assert (widget.width, widget.height) == (24, 16)
    np.testing.assert_array_equal(widget.cells.window.scene.volume.values, VALUES)
    assert widget.cells.window.scene.lighting is None
    widget.close()


def test_dlpack_and_array_interfaces() -> None:
    class OnlyDlpack:
        def __dlpack__(self, **how):
            return VALUES.__dlpack__(**how)

        def __dlpack_device__(self):
            return VALUES.__dlpack_device__()

    class OnlyInterface:
        __array_interface__ = VALUES.__array_interface__

    for thing in (OnlyDlpack(), OnlyInterface(), VALUES.tolist(), VALUES):
        np.testing.assert_array_equal(volume_of(thing).values, VALUES)
        np.testing.assert_array_equal(Volume(thing).values, VALUES)
    volume = Volume(VALUES)
    np.testing.assert_array_equal(np.asarray(volume), VALUES)
    np.testing.assert_array_equal(np.from_dlpack(volume), VALUES)


def test_what_is_no_volume_is_refused() -> None:
    with pytest.raises(texvol.InputError, match="a volume must be a path, .* got dict"):
        volume_of({})
    with pytest.raises(texvol.InputError, match="spacing must be given when it is made"):
        volume_of(Volume(VALUES), spacing=(1, 1, 2))


def test_an_image_says_its_spacing_itself() -> None:
    pytest.importorskip("nibabel")
    with pytest.raises(texvol.InputError, match="'spacing' does not go with Nifti1Image"):
        volume_of(oblique().to_nibabel(), spacing=(1, 1, 2))
