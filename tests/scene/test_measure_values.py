"""Values of measures against closed forms, on anisotropic, rotated, mirrored and sheared grids."""

from __future__ import annotations

import csv
import io
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.annotated import DIRECTIONS
from support.large import large

import texvol
from texvol.scene.label_table import LabelEntry, LabelTable
from texvol.scene.measures import inside
from texvol.scene.measures.inside import statistics_inside
from texvol.scene.measures.measure import Measure, called
from texvol.scene.measures.table import COLUMNS, csv_of, csv_of_profile
from texvol.scene.measures.values import measure, measured_labels, names_of, profile_of
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SLOPE, OFFSET = np.array([0.3, -1.7, 0.9]), 12.5
MATRIX = np.array([[0.0, -1.2, 0.1, 5.0], [1.1, 0.2, 0.0, -7.0], [0.3, 0.0, 0.9, 2.0], [0, 0, 0, 1]])
grids = pytest.mark.parametrize("direction", DIRECTIONS)
numbers = st.floats(-1e3, 1e3)
points = st.tuples(numbers, numbers, numbers)


def positions(volume: Volume) -> np.ndarray:
    """World positions of all samples, shape (nz, ny, nx, 3), from the definition."""
    z, y, x = np.indices(volume.shape)
    index = np.stack([x, y, z], axis=-1) * volume.spacing
    return volume.origin + index @ volume.direction.T


def grid(direction: str = "straight", **how: Any) -> Volume:
    """A volume of random values."""
    values = np.random.default_rng(3).normal(100, 20, (9, 11, 13))
    return Volume(values, (0.7, 1.3, 2.1), (-4.0, 30.0, 11.0), DIRECTIONS[direction], unit="mm", value_unit="HU", **how)


def linear(direction: str) -> Volume:
    """A volume whose values are linear in the world."""
    empty = grid(direction)
    values = positions(empty) @ SLOPE + OFFSET
    return Volume(values, empty.spacing, empty.origin, empty.direction, name="linear.nrrd")


@given(points, points)
@settings(deadline=None)
def test_a_ruler_has_the_distance_of_its_ends(one: Any, other: Any) -> None:
    (found,) = measure(grid(), [Measure("ruler", (one, other))])
    assert found.value("length") == pytest.approx(np.sqrt(sum((a - b) ** 2 for a, b in zip(one, other, strict=True))))
    assert [(each.what, each.unit) for each in found.quantities] == [("length", "mm")]


@pytest.mark.parametrize("degrees", [0.0, 1e-6, 30.0, 90.0, 179.999999, 180.0])
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_an_angle_keeps_its_digits_however_small_and_wherever_it_points(degrees: float, size: float) -> None:
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    radians = np.radians(degrees)
    arms = np.array([(5.0, 0, 0), (2 * np.cos(radians), 2 * np.sin(radians), 0)]) @ turn.T * size
    (found,) = measure(grid(), [Measure("angle", (arms[0], (0, 0, 0), arms[1]))])  # type: ignore[arg-type]
    # Coordinates are rounded to 2^-53 of the arms: by so many degrees the angle is known.
    assert found.value("angle") == pytest.approx(degrees, abs=2e-14)


def test_an_angle_without_an_arm_is_not_a_number() -> None:
    (found,) = measure(grid(), [Measure("angle", ((1, 2, 3), (1, 2, 3), (0, 0, 0)))])
    assert np.isnan(found.value("angle"))
    assert ",angle,,,angle,,°," in csv_of([found])


@grids
def test_a_profile_of_a_linear_field_is_exact_to_rounding(direction: str) -> None:
    volume = linear(direction)
    corner = volume.origin + volume.world_from_index @ (np.array(volume.dimensions) - 1)
    line = Measure("profile", (tuple(volume.origin), tuple(corner)), samples=101)  # type: ignore[arg-type]
    profile = profile_of([volume], line)
    wanted = profile.points @ SLOPE + OFFSET
    # Ends may be outside by rounding of the index, which the half spacing at the border allows for.
    np.testing.assert_allclose(profile.values[0], wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())
    np.testing.assert_allclose(np.diff(profile.distances), profile.distances[-1] / 100, rtol=1e-12)
    assert profile.distances[-1] == pytest.approx(np.linalg.norm(corner - volume.origin), rel=1e-15)


@grids
def test_a_profile_has_the_values_of_every_volume_in_the_world_to_which_it_was_moved(direction: str) -> None:
    volume = linear(direction)
    moved = volume.moved(MATRIX)
    # The moved field is linear as well: f(M⁻¹ x).
    inverse = np.linalg.inv(MATRIX)
    ends = tuple(moved.centre), tuple(moved.centre + 0.2 * moved.box_edges[:, 1])
    profile = profile_of([volume, moved], Measure("profile", ends, samples=9))  # type: ignore[arg-type]
    (first, second), where = profile.values, profile.points
    wanted = (where @ inverse[:3, :3].T + inverse[:3, 3]) @ SLOPE + OFFSET
    np.testing.assert_allclose(second, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())
    known = np.isfinite(first)
    np.testing.assert_allclose(first[known], (where @ SLOPE + OFFSET)[known], rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_outside_a_volume_a_profile_has_no_value() -> None:
    volume = linear("straight")
    x, y, z = volume.origin
    line = Measure("profile", ((x - 7.0, y, z), (x + 7.0, y, z)), samples=21)  # 0.7 apart, as the samples
    (values,) = profile_of([volume], line).values
    assert np.isnan(values[:10]).all() and np.isfinite(values[10:]).all()


def test_a_profile_has_as_many_points_as_samples_lie_on_such_a_length() -> None:
    volume = Volume(np.zeros((5, 5, 5)), (1.0, 2.0, 3.0))
    finer = Volume(np.zeros((5, 5, 5)), (1.0, 1.0, 1.0))
    line = Measure("profile", ((0, 0, 0), (0, 0, 10)))
    assert len(profile_of([volume], line).distances) == 6  # 2 apart
    assert len(profile_of([volume, finer], line).distances) == 11
    assert len(profile_of([volume], Measure("profile", line.points, samples=4)).distances) == 4


@grids
def test_a_box_has_the_samples_whose_positions_lie_in_it(direction: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inside, "_PART", 50)  # so that parts are combined
    volume = grid(direction)
    low, high = volume.centre - (3.1, 4.23, 6.37), volume.centre + (2.2, 5.31, 4.43)  # no sample is on a face
    where = positions(volume)
    chosen = volume.values[((where >= low) & (where <= high)).all(axis=-1)]
    assert 30 < chosen.size < volume.size
    (found,) = measure(volume, [Measure("box", (tuple(low), tuple(high)))])  # type: ignore[arg-type]
    name = names_of([volume])[0]
    assert found.value("samples", name) == chosen.size
    assert found.value("volume") == pytest.approx(np.prod(high - low))
    for what, wanted in (
        ("mean", chosen.mean()), ("standard deviation", chosen.std()), ("min", chosen.min()), ("max", chosen.max())
    ):  # fmt: skip
        assert found.value(what, name) == pytest.approx(wanted, rel=1e-13)
    assert {each.unit for each in found.quantities if each.what in ("mean", "min")} == {"HU"}


def test_corners_of_a_box_may_come_in_any_order() -> None:
    volume = grid("oblique")
    low, high = tuple(volume.centre - 3), tuple(volume.centre + 3)
    crossed = Measure("box", ((low[0], high[1], high[2]), (high[0], low[1], low[2])))  # type: ignore[arg-type]
    (one, other) = measure(volume, [Measure("box", (low, high)), crossed])  # type: ignore[arg-type]
    assert [each.value for each in one.quantities] == [each.value for each in other.quantities]


def test_samples_on_the_faces_are_inside_whatever_the_rounding() -> None:
    volume = Volume(np.arange(1000.0).reshape(10, 10, 10), (0.1, 0.1, 0.1), (0.3, 0.7, 1e6))
    # 0.3 + 0.1 * 3 is not 0.6 in floating point, nor is the rest what it should be.
    found = statistics_inside(volume, np.array((0.3, 0.7, 1e6)), np.array((0.6, 1.1, 1e6 + 0.2)))
    assert found.count == 4 * 5 * 3


def test_statistics_keep_their_digits_far_from_zero() -> None:
    values = 1e9 + np.random.default_rng(0).normal(0, 1, (8, 16, 16))
    volume = Volume(values)
    found = statistics_inside(volume, np.zeros(3), np.full(3, 20.0))
    # A sum of squares would lose all: its terms are 1e18, and float64 has 16 digits. Values are rounded to 1e-7.
    assert found.deviation == pytest.approx(np.std(values - 1e9), rel=1e-6)


def test_missing_samples_do_not_count() -> None:
    values = np.ones((2, 3, 4))
    values[0, 0, :2] = np.nan, np.inf
    (found,) = measure(Volume(values, name="v"), [Measure("box", ((-9, -9, -9), (9, 9, 9)))])
    assert found.value("samples", "v") == 22 and found.value("missing samples", "v") == 2
    assert found.value("mean", "v") == 1 and found.value("standard deviation", "v") == 0


def test_an_empty_box_has_no_samples_and_no_mean() -> None:
    (found,) = measure(grid(name="v"), [Measure("box", ((900, 900, 900), (901, 901, 901)))])
    assert found.value("samples", "v") == 0 and np.isnan(found.value("mean", "v"))


@grids
def test_labels_have_their_samples_and_the_volume_that_these_fill(direction: str) -> None:
    values = np.zeros((4, 5, 6), np.uint8)
    values[1:3, 1:4, 2:5] = 7
    volume = Volume(values, (0.5, 2.0, 3.0), direction=DIRECTIONS[direction], unit="mm", labels=True, name="a/seg.nrrd")
    (found,) = measured_labels([grid(), volume])
    # A sample fills the parallelepiped of the steps between samples.
    one = abs(np.linalg.det(DIRECTIONS[direction] * (0.5, 2.0, 3.0)))
    assert found.value("samples", "seg.nrrd", 7) == 18 and found.value("samples", "seg.nrrd", 0) == 102
    assert found.value("volume", "seg.nrrd", 7) == pytest.approx(18 * one, rel=1e-14)
    assert {each.unit for each in found.quantities if each.what == "volume"} == {"mm³"}


def test_a_box_counts_labels_and_has_no_mean_of_them() -> None:
    values = np.zeros((4, 4, 4), np.int16)
    values[:2] = 5
    volume = Volume(values, unit="mm", labels=True, name="seg")
    (found,) = measure(volume, [Measure("box", ((0, 0, 1), (3, 3, 3)))])
    assert found.value("samples", "seg", 5) == 16 and found.value("samples", "seg", 0) == 32
    assert found.value("volume", "seg", 5) == 16
    with pytest.raises(KeyError):
        found.value("mean", "seg")


def test_labels_have_their_names_in_quantities_and_tables() -> None:
    values = np.zeros((4, 4, 4), np.uint8)
    values[:2], values[3] = 5, 6
    volume = Volume(values, labels=True, name="seg")
    volume.label_table = LabelTable({5: LabelEntry("left lobe, upper"), 9: LabelEntry("not here")})
    results = [*measure(volume, [Measure("box", ((0, 0, 0), (3, 3, 3)))]), *measured_labels([volume])]
    for each in results:
        names = {(quantity.label, quantity.label_name) for quantity in each.quantities if quantity.label is not None}
        assert names == {(0, ""), (5, "left lobe, upper"), (6, "")}
    rows = list(csv.DictReader(io.StringIO(csv_of(results))))
    assert {row["label name"] for row in rows if row["label"] == "5"} == {"left lobe, upper"}
    assert {row["label name"] for row in rows if row["label"] != "5"} == {""}
    volume = Volume(values, labels=True, name="seg")
    volume.label_table = LabelTable({9: LabelEntry("not here"), 5: LabelEntry("five")}, found=True)
    assert {each.label_name for each in measured_labels([volume])[0].quantities} == {"", "five"}, "one of two"
    volume = Volume(values + (values == 6), labels=True, name="seg")
    volume.label_table = LabelTable({1: LabelEntry("not here")}, found=True)
    assert {each.label_name for each in measured_labels([volume])[0].quantities} == {""}, "the table is of other things"


@pytest.mark.parametrize("found", [False, True])
def test_labels_of_a_store_have_names_though_memory_has_no_room_for_all_of_them(found: bool) -> None:
    values = np.repeat(np.arange(4, dtype=np.uint8), 512).reshape(32, 8, 8)
    store, _ = large(Volume(values, name="seg"), memory=1000)
    store.labels, store.label_table = True, LabelTable({1: LabelEntry("one"), 3: LabelEntry("three")}, found=found)
    (all_of_it,) = measured_labels([store])
    assert {each.label_name for each in all_of_it.quantities} == {"", "one", "three"}


def test_a_store_is_measured_as_the_same_samples_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inside, "_PART_READ", 3000)
    monkeypatch.setattr("texvol.scene.sampling._MOST_READ", 2000)
    values = np.random.default_rng(2).integers(0, 99, (40, 30, 50)).astype(np.int16)
    volume = Volume(values, (0.7, 0.8, 2.0), (5, 6, 7), DIRECTIONS["oblique"], name="v")
    store, (source, *_) = large(volume)
    ends = tuple(volume.origin), tuple(volume.centre * 1.3)
    measures = [Measure("box", ends), Measure("profile", ends, samples=77)]  # type: ignore[arg-type]
    here, there = measure(volume, measures), measure(store, measures)
    assert source.bytes_read > 0
    assert [each.value for each in here[0].quantities] == [each.value for each in there[0].quantities]
    assert here[1].profile is not None and there[1].profile is not None
    np.testing.assert_allclose(here[1].profile.values, there[1].profile.values, rtol=0, atol=1e-11, equal_nan=True)
    assert np.isfinite(here[1].profile.values).any()


def test_tables_have_all_digits_and_empty_fields_where_nothing_is() -> None:
    volume = linear("oblique")
    x, y, z = volume.origin
    line = Measure("profile", ((x, y, z), (x - 900, y, z)), "a, line", samples=2)
    results = measure(volume, [Measure("ruler", ((0, 0, 0), (1, 1, 1))), line])
    rows = list(csv.DictReader(io.StringIO(csv_of(results, "mm"))))
    assert tuple(rows[0]) == COLUMNS
    assert float(rows[0]["value"]) == np.sqrt(3)
    ends = [row for row in rows if row["name"] == "a, line" and row["quantity"] == "point 1"]
    assert [float(ends[0][axis]) for axis in "xyz"] == [x, y, z]
    first, last = (row for row in rows if row["quantity"] == "value")
    assert float(first["value"]) == results[1].profile.values[0, 0]  # type: ignore[union-attr]
    assert last["value"] == "" and float(last["distance"]) == 900
    wide = list(csv.reader(io.StringIO(csv_of_profile(results[1].profile, "mm"))))  # type: ignore[arg-type]
    assert wide[0] == ["distance (mm)", "x (mm)", "y (mm)", "z (mm)", "linear.nrrd"]
    assert wide[2] == ["900.0", repr(float(x - 900)), repr(float(y)), repr(float(z)), ""]


def test_names_tell_measures_and_volumes_apart() -> None:
    ruler = Measure("ruler", ((0, 0, 0), (1, 0, 0)))
    angle = Measure("angle", ((0, 0, 0), (1, 0, 0), (1, 1, 0)), "knee")
    assert called([ruler, angle, ruler]) == ["ruler 1", "knee", "ruler 2"]
    assert names_of([grid(name="a/v.nrrd"), grid(name="b/v.nrrd"), grid(name="w")]) == ("v.nrrd", "v.nrrd (2)", "w")


@pytest.mark.parametrize(
    "wrong, said",
    [
        ({"kind": "rod", "points": ()}, "kind must be one of ruler, angle, box, profile, got 'rod'"),
        ({"kind": "ruler", "points": ((0, 0, 0),)}, "ruler must have 2 points of three numbers"),
        ({"kind": "box", "points": ((0, 0, 0), (0, 0, np.inf))}, "points must be finite"),
        ({"kind": "ruler", "points": ((0, 0, 0), (0, 0, 1e300))}, "points must be finite and nearer than 1e+100"),
        ({"kind": "box", "points": "ab"}, "box must have 2 points of three numbers, got 'ab'"),
        ({"kind": "ruler", "points": ((0, 0, 0), (0, 0, 1)), "samples": 4}, "samples are of a profile, got 4"),
        ({"kind": "profile", "points": ((0, 0, 0), (0, 0, 1)), "samples": 1}, "samples must be a number from 2"),
        ({"kind": "ruler", "points": ((0, 0, 0), (0, 0, 1)), "name": 3}, "name must be a string, got 3"),
        ({"kind": "ruler", "points": ((0, 0, 0), (0, 0, 1)), "shown": 1}, "shown must be true or false, got 1"),
    ],
)
def test_what_is_no_measure_is_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match="^measure: ") as caught:
        Measure(**wrong)
    assert said in str(caught.value)


def test_measures_are_of_the_public_names() -> None:
    ruler = texvol.Measure("ruler", ((0, 0, 0), (3, 4, 0)))
    assert texvol.measure(texvol.Scene(grid()), [ruler])[0].value("length") == 5
    with pytest.raises(InputError, match="measures must be a Measure, got str"):
        texvol.measure(grid(), ["ruler"])  # type: ignore[list-item]
