"""What is where: the probe against closed forms; slices as radiologists look at them; recent files; frame times."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.formats.readers import load
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window import probe, recent, slices, timings
from texvol.window.document import opened_file
from texvol.window.naming import how_read, shortened, volume_called
from texvol.window.recent import Recent
from texvol.window.timings import Frame

# Value = index along x; world x = 10 + 2 i.
RAMP = Volume(
    np.broadcast_to(np.arange(32, dtype=np.float32), (12, 16, 32)).copy(), spacing=(2, 1, 3), origin=(10, -5, 0)
)
STEP = TransferFunction([9.999, 10.0], np.ones((2, 3)), [0.0, 50.0])  # opaque from value 10 on
FROM_LEFT = Camera.orthographic((-100, 2, 15), (0, 2, 15), (0, 0, 1), 40)


def scene(**parts: Any) -> Scene:
    return Scene(RAMP, STEP, FROM_LEFT, **({"classification": "slab"} | parts))


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3))
def test_the_first_visible_matter_is_where_it_begins(across: float, up: float) -> None:
    found = probe.first_medium(scene(), (across, up))
    assert found is not None
    # Value 10 is at x = 30; the extinction of 50 hides all behind within half a sample of the ray.
    assert found[0] == pytest.approx(30, abs=RAMP.smallest_spacing)
    # And on the ray: seen along +x, y grows to the left.
    assert found[1:] == pytest.approx((2 - 20 * across, 15 + 20 * up))


def test_in_perspective_it_is_on_the_ray_too() -> None:
    camera = Camera.perspective((-100, 2, 15), (0, 2, 15), (0, 0, 1), fov=20)
    found = probe.first_medium(replace(scene(), camera=camera), (0.2, 0.1))
    assert found is not None and found[0] == pytest.approx(30, abs=1.5)
    slope = (found - camera.eye) / (found[0] + 100)
    tangent = np.tan(np.radians(10))
    assert slope[1:] == pytest.approx((-0.2 * tangent, 0.1 * tangent))


def test_of_thin_matter_it_is_the_middle_of_its_opacity() -> None:
    depth = 0.01
    fog = TransferFunction([0.0], np.ones((1, 3)), [depth])
    found = probe.first_medium(replace(scene(), transfer_function=fog), (0.0, 0.0))
    length = 64.0
    half = -np.log1p(0.5 * np.expm1(-depth * length)) / depth
    assert found is not None and found[0] == pytest.approx(9 + half, abs=RAMP.smallest_spacing)


def test_what_is_cut_away_is_not_met() -> None:
    cut = scene(clip=(ClipPlane((1, 0, 0), 50.0),))
    found = probe.first_medium(cut, (0.0, 0.0))
    assert found is not None and found[0] == pytest.approx(50, abs=1)
    assert probe.first_medium(scene(clip=(ClipPlane((-1, 0, 0), -20.0),)), (0.0, 0.0)) is None


def test_beside_the_volume_and_behind_the_eye_there_is_nothing() -> None:
    assert probe.first_medium(scene(), (0.9, 0.0)) is None
    behind = replace(FROM_LEFT, eye=(100, 2, 15), target=(200, 2, 15))
    assert probe.first_medium(replace(scene(), camera=behind), (0.0, 0.0)) is None
    clear = TransferFunction([0.0], np.ones((1, 3)), [0.0])
    assert probe.first_medium(replace(scene(), transfer_function=clear), (0.0, 0.0)) is None


def test_of_an_isosurface_it_is_the_surface() -> None:
    surface = Scene(RAMP, None, FROM_LEFT, mode="isosurface", isovalue=20.5, classification="slab")
    found = probe.first_medium(surface, (0.0, 0.0))
    assert found is not None and found[0] == pytest.approx(51, abs=0.5)


def test_a_point_has_its_value_and_extinction() -> None:
    found = probe.at_point(scene(), np.array([10 + 2 * 12.25, 0.0, 6.0]))
    assert found.value == pytest.approx(12.25) and found.extinction == 50
    assert np.isnan(probe.at_point(scene(), np.array([0.0, 0.0, 6.0])).value)


@given(st.tuples(st.floats(0, 31), st.floats(0, 15), st.floats(0, 11)))
def test_between_samples_values_are_trilinear(index: tuple[float, float, float]) -> None:
    z, y, x = np.mgrid[:12, :16, :32].astype(float)
    # Trilinear itself, and so interpolated exactly.
    volume = Volume(1 + 2 * x - y + 0.5 * z + 0.1 * x * y - 0.03 * x * y * z, spacing=(2, 1, 3), origin=(10, -5, 0))
    i, j, k = index
    point = volume.origin + volume.world_from_index @ np.array(index)
    wanted = 1 + 2 * i - j + 0.5 * k + 0.1 * i * j - 0.03 * i * j * k
    assert probe.sampled(volume, point[np.newaxis])[0] == pytest.approx(wanted, abs=1e-9)


def marked(space: str, direction: Any) -> Volume:
    """Value 1 in the half to x > 0 of the world, 10 to y > 0, 100 to z > 0, added up."""
    count = 8
    direction = np.array(direction, float)
    index = np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), axis=-1) - (count - 1) / 2
    world = index @ direction.T
    values = (world > 0) @ np.array([1.0, 10.0, 100.0])
    return Volume(np.moveaxis(values, (0, 1, 2), (2, 1, 0)), direction=direction, space=space)


GRIDS = [np.eye(3), [[0, -1, 0], [0, 0, 1], [1, 0, 0]], [[-1, 0, 0], [0, 1, 0], [0, 0, -1]]]
LEFT_AT = {"left-posterior-superior": 1, "right-anterior-superior": -1}


@pytest.mark.parametrize("direction", GRIDS)
@pytest.mark.parametrize("space", ["left-posterior-superior", "right-anterior-superior", ""])
def test_slices_show_left_on_the_right_and_anterior_and_superior_up(space: str, direction: Any) -> None:
    volume = marked(space, direction)
    left = LEFT_AT.get(space, 1)
    posterior = LEFT_AT.get(space, 1)

    def bit(values: Any, power: int) -> Any:
        return (values // 10**power % 10).astype(int)

    found = slices.slices_of(volume)
    axial = found["axial"].values(volume, 1)
    assert (bit(axial, 0)[:, -1] == (left > 0)).all() and (bit(axial, 0)[:, 0] == (left < 0)).all()
    assert (bit(axial, 1)[-1] == (posterior > 0)).all() and (bit(axial, 1)[0] == (posterior < 0)).all()
    coronal = found["coronal"].values(volume, 1)
    assert (bit(coronal, 0)[:, -1] == (left > 0)).all()
    assert (bit(coronal, 2)[0] == 1).all() and (bit(coronal, 2)[-1] == 0).all()
    sagittal = found["sagittal"].values(volume, 1)
    assert (bit(sagittal, 1)[:, -1] == (posterior > 0)).all()
    assert (bit(sagittal, 2)[0] == 1).all()
    # Left, right, top and bottom; of a volume that does not say what its axes point to nothing is claimed.
    letters = {name: slices.letters_of(volume, each) for name, each in found.items()}
    said = {"axial": tuple("RLAP"), "coronal": tuple("RLSI"), "sagittal": tuple("APSI")}
    assert letters == (said if space else dict.fromkeys(said))


@pytest.mark.parametrize("direction", GRIDS)
@given(st.tuples(*[st.floats(0, 7)] * 3))
def test_the_crosshair_is_over_its_sample(direction: Any, index: tuple[float, float, float]) -> None:
    volume = marked("", direction)
    i, j, k = np.rint(index).astype(int)
    at_border = any(abs(each - np.rint(each)) > 0.499 for each in index)
    for slice_ in slices.slices_of(volume).values():
        right, down = slice_.fractions(volume, np.array(index))
        assert 1 / 16 - 1e-12 <= min(right, down) <= max(right, down) <= 15 / 16 + 1e-12  # half a sample from the rim
        row, column = int(down * 8), int(right * 8)
        shown = slice_.values(volume, round(index[slice_.axis]))[row, column]
        assert at_border or shown == volume.values[k, j, i]


def test_a_window_goes_from_black_to_white() -> None:
    levels = slices.grey(np.array([-1.0, 0.0, 5.0, 10.0, 11.0, np.nan]), (5.0, 10.0))
    assert levels.tolist() == [0, 0, 128, 255, 255, 0] and levels.dtype == np.uint8


def test_recent_files_are_the_latest_first_and_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    assert recent.files() == []
    paths = [tmp_path / f"{number}.npy" for number in range(12)]
    for path in paths:
        path.touch()
        recent.add(str(path), {})
    recent.add(str(paths[5]), {})
    wanted = [paths[5], *(path for path in reversed(paths) if path != paths[5])]
    assert recent.files() == [Recent(str(path)) for path in wanted[:10]]
    paths[5].unlink()
    assert Recent(str(paths[5])) not in recent.files()
    for text in ("{", "7", '[7, {"path": 7}, {"path": "/", "shout": 1}]'):
        recent.state_file().write_text(text)
        assert recent.files() == []


def test_recent_files_are_read_as_they_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path = str(tmp_path / "v.raw")
    np.arange(2 * 3 * 4, dtype=">i2").tofile(path)
    given: dict[str, Any] = {"shape": (4, 3, 2), "dtype": ">i2", "spacing": (1.0, 2.0, 3.0), "labels": True}
    recent.add(path, how_read(load(path, **given).source))
    recent.add(path, how_read(load(path, **(given | {"labels": False})).source))
    other, found = recent.files()
    assert (found.text, other.text) == ("v.raw, shape 4x3x2, dtype >i2, labels", "v.raw, shape 4x3x2, dtype >i2")
    volume = opened_file(found.path, (64, 48), found.how).scene.volume
    assert volume.labels and volume.values[1, 2, 3] == 23 and volume.spacing.tolist() == [1, 2, 3]
    assert not opened_file(other.path, (64, 48), other.how).scene.volume.labels
    recent.add(path, how_read(volume.source))
    assert recent.files() == [found, other], "the same again is the same entry"


def test_recent_files_are_called_without_their_time_step() -> None:
    further = {"file": "b.nii", "channel": 1, "time": 3}
    assert Recent("/a.nii", {"time": 0, "channel": 2, "add": [further]}).text == "a.nii, channel 2 + b.nii, channel 1"


def test_recent_files_name_a_file_of_several_channels_once() -> None:
    two, three = ({"file": "/a/cell.tif", "channel": number} for number in (1, 2))
    other = {"file": "/b/cell.tif", "channel": 2}
    assert Recent("/a/cell.tif", {"channel": 0, "add": [two, three]}).text == "cell.tif, channels 0, 1, 2"
    assert Recent("/a/cell.tif", {"channel": 0, "add": [other, two]}).text == (
        "cell.tif, channels 0, 1 + cell.tif, channel 2"
    )
    twice = {"file": "/a/cell.tif", "variable": "b", "channel": 1}
    assert Recent("/a/cell.tif", {"variable": "a", "channel": 0, "add": [twice]}).text == (
        "cell.tif, variable a, channel 0 + cell.tif, variable b, channel 1"
    )
    assert Recent("/a/cell.tif", {"add": [{"file": "/a/cell.tif"}]}).text == "cell.tif + cell.tif"


def test_arrays_that_are_shown_are_no_recent_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    recent.remember("volume", Scene(Volume(np.zeros((2, 2, 2)))))
    assert recent.files() == []


def test_channels_of_one_file_are_told_apart() -> None:
    name = "/somewhere/xyzc_16bit__dna_conf_wf.tif"
    one, two = (Volume(np.zeros((2, 2, 2)), name=name, source={"path": name, "channel": n}) for n in (0, 1))
    assert volume_called(one) == "channel 0, xyzc_16bit__dna_conf_wf.tif"
    short = [volume_called(each, 12) for each in (one, two)]
    assert short == ["channel 0, xyzc_1…f.tif", "channel 1, xyzc_1…f.tif"]


@given(st.text(max_size=30), st.integers(1, 30))
def test_a_text_is_shortened_no_more_than_needed(text: str, most: int) -> None:
    found = shortened(text, most)
    assert len(found) == min(len(text), most)
    head = most // 2
    if found != text:
        assert found[head] == "…" and text.startswith(found[:head]) and text.endswith(found[head + 1 :])


def test_a_table_of_frame_times_has_a_line_for_each(tmp_path: Path) -> None:
    frame = Frame(0.5, 0.016, 0.004, 3, 0.03, 0.02, "moving", 400, 300, 0.5, "start")
    timings.write(tmp_path / "t.csv", [frame])
    first, second = (tmp_path / "t.csv").read_text().splitlines()
    assert first == "time,seconds,work,picture,picture_seconds,delay,state,width,height,sampling_rate,mark"
    assert second == "0.5,0.016,0.004,3,0.03,0.02,moving,400,300,0.5,start"
