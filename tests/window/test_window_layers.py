"""Colours and opacity of a transfer function, edited apart; colour maps and shapes that they are taken from."""

from __future__ import annotations

import gc
import json
import weakref
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.scene.display import straight_colors
from texvol.scene.transfer import TransferFunction, adjusting, preset
from texvol.scene.volume import Volume
from texvol.util.color import srgb_from_linear
from texvol.window import color_maps, lineage, opacity_shapes
from texvol.window.choosing import chosen_map, colored, map_of, with_opacity_of
from texvol.window.color_maps import MapChoice
from texvol.window.layers import Layers

COLORS = np.array([(0.1, 0.2, 0.3), (0.9, 0.5, 0.1), (0.2, 0.8, 0.4)])
STRAIGHT = TransferFunction([0.0, 10.0, 20.0], COLORS, [0.0, 0.5, 2.0])
STEPPED = TransferFunction([0.0, 10.0, 10.0, 20.0], COLORS[[0, 0, 1, 2]], [0.1, 0.5, 1.5, 2.0])
OPAQUE = TransferFunction([0.0, 10.0, 20.0], COLORS, [0.0, 0.5, np.inf])
PREMULTIPLIED = TransferFunction(
    [0.0, 10.0, 20.0], COLORS * np.array([[0.0], [0.5], [2.0]]), [0.0, 0.5, 2.0], premultiplied=True
)
EMISSIVE = TransferFunction([0.0, 10.0, 20.0], 3 * COLORS, [0.0, 0.5, 2.0], emissive=True)
# Between all points and steps, and not on them: sides of a step differ.
VALUES = np.linspace(-5, 25, 500)
kinds = pytest.mark.parametrize("medium", [STRAIGHT, STEPPED, OPAQUE, PREMULTIPLIED])


def named(name: str, **how: object) -> MapChoice:
    return replace(MapChoice(name, color_maps.map_stops(name)), **how)  # type: ignore[arg-type]


@kinds
@pytest.mark.parametrize("choice", [named("viridis"), named("vik", reversed=True), named("hot", levels=5)])
def test_another_colour_map_leaves_the_opacity_and_sets_the_colours(
    medium: TransferFunction, choice: MapChoice
) -> None:
    found = colored(medium, choice)
    np.testing.assert_allclose(found.at(VALUES)[:, 3], medium.at(VALUES)[:, 3], rtol=1e-12)
    inside = VALUES[(VALUES > 0) & (VALUES < 20)]
    wanted = [color_maps.color_at(choice.shown, value / 20) for value in inside]
    np.testing.assert_allclose(straight_colors(found, inside), wanted, atol=1e-9)


@kinds
def test_a_map_after_another_is_as_if_it_were_the_first(medium: TransferFunction) -> None:
    once = colored(medium, named("magma"))
    twice = colored(colored(colored(medium, named("turbo", levels=7)), named("viridis")), named("magma"))
    assert len(twice.values) == len(once.values)
    np.testing.assert_allclose(twice.at(VALUES), once.at(VALUES), rtol=1e-12)


def test_a_medium_that_emits_takes_the_hues_and_stays_as_bright() -> None:
    found = colored(EMISSIVE, named("inferno"))
    before, after = EMISSIVE.at(VALUES), found.at(VALUES)
    np.testing.assert_allclose(after[:, 3], before[:, 3], rtol=1e-12)
    strongest = [numbers.max(axis=1) for numbers in (found.colors, EMISSIVE.at(found.values)[:, :3])]
    np.testing.assert_allclose(strongest[0], strongest[1], rtol=1e-12)
    again = colored(found, named("inferno"))
    np.testing.assert_allclose(again.at(VALUES), after, rtol=1e-9, atol=1e-12)


def test_parts_that_depend_on_the_gradient_take_the_colours_as_well() -> None:
    z, y, x = np.mgrid[:16, :16, :16]
    medium = preset("contours", Volume((x**2 + y**2 + z**2).astype(np.float32)))
    found = colored(medium, named("viridis"))
    low, high = adjusting.ends(medium)
    assert found.contours
    for before, after in zip(medium.contours, found.contours, strict=True):
        assert (after.value, after.thickness, after.extinction) == (before.value, before.thickness, before.extinction)
        wanted = color_maps.color_at(color_maps.map_stops("viridis"), (after.value - low) / (high - low))
        np.testing.assert_allclose(np.array(after.emission) / after.extinction, wanted, atol=1e-9)


@pytest.mark.parametrize("name", color_maps.NAMES)
def test_few_stops_are_a_map(name: str) -> None:
    from cmap import Colormap

    stops = color_maps.map_stops(name)
    assert (stops[0][0], stops[-1][0]) == (0, 1) and len(stops) < 40
    fractions = np.linspace(0, 1, 129)
    shown = srgb_from_linear(np.array([color_maps.color_at(stops, each) for each in fractions]))
    library = {"grey": "matlab:gray", "coolwarm": "matplotlib:coolwarm"}.get(name, name)
    wanted = np.asarray(Colormap(library)(fractions))[:, :3]
    assert np.abs(shown - wanted).max() <= 1 / 64 + 1e-6


def test_maps_are_reversed_and_in_steps() -> None:
    stops = color_maps.map_stops("viridis")
    backwards = named("viridis", reversed=True).shown
    for fraction in np.linspace(0, 1, 33):
        there = color_maps.color_at(stops, 1 - fraction, left=True)
        np.testing.assert_allclose(color_maps.color_at(backwards, fraction), there, atol=1e-12)
    stepped = named("viridis", levels=4).shown
    seen = [tuple(color_maps.color_at(stepped, (number + 0.5) / 4)) for number in range(4)]
    assert len(set(seen)) == 4
    assert seen[0] == stops[0][1] and seen[3] == stops[-1][1]
    assert tuple(color_maps.color_at(stepped, 0.25)) == seen[1] != seen[0]
    assert tuple(color_maps.color_at(stepped, 0.25, left=True)) == seen[0]


@kinds
@pytest.mark.parametrize("shape", opacity_shapes.SHAPES)
def test_another_shape_leaves_the_colours(medium: TransferFunction, shape: str) -> None:
    found = opacity_shapes.shaped(medium, shape, 1.0)
    inside = VALUES[(VALUES > 0.1) & (VALUES < 19.9)]
    if medium is not PREMULTIPLIED:  # whose colours are no lines between the points
        np.testing.assert_allclose(straight_colors(found, inside), straight_colors(medium, inside), atol=1e-9)
    most = medium.extinctions[np.isfinite(medium.extinctions)].max()
    rows, _ = opacity_shapes.SHAPES[shape]
    for at, fraction in rows:
        beside = at * 20 + (1e-9 if at < 1 and (at, fraction) != rows[1] else -1e-9)
        assert found.at(beside)[3] == pytest.approx(most * fraction, abs=1e-6)
    assert found.extinctions.max() == pytest.approx(most)


def test_a_shape_shows_what_was_clear() -> None:
    clear = TransferFunction([3.0], [(1, 1, 1)], [0.0])
    found = opacity_shapes.shaped(clear, "ramp", 2.0)
    assert found.values[0] < found.values[-1]
    assert 1 - np.exp(-2 * found.extinctions.max()) == pytest.approx(0.5)


def test_an_opacity_of_another_look_comes_without_its_colours() -> None:
    from texvol.scene.looks import Look

    other = TransferFunction([5.0, 30.0], [(0, 0, 0), (0, 0, 0)], [1.0, 4.0])
    found = with_opacity_of(STRAIGHT, Look(other))
    np.testing.assert_allclose(found.at(VALUES)[:, 3], other.at(VALUES)[:, 3], rtol=1e-12)
    np.testing.assert_allclose(found.at(VALUES)[:, :3], STRAIGHT.at(VALUES)[:, :3], rtol=1e-12, atol=1e-12)
    choice = map_of("look other", Look(OPAQUE), chosen_map(found))
    assert choice.name == "other"
    np.testing.assert_allclose([color for _, color in choice.stops], COLORS)


@given(st.floats(0.5, 19.5), st.floats(0, 10))
def test_a_point_moves_over_the_colours(value: float, extinction: float) -> None:
    medium = colored(opacity_shapes.shaped(STRAIGHT, "peak", 1.0), named("viridis"))
    layers = lineage.layers_of(medium)
    assert len(layers.curve.points) == 3
    moved = layers.with_curve(layers.curve.moved(1, value, extinction)).applied(medium)
    np.testing.assert_allclose(moved.at(VALUES)[:, :3], medium.at(VALUES)[:, :3], atol=1e-9)
    assert moved.at(value)[3] == pytest.approx(extinction, abs=1e-9)


def test_a_point_of_a_preset_takes_its_colour_along() -> None:
    layers = lineage.layers_of(STRAIGHT)
    moved = layers.with_curve(layers.curve.moved(1, 15.0, 0.7)).applied(STRAIGHT)
    np.testing.assert_allclose(moved.at(15.0), [*COLORS[1], 0.7])


def test_a_colour_at_a_point_is_one_more_stop() -> None:
    medium = colored(STRAIGHT, named("viridis"))
    layers = lineage.layers_of(medium)
    found = layers.colored(1, (1.0, 0.0, 0.5))
    applied = found.applied(medium)
    np.testing.assert_allclose(applied.at(10.0)[:3], (1.0, 0.0, 0.5))
    np.testing.assert_allclose(applied.at(VALUES)[:, 3], medium.at(VALUES)[:, 3], rtol=1e-12)


@pytest.mark.parametrize("choice", [named("viridis"), named("hot", levels=5)])
def test_layers_are_found_again_in_what_was_saved(choice: MapChoice) -> None:
    medium = colored(opacity_shapes.shaped(STRAIGHT, "plateau", 1.0), choice)
    again = TransferFunction.loads(json.dumps(medium.as_json()))
    layers = Layers.of(again)
    assert [point.value for point in layers.curve.points] == [0, 4, 16, 20]
    np.testing.assert_allclose(layers.applied(again).at(VALUES), medium.at(VALUES), rtol=1e-9, atol=1e-12)


@kinds
def test_points_of_a_curve_are_all_found(medium: TransferFunction) -> None:
    layers = Layers.of(medium)
    assert not layers.palette
    assert [point.value for point in layers.curve.points] == medium.values.tolist()


@given(st.lists(st.tuples(st.floats(-50, 50), st.floats(0.1, 50)), min_size=1, max_size=6), st.floats(0.05, 20))
def test_range_and_opacity_are_those_of_the_command_line_however_they_were_reached(
    ranges: list[tuple[float, float]], factor: float
) -> None:
    medium = STRAIGHT
    for low, width in ranges:
        medium = lineage.adjusted(medium, (low, low + width))
        medium = lineage.adjusted(medium, factor=factor / 2)
    medium = lineage.adjusted(medium, factor=factor)
    low, width = ranges[-1]
    wanted = adjusting.denser(adjusting.between(STRAIGHT, low, low + width), factor)
    assert np.array_equal(medium.values, wanted.values)
    assert np.array_equal(medium.extinctions, wanted.extinctions)
    points = lineage.layers_of(medium).curve.points
    assert [point.value for point in points] == wanted.values.tolist()
    np.testing.assert_allclose([point.extinction for point in points], wanted.extinctions, rtol=1e-12)


def test_nothing_of_a_transparent_medium_is_lost() -> None:
    gone = lineage.adjusted(OPAQUE, factor=0.0)
    assert not gone.extinctions.any()
    back = lineage.adjusted(gone, factor=1.0)
    assert np.array_equal(back.extinctions, OPAQUE.extinctions)


def test_a_lineage_ends_with_its_transfer_function() -> None:
    medium = TransferFunction([0.0, 1.0], [(0, 0, 0), (1, 1, 1)], [0.0, 1.0])
    later = lineage.adjusted(colored(medium, named("hot")), (2.0, 3.0))
    assert lineage.lineage_of(later).changed and lineage.lineage_of(later).base is not None
    back = lineage.adjusted(lineage.adjusted(medium, (2.0, 3.0)), (0.0, 1.0))
    assert back is medium, "range and opacity as at first are the transfer function as it was"
    held = weakref.ref(medium), weakref.ref(later)
    del medium, later, back
    gc.collect()
    assert [each() for each in held] == [None, None]
