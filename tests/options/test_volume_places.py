"""Where masks and further volumes lie: in the world of the first volume, warned of where it can't be, in every step."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from support.scene_lines import scene
from support.scenes import random_volume

from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.provenance.stored_scene import stored_scene_of
from texvol.scene import spaces
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

VALUES = random_volume(1).values
MASK = (random_volume(3).values > 0.5).astype(np.uint8)
IN_ROWS = "1,0,0,2.5,0,1,0,-1,0,0,1,0"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with volumes and a mask."""
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", VALUES)
    np.save("w.npy", random_volume(2, (4, 5, 6)).values)
    np.save("m.npy", MASK)
    return tmp_path


def nrrd(
    name: str, space: str, origin: tuple[float, ...], values: np.ndarray, spacing: tuple[float, ...] = (1, 1, 1)
) -> None:
    """A small NRRD file; a negative spacing runs against the axis."""
    x, y, z = spacing
    lines = (
        *("NRRD0004", "type: float", "dimension: 3", "encoding: raw", "endian: little", f"space: {space}"),
        f"sizes: {' '.join(map(str, values.shape[::-1]))}",
        f"space directions: ({x},0,0) (0,{y},0) (0,0,{z})",
        f"space origin: ({','.join(map(str, origin))})",
    )
    Path(name).write_bytes("\n".join(lines).encode() + b"\n\n" + values.astype("<f4").tobytes())


def test_a_further_volume_is_turned_into_the_world_of_the_first() -> None:
    """The same point of the body: (x, y, z) of left-posterior-superior is (-x, -y, z) of right-anterior-superior."""
    nrrd("ras.nrrd", "right-anterior-superior", (1, 2, 3), VALUES)
    nrrd("lps.nrrd", "left-posterior-superior", (10, 20, 30), VALUES)
    [added] = scene("--add", "lps.nrrd", volume="ras.nrrd").added
    np.testing.assert_array_equal(added.volume.origin, (-10, -20, 30))
    np.testing.assert_array_equal(added.volume.direction, np.diag([-1, -1, 1]))
    [back] = scene("--add", "ras.nrrd", "--add-transform", IN_ROWS, volume="lps.nrrd").added
    np.testing.assert_array_equal(back.volume.origin, (-1 + 2.5, -2 - 1, 3))
    [unsaid] = scene("--add", "lps.nrrd").added  # the first is a .npy, which has no word for that
    np.testing.assert_array_equal(unsaid.volume.origin, (10, 20, 30))


def test_a_world_may_have_its_axes_in_another_order() -> None:
    volume = Volume(VALUES, origin=(1, 2, 3), space="superior-left-anterior")
    np.testing.assert_array_equal(spaces.turned(volume, "right-anterior-superior").origin, (-2, 3, 1))
    assert spaces.turned(volume, "superior-left-anterior") is volume
    assert spaces.turned(volume, "scanner-xyz") is volume


POSITIONS = [  # origin of the mask in voxels from the volume's, and by how many voxels it lies elsewhere
    ((0, 0, 0), None),
    ((0.4, -0.4, 0.4), None),
    ((0, 0, 0.6), "0.6"),
    ((-3, 0, 0), "3"),
]


@pytest.mark.parametrize(("offset", "voxels"), POSITIONS)
@pytest.mark.parametrize("space", ["right-anterior-superior", "left-posterior-superior"])
@pytest.mark.parametrize("moved", [[], ["--transform", "0,2,0,9,2,0,0,8,0,0,2,7"]])
def test_a_mask_that_lies_elsewhere_is_warned_of(
    offset: tuple[float, ...], voxels: str | None, space: str, moved: list[str]
) -> None:
    nrrd("v.nrrd", "right-anterior-superior", (100, 50, 20), VALUES, (3, 3, 3))
    x, y, z = (a + 3 * b for a, b in zip((100, 50, 20), offset, strict=True))
    if space.startswith("left"):  # the same places of the body, in the words of the other world
        nrrd("m.nrrd", space, (-x, -y, z), MASK, (-3, -3, 3))
    else:
        nrrd("m.nrrd", space, (x, y, z), MASK, (3, 3, 3))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene("--mask", "m.nrrd", *moved, volume="v.nrrd")
    assert [f"up to {voxels} voxels away from v.nrrd" in str(each.message) for each in caught] == [True] * bool(voxels)


def test_a_mask_whose_file_says_nothing_of_its_place_is_laid_on_the_volume() -> None:
    nrrd("v.nrrd", "right-anterior-superior", (100, 50, 20), VALUES, (3, 3, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert scene("--mask", "m.npy", volume="v.nrrd").mask is not None
        assert scene("--mask", "m.npy", "--spacing", "2,2,1").mask is not None


def test_a_warning_of_a_mask_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    nrrd("m.nrrd", "right-anterior-superior", (100, 50, 20), MASK)
    assert main(["render", "v.npy", "-o", "a.png", "--size", "8x8", "--mask", "m.nrrd"]) == 0
    said = capsys.readouterr().err
    assert said.startswith("texvol: warning: m.nrrd: the two files place the mask up to 100 voxels away")
    assert said.count("\n") == 1


# Time.


def test_steps_of_a_series_are_moved_and_masked_alike() -> None:
    steps = np.stack([VALUES, VALUES + 1])
    np.save("series.npy", steps)
    line = ["--time", "all", "--transform", IN_ROWS, "--mask", "m.npy", "--add", "w.npy"]
    assert main(["render", "series.npy", "-o", "f_%d.exr", "--size", "12x12", *line]) == 0
    for step in range(2):
        found = stored_scene_of(read_picture(f"f_{step}.exr").attributes, name="f").scene
        np.testing.assert_array_equal(found.volume.values, steps[step])
        np.testing.assert_array_equal(found.volume.origin, (2.5, -1, 0))
        assert found.mask is not None and len(found.added) == 1


def test_labels_of_any_step_have_a_colour() -> None:
    steps = np.zeros((3, 4, 4, 4), np.uint8)
    steps[0, 0, 0, 0], steps[2, 1, 1, 1] = 3, 7
    np.save("series.npy", steps)
    line = ["--time", "all", "--labels", "--label-look", "3=0.5,7=#ff0000:1", "--size", "12x12"]
    assert main(["render", "series.npy", "-o", "f_%d.png", *line]) == 0


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        (np.eye(4)[::-1], "last row"),
        (np.zeros((3, 3)), "last row"),
        (np.zeros(7), "last row"),
        (np.diag([1.0, 1, 0, 1]), "singular"),
        (np.diag([1e300, 1, 1, 1]), "finite|from 1e-90 to 1e90|singular"),
        (np.diag([1e100, 1e100, 1e100, 1]), "from 1e-90 to 1e90"),
        (np.diag([1e-100, 1e-100, 1e-100, 1]), "from 1e-90 to 1e90"),
    ],
)
def test_a_place_that_is_none_is_refused_in_one_line(matrix: np.ndarray, reason: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError, match=reason) as caught:
            random_volume(3).moved(matrix)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("direction", [np.full((3, 3), np.nan), np.zeros((3, 3)), np.zeros((4, 4)), np.zeros(3)])
def test_a_direction_that_is_none_is_refused_in_one_line(direction: np.ndarray) -> None:
    with pytest.raises(InputError, match="direction") as caught:
        Volume(np.zeros((2, 2, 2)), direction=direction)
    assert "\n" not in str(caught.value)
