"""The benchmark measures what it says: its marcher converges to the oracle, its shader fetches along the same rays."""

from __future__ import annotations

import sys
from dataclasses import replace

import benchmark
import benchmark_errors
import benchmark_growth
import benchmark_surfaces
import numpy as np
import pytest
from benchmark_competitors import Texvol, Trial, fastest, stopped_falling
from benchmark_fetch import PlainFetch
from benchmark_scenes import balls, built_in, of_type, rms, transfer_function
from benchmark_timing import in_turns, milliseconds, process
from plain_marcher import PlainMarcher

from texvol import Renderer, Scene, TransferFunction, Volume, raycast

SIZE = (48, 40)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_marcher_converges_to_the_oracle(projection: str) -> None:
    scene = built_in("fog", 32, projection=projection)
    truth = raycast(scene, SIZE)
    marcher = PlainMarcher(scene, SIZE)
    errors = [rms(marcher.draw(distance, 0.0), truth) for distance in (2, 0.5, 0.125)]
    # The midpoint rule is of order 2 on a field without kinks, and of 1.5 where rays meet the kinks of trilinear cells.
    assert errors[1] < errors[0] / 4**1.5
    assert errors[2] < errors[1] / 4**1.5
    assert errors[2] < 3e-5


def test_the_marcher_sees_an_anisotropic_turned_volume_as_the_oracle_does() -> None:
    values = np.random.default_rng(5).random((6, 9, 12), np.float32) * 40 - 10
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    volume = Volume(values, spacing=(1, 2, 3), origin=(100, 50, -20), direction=turn)
    function = TransferFunction(np.array([-10, 30]), np.array([(1, 0, 0), (0, 1, 0.5)]), np.array([0.02, 0.1]))
    scene = Scene(volume, function, classification="post")
    # A table of 16384 entries is off by 1/32768 of the range at most.
    assert rms(PlainMarcher(scene, SIZE).draw(0.02, 0.0), raycast(scene, SIZE)) < 1e-4


def test_the_end_of_a_ray_costs_the_marcher_no_more_than_its_threshold() -> None:
    marcher = PlainMarcher(built_in("dense", 32), SIZE)
    difference = np.abs(marcher.draw(0.5, 1e-3) - marcher.draw(0.5, 0.0)).max()
    assert 0 < difference <= 1e-3 + 1e-6  # float32 sums


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_bare_shader_fetches_as_many_samples_as_texvol_does(projection: str) -> None:
    ones = Volume(np.ones((20, 20, 20), np.float32))
    scene = replace(built_in("fog", 20, projection=projection), volume=ones)
    with PlainFetch(scene, 0.5, "auto", SIZE) as fetch, Renderer() as renderer:
        fetched = fetch.picture(0.5)[..., 0].sum(dtype=np.float64)
        renderer.render(scene, SIZE, slab_thickness=0.5, skip_empty=False, early_termination=0.0)
        # A ray along an edge may gain or lose a slab to rounding: a pixel in a hundred.
        assert renderer.stats["samples"] == pytest.approx(fetched, rel=0.01)


def test_every_section_has_its_function() -> None:
    assert all(callable(benchmark.section(name)) for name in benchmark.SECTIONS)
    assert benchmark.chosen_sections("growth, errors") == ["errors", "growth"]


def trial(seconds: float, error: float) -> Trial:
    """A trial of this time and error."""
    return Trial(seconds, f"{seconds:g}", seconds, error)


def test_the_winner_is_the_fastest_that_is_within_the_error() -> None:
    trials = [trial(1, 2e-2), trial(2, 5e-3), trial(3, 4e-3), trial(9, 1e-4)]
    assert fastest(trials, 1e-2) == trials[1]
    assert fastest(trials, 1e-5) is None
    # The second look may turn the order round; what was far slower gets none.
    assert benchmark_errors.finalists(trials, 1e-2) == trials[1:2]
    near = [trial(2, 5e-3), trial(2.2, 4e-3)]
    assert benchmark_errors.best(near, 1e-2, {near[0]: (2.5, 5.0), near[1]: (2.1, 4.0)}) == replace(
        near[1], seconds=2.1, processor_seconds=4.0
    )
    assert benchmark_errors.best(near, 1e-2, {}) is None


def test_cells_say_the_time_or_how_near_it_came() -> None:
    competitor = Texvol(None, None, None, 1.0)  # type: ignore[arg-type]
    competitor.problem = "no driver"
    assert benchmark_errors.time_and_setting(None, [competitor]) == "no driver"
    competitor.trials = [trial(1, 2e-2), trial(2, 5e-3)]
    assert benchmark_errors.time_and_setting(None, [competitor]) == "not reached (floor 5.0e-03)"
    competitor.out_of_time = True
    assert benchmark_errors.time_and_setting(None, [competitor]) == "not reached (stopped at 5.0e-03)"
    assert benchmark_errors.time_and_setting(Trial(1, "post, 2", 0.25, 1e-3), [competitor]) == "250 (post, 2)"
    assert benchmark_errors.times_as_fast(trial(2, 0), trial(5, 0)) == "2.5"
    assert milliseconds(0.01234) == "12.3"
    assert milliseconds(2.5) == "2500"


def test_an_error_that_stays_has_stopped_falling() -> None:
    assert stopped_falling([1e-2, 4e-3, 3.9e-3, 3.8e-3])
    assert not stopped_falling([1e-2, 4e-3, 3.9e-3, 3e-3])
    assert not stopped_falling([0.3, 0.3, 0.3])  # with so few samples nothing is known yet


def test_everything_has_its_turn_before_anything_has_the_next() -> None:
    turns: list[str] = []

    def action(name: str, seconds: list[float]) -> float:
        turns.append(name)
        return seconds.pop(0)

    slow, quick = [9.0, 3.0, 5.0, 4.0], [9.0, 1.0, 1.0, 8.0]
    found = in_turns({"slow": lambda: action("slow", slow), "quick": lambda: action("quick", quick)}, 3)
    assert found == {"slow": 4.0, "quick": 1.0}
    assert turns == ["slow", "quick"] * 4


def test_new_transfer_functions_are_new_in_what_they_say() -> None:
    function = transfer_function("bone", 64)
    values = np.linspace(0, 1, 101)
    new, more = benchmark_growth.altered(function), benchmark_growth.with_a_point_more(function)
    assert new.values.tolist() == function.values.tolist()
    assert not np.allclose(new.at(values), function.at(values))
    assert ((new.at(values)[:, 3] > 0) == (function.at(values)[:, 3] > 0)).all()
    assert more.values.size == function.values.size + 1
    assert not np.allclose(more.at(values), function.at(values))


def test_built_in_volumes_are_alike_at_every_size() -> None:
    for samples in (64, 128):
        values = balls(samples)
        assert values.shape == (samples,) * 3
        assert (values > 0).mean() == pytest.approx(8 * 4 / 3 * np.pi * 0.07**3, rel=0.1)
    assert of_type(np.array([0, 0.5, 1]), "uint8").tolist() == [0, 128, 255]
    pictures = [raycast(built_in("fog", samples), SIZE) for samples in (32, 64)]
    assert rms(pictures[0], pictures[1]) < 0.03


def test_a_process_is_charged_with_its_own_memory_only() -> None:
    ballast = np.ones(20_000_000)  # 160 MB that are ours
    _, megabytes = process([sys.executable, "-I", "-S", "-c", "pass"])
    assert megabytes < 60 < ballast.nbytes / 1e6
    with pytest.raises(RuntimeError, match="no luck"):
        process([sys.executable, "-c", "import sys; print('a word'); sys.exit('no luck')"])


def test_distances_of_surfaces_are_those_of_their_facets() -> None:
    """Of a square of half side 0.3 around the middle of a sphere of 0.7, which is 0.7 off."""
    corners = [(-0.3, -0.3, 0), (0.3, -0.3, 0), (0.3, 0.3, 0), (-0.3, 0.3, 0), (0, 0, 0)] + benchmark_surfaces._PLACE
    square = benchmark_surfaces.Mesh(corners, [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)])
    mean, largest = benchmark_surfaces.distances_of(square, benchmark_surfaces.SHAPES["sphere"])
    assert largest == pytest.approx(0.7)
    # The mean radius in a square of half side a is (√2 + asinh 1) a / 3, a cone on which sums are off by little.
    assert mean == pytest.approx(0.7 - (np.sqrt(2) + np.arcsinh(1)) * 0.3 / 3, rel=0.01)


@pytest.mark.parametrize("name", benchmark_surfaces.SHAPES)
def test_contents_of_shapes_are_those_of_their_fields(name: str) -> None:
    shape = benchmark_surfaces.SHAPES[name]
    volume = benchmark_surfaces.sampled(shape, 64)
    # Voxels of a tenth of a percent of the content and less, at surfaces both ways.
    assert (volume.values > 0).mean() * 8 == pytest.approx(shape.content, rel=0.01)
