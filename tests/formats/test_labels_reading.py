"""Files of labels: read as such when the user says so, and never mixed, on grids that are resampled neither."""

from __future__ import annotations

from pathlib import Path

import netCDF4
import nibabel
import numpy as np
import pytest
from support import grid_files, marked
from support.real_data import real_volume

from texvol import InputError, load
from texvol.cli import information
from texvol.formats.readers import TimeSeries, time_steps
from texvol.options import reading as reading_options
from texvol.scene.label_counts import label_counts

# Uneven along x and z.
X, Y, Z = (0.0, 1.0, 1.2, 4.0), (0.0, 2.0, 4.0), (0.0, 0.5, 3.0)
LABELS = np.arange(36, dtype="u1").reshape(3, 3, 4) * 7


def nearest(axis: tuple[float, ...], positions: np.ndarray) -> np.ndarray:
    return np.abs(np.array(axis) - positions[:, np.newaxis]).argmin(axis=1)


@pytest.mark.parametrize("dtype", ["u1", "i4", "f4"])
def test_labels_are_labels_when_the_user_says_so(tmp_path: Path, dtype: str) -> None:
    np.save(tmp_path / "v.npy", marked.marked(dtype))
    volume = load(tmp_path / "v.npy", labels=True)
    assert volume.labels and volume.source["labels"] is True and volume.values.dtype == np.dtype(dtype)
    plain = load(tmp_path / "v.npy")
    assert not plain.labels and "labels" not in plain.source


def test_what_is_not_whole_is_no_label(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", marked.marked("f4") + 0.5)
    with pytest.raises(InputError, match=r"v\.npy: labels must be whole numbers"):
        load(tmp_path / "v.npy", labels=True)


def test_a_nifti_file_that_says_so_is_noted(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(marked.marked("u1").T, np.eye(4))
    image.header["intent_code"] = 1002
    nibabel.save(image, tmp_path / "v.nii")
    assert any("--labels" in note for note in load(tmp_path / "v.nii").notes)
    assert not load(tmp_path / "v.nii", labels=True).notes


def written(path: Path, kind: str) -> Path:
    if kind == "vtr":
        return grid_files.written(path / "v.vtr", grid_files.rectilinear((X, Y, Z), LABELS))
    with netCDF4.Dataset(path / "v.nc", "w") as file:
        for name, axis in zip("zyx", (Z, Y, X), strict=True):
            file.createDimension(name, len(axis))
            file.createVariable(name, "f8", (name,))[:] = axis
            file[name].axis = name.upper()
        file.createVariable("organ", "u1", ("z", "y", "x"))[:] = LABELS
    return path / "v.nc"


@pytest.mark.parametrize("kind", ["vtr", "nc"])
@pytest.mark.parametrize("resolution", [(41, 5, 13), (40, 3, 7), (2, 2, 2)])
def test_labels_of_a_rectilinear_grid_are_the_nearest_samples(
    tmp_path: Path, kind: str, resolution: tuple[int, int, int]
) -> None:
    volume = load(written(tmp_path, kind), labels=True, resolution=resolution)
    assert volume.values.dtype == np.uint8 and volume.dimensions == resolution
    positions = [np.linspace(axis[0], axis[-1], count) for axis, count in zip((X, Y, Z), resolution, strict=True)]
    # Half-way between two samples either is nearest.
    clear = [
        np.sort(np.abs(np.array(axis) - at[:, None]), axis=1) for axis, at in zip((X, Y, Z), positions, strict=True)
    ]
    sure = np.ix_(*(each[:, 1] - each[:, 0] > 1e-9 for each in clear[::-1]))
    index = [nearest(axis, at) for axis, at in zip((X, Y, Z), positions, strict=True)]
    np.testing.assert_array_equal(volume.values[sure], LABELS[np.ix_(*index[::-1])][sure])
    assert volume.resampling is not None
    back = [
        np.rint((np.array(axis) - axis[0]) / (axis[-1] - axis[0]) * (count - 1)).astype(int)
        for axis, count in zip((X, Y, Z), resolution, strict=True)
    ]
    changed = int((volume.values[np.ix_(*back[::-1])] != LABELS).sum())
    assert (volume.resampling["changed"], volume.resampling["compared"]) == (changed, 36)
    assert f"{changed} of 36 samples" in information.text(information.metadata(volume))


def test_an_even_grid_keeps_its_labels(tmp_path: Path) -> None:
    even = [np.arange(size) * 2.0 for size in LABELS.shape[::-1]]
    volume = load(grid_files.written(tmp_path / "v.vtr", grid_files.rectilinear(even, LABELS)), labels=True)
    np.testing.assert_array_equal(volume.values, LABELS)
    assert volume.resampling is None


def test_labels_of_a_curvilinear_grid_are_the_nearest_samples(tmp_path: Path) -> None:
    points = grid_files.warped((9, 8, 7))
    # Halves along the grid's own axes: the label says on which side of the middle sample along x a point lies.
    labels = np.zeros((7, 8, 9), "i2")
    labels[..., 4], labels[..., 5:] = 100, 300
    path = grid_files.written(tmp_path / "v.vts", grid_files.structured(points, labels))
    volume = load(path, labels=True, resolution=(30, 25, 20))
    assert volume.values.dtype == np.int16 and set(label_counts(volume).labels.tolist()) == {0, 100, 300}
    at = grid_files.points_of(volume).reshape(-1, 3)
    # A point within 0.2 of a cell's smallest edge of a sample is nearer to it than half a cell in index space, too.
    flat = points.reshape(-1, 3)
    distance = np.array([np.sqrt(((flat - each) ** 2).sum(axis=1)) for each in at])
    edge = min(np.linalg.norm(np.diff(points, axis=axis), axis=-1).min() for axis in range(3))
    near = (distance.min(axis=1) < 0.2 * edge) & (volume.values.ravel() != 0)
    assert near.sum() > 20
    np.testing.assert_array_equal(volume.values.ravel()[near], labels.ravel()[distance.argmin(axis=1)[near]])
    assert volume.resampling is not None and volume.resampling["outside"] > 0
    assert "are 0" in information.text(information.metadata(volume))


def test_time_steps_of_labels(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", np.stack([marked.marked(), marked.marked() + 1]))
    assert time_steps(tmp_path / "v.npy", labels=True) == 2
    with TimeSeries(tmp_path / "v.npy", labels=True) as series:
        assert [volume.labels for volume in series] == [True, True]


def test_the_line_has_both_options() -> None:
    import argparse

    parser = argparse.ArgumentParser()
    reading_options.add_volume_options(parser)
    told = lambda *words: reading_options.told(vars(parser.parse_args(["v.nrrd", *words])))  # noqa: E731
    assert told() == {} and told("--labels") == {"labels": True} and told("--no-color") == {"color": False}


def test_labels_of_the_frog() -> None:
    """Thirty tissues by the file's own range, of which four are not there."""
    volume = load(real_volume("frog/frog_tissues.vti"), labels=True)
    found = label_counts(volume)
    assert sorted(set(range(30)) - set(found.labels.tolist())) == [18, 19, 22, 28]
    assert found.counts.tolist() == [int((volume.values == label).sum()) for label in found.labels]
