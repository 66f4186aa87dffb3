"""Control points edited: what they classify afterwards; and the history of a document."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.annotation import Annotation, with_room
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction, preset
from texvol.scene.volume import Volume
from texvol.window.document import Document, Origin, opened_file
from texvol.window.editing import Curve, extinction_of, opacity_of
from texvol.window.histogram import histogram_of
from texvol.window.navigation import View, orbit

COLORS = np.array([(0.1, 0.2, 0.3), (0.9, 0.5, 0.1), (0.2, 0.8, 0.4)])
STRAIGHT = TransferFunction([0.0, 10.0, 20.0], COLORS, [0.0, 0.5, 2.0])
DENSE = np.array([0.0, 0.5, 2.0])
PREMULTIPLIED = TransferFunction([0.0, 10.0, 20.0], COLORS * DENSE[:, None], DENSE, premultiplied=True)
EMISSIVE = TransferFunction([0.0, 10.0, 20.0], 3 * COLORS, DENSE, emissive=True)
OPAQUE = TransferFunction([0.0, 10.0, 20.0], COLORS, [0.0, 0.5, np.inf])
VALUES = np.linspace(-5, 25, 61)
kinds = pytest.mark.parametrize("medium", [STRAIGHT, PREMULTIPLIED, EMISSIVE, OPAQUE])


def same(one: TransferFunction, other: TransferFunction) -> bool:
    return all(
        np.allclose(a, b, rtol=1e-12, atol=1e-12)
        for a, b in zip(one.classify(VALUES), other.classify(VALUES), strict=True)
    )


@kinds
def test_points_that_are_not_edited_stay_what_they_are(medium: TransferFunction) -> None:
    assert same(Curve.of(medium).applied(medium), medium)


@kinds
@given(value=st.floats(-5, 25))
def test_a_point_on_the_curve_changes_the_straight_curve_nowhere(medium: TransferFunction, value: float) -> None:
    curve, index = Curve.of(medium).added(value)
    assert curve.points[index].value == value
    if medium is not PREMULTIPLIED and medium is not OPAQUE:
        assert same(curve.applied(medium), medium)
    elif medium is PREMULTIPLIED:
        assert np.allclose(curve.applied(medium).classify(VALUES).extinction, medium.classify(VALUES).extinction)


@given(st.floats(-100, 100), st.floats(0, 10), st.integers(0, 2))
def test_a_point_goes_no_farther_than_its_neighbours(value: float, extinction: float, index: int) -> None:
    moved = Curve.of(STRAIGHT).moved(index, value, extinction).applied(STRAIGHT)
    assert (np.diff(moved.values) >= 0).all()
    assert moved.extinctions[index] == extinction
    kept = [position for position in range(3) if position != index]
    assert (moved.values[kept] == STRAIGHT.values[kept]).all()


@kinds
def test_another_colour_leaves_the_extinction(medium: TransferFunction) -> None:
    changed = Curve.of(medium).colored(1, (0.3, 0.6, 0.9)).applied(medium)
    assert (changed.extinctions == medium.extinctions).all()
    shown = changed.classify([10.0])
    wanted = np.array([0.3, 0.6, 0.9]) * (1 if medium.emissive else 0.5)
    assert np.allclose(shown.emission[0], wanted)


@given(st.floats(0.01, 100))
def test_denser_matter_is_denser_everywhere(factor: float) -> None:
    for medium in (STRAIGHT, PREMULTIPLIED):
        changed, before = (each.classify(VALUES) for each in (Curve.of(medium).denser(factor).applied(medium), medium))
        assert np.allclose(changed.extinction, factor * before.extinction)
        assert np.allclose(changed.emission, factor * before.emission)


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_another_range_has_the_same_shape(low: float, width: float) -> None:
    changed = Curve.of(STRAIGHT).between(low, low + width).applied(STRAIGHT)
    fractions = np.linspace(-0.2, 1.2, 29)
    assert np.allclose(changed.at(low + width * fractions), STRAIGHT.at(20 * fractions), atol=1e-6)


def test_the_last_point_stays() -> None:
    curve = Curve.of(STRAIGHT)
    for _ in range(5):
        curve = curve.removed(0)
    assert len(curve.points) == 1
    assert curve.points[0].value == 20.0


@given(st.floats(0, 0.9999), st.floats(1e-3, 1e3))
def test_opacity_over_a_length_and_back(opacity: float, length: float) -> None:
    assert opacity_of(extinction_of(opacity, length), length) == pytest.approx(opacity, abs=1e-12)
    assert extinction_of(1.0, length) == np.inf and opacity_of(np.inf, length) == 1


def test_what_depends_on_the_gradient_is_kept() -> None:
    z, y, x = np.mgrid[:16, :16, :16]
    volume = Volume((x**2 + y**2 + z**2).astype(np.float32))
    medium = preset("contours", volume)
    assert medium.contours
    assert Curve.of(medium).denser(2).applied(medium).contours == medium.contours


def document() -> Document:
    volume = Volume(np.arange(27, dtype=np.float32).reshape(3, 3, 3))
    return Document(Scene(volume, STRAIGHT, Camera.framing(volume), classification="slab"), Origin("v.npy"))


def test_a_drag_is_one_step_back() -> None:
    opened = document()
    for brightness in (0.1, 0.2, 0.3):
        opened.change("background", background=(brightness, 0.0, 0.0))
    opened.change("other", background=(0.9, 0.0, 0.0))
    opened.history.end_stroke()
    opened.change("other", background=(1.0, 0.0, 0.0))
    seen = [opened.scene.background[0]]
    while opened.history.past:
        opened.undo()
        seen.append(opened.scene.background[0])
    assert seen == [1.0, 0.9, 0.3, 0.0]
    while opened.history.future:
        opened.redo()
    assert opened.scene.background[0] == 1.0


def test_to_undo_a_colour_does_not_turn_the_picture() -> None:
    opened = document()
    opened.change(background=(1.0, 0.0, 0.0))
    turned = orbit(opened.view, 0.5, 0.2)
    opened.look(turned)
    opened.undo()
    assert opened.scene.background == (0, 0, 0)
    assert opened.scene.camera == turned.camera


def test_a_change_that_makes_no_scene_leaves_the_old_one() -> None:
    opened = document()
    before = opened.scene
    with pytest.raises(ValueError, match="background"):
        opened.change(background=(-1.0, 0.0, 0.0))
    assert opened.scene is before and not opened.history.past


def test_the_scene_is_the_same_object_while_nothing_changes() -> None:
    opened = document()
    before = opened.scene
    opened.look(View(opened.view.camera, (1.0, 2.0, 3.0)))
    assert opened.scene is before
    opened.look(orbit(opened.view, 0.1, 0.0))
    assert opened.scene is not before and opened.scene.volume is before.volume


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_a_histogram_counts_every_value_once(dtype: type) -> None:
    values = np.repeat(np.arange(10), 100).reshape(10, 10, 10).astype(dtype)
    found = histogram_of(Volume(values))
    assert found.counts.sum() == 1000
    assert found.edges.dtype == found.counts.dtype == np.float64
    assert [found.counts[np.searchsorted(found.edges, each, side="right") - 1] for each in range(9)] == [100] * 9


def test_a_histogram_of_one_value_and_of_missing_ones_is_one() -> None:
    for values in (np.full((3, 3, 3), 7.0), np.full((3, 3, 3), np.nan)):
        found = histogram_of(Volume(values))
        assert (np.diff(found.edges) > 0).all()
        for logarithmic in (False, True):
            assert np.isfinite(found.heights(logarithmic)).all()


def test_a_view_that_nobody_changed_makes_room_for_annotation(tmp_path: Path) -> None:
    pytest.importorskip("PIL", reason="letters need the extra: pip install '.[annotation]'")
    np.save(tmp_path / "v.npy", np.arange(27.0).reshape(3, 3, 3))
    size = (400, 300)
    opened = opened_file(str(tmp_path / "v.npy"), size)
    plain, legend = opened.view.camera, Annotation(legend=True)
    opened.annotate(legend, size)
    roomy = opened.view.camera
    assert roomy == with_room(plain, opened.scene, size, legend) != plain
    assert opened.scene.camera == roomy and opened.showing.annotation == legend
    opened.annotate(Annotation(), size)
    assert opened.view.camera == plain, "and takes it back"
    turned = orbit(opened.view, 0.5, 0.2)
    opened.look(turned)
    opened.annotate(legend, size)
    assert opened.view == turned, "what somebody chose stays"


def test_looks_of_labels_are_found_in_their_transfer_function_and_make_it_again() -> None:
    pytest.importorskip("imgui_bundle", reason="the window needs the extra: pip install '.[view]'")
    from texvol.scene.transfer.labels import OPACITY, label_function
    from texvol.window.label_looks import look_of

    values = np.zeros((4, 5, 6), np.uint8)
    values[1:3, 1:3, 1:3], values[3, 4, 5], values[0, 0, 1] = 3, 7, 12
    volume = Volume(values, spacing=(1.5, 0.5, 2.0), labels=True)
    medium = label_function(volume, {3: 1.0, 7: 0.25}, {12: (0.1, 0.2, 0.3)})
    look = look_of(medium, volume)
    # 1 - exp(-τ d) and back costs a few units in the last place.
    assert look.opacities == pytest.approx({0: 0, 3: 1, 7: 0.25, 12: OPACITY}, rel=1e-14)
    assert look.colors[12] == pytest.approx((0.1, 0.2, 0.3), rel=1e-14)
    again = label_function(volume, look.opacities, look.colors)
    assert np.array_equal(again.values, medium.values)
    np.testing.assert_allclose(again.extinctions, medium.extinctions, rtol=1e-14)
    shown = np.flatnonzero(medium.extinctions > 0)
    np.testing.assert_allclose(again.colors[shown], medium.colors[shown], rtol=1e-14)
