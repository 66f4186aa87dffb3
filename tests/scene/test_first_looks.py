"""First looks of noise, of fields with two signs, of maps, of stains without a window and of flat boxes."""

from __future__ import annotations

import numpy as np
import pytest

from texvol import Renderer, Scene, Volume
from texvol.scene.kinds import kind_of
from texvol.scene.looks import look_for
from texvol.scene.noise import clearest_axis, noise_of
from texvol.scene.transfer.presets import proposed_in_light
from texvol.scene.transfer.two_signs import points_of
from texvol.scene.transfer.units import medium_range

SIDE = 48
RANDOM = np.random.default_rng(11)
Z, Y, X = np.meshgrid(*[np.linspace(-1, 1, SIDE)] * 3, indexing="ij")
RADIUS = np.sqrt(X**2 + Y**2 + Z**2)
NOISE = RANDOM.normal(size=RADIUS.shape)
SHEETS = np.exp(-((np.abs(X) - 0.4) ** 2) / 0.02)  # along y and z


@pytest.mark.parametrize("part", [0.3, 0.6])
def test_noise_is_its_part_of_the_variance(part: float) -> None:
    """About 10^5 differences: their mean square is known to half a per cent, and the wave's steps are as small."""
    wave = np.sin(2 * X + Y)
    values = np.sqrt(1 - part) * wave / wave.std() + np.sqrt(part) * NOISE
    assert noise_of(Volume(values)) == pytest.approx(part, abs=0.03)


def test_structure_is_no_noise() -> None:
    coarse = np.sign(np.sin(9 * X) * np.sin(8 * Y) * np.sin(7 * Z))
    for values in (SHEETS, coarse, np.ones(RADIUS.shape), np.full(RADIUS.shape, np.nan)):
        assert noise_of(Volume(values)) < 0.01
    assert noise_of(Volume(NOISE)) > 0.9
    assert kind_of(Volume(np.abs(NOISE))).name != "noise"  # there is nothing else


def test_counts_of_few_photons_add_up_along_rays() -> None:
    photons = Volume(RANDOM.poisson(1 + 6 * SHEETS).astype(np.uint8))
    kind, look = kind_of(photons), look_for(photons)
    assert kind.name == "noise" and "of the variance" in kind.reason
    assert look.transfer_function.emissive and look.lighting is None


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_sheets_in_noise_are_seen_along_themselves(axis: int) -> None:
    """Sheets across x, y or z: along that axis all lines are alike."""
    values = RANDOM.poisson(1 + 6 * SHEETS).swapaxes(2, 2 - axis).astype(np.uint8)
    assert clearest_axis(Volume(values)) != axis
    with Renderer() as renderer:
        light = renderer.render(Scene(Volume(values)), size=(64, 64))[..., :3].sum(axis=-1)
    profile = max((light.mean(axis=each) for each in (0, 1)), key=np.ptp)
    assert profile[24:40].mean() < 0.5 * profile.max()  # between two sheets


def test_layers_of_both_signs_hide_what_is_behind_them_and_few_do_not() -> None:
    layers = np.random.default_rng(3).laplace(size=SIDE)[:, np.newaxis, np.newaxis] * np.ones(RADIUS.shape)
    few = np.sin(3 * Z) * np.exp(-RADIUS)
    dense, usual = (points_of(Volume(values.astype(np.float32)))[-1][2] for values in (layers, few))
    assert usual == 60 and dense > 1.5 * usual
    assert points_of(Volume(SHEETS - 0.5 + 0.4 * NOISE))[-1][2] == 60  # only the noise takes turns


def test_the_end_of_the_colours_is_lower_where_few_values_are_large() -> None:
    """The median magnitude of normal numbers is a fifth of their 99.9th percentile: there is nothing to lower."""
    most = np.percentile(np.abs(NOISE), 99.9)
    assert points_of(Volume(NOISE))[-1][0] == pytest.approx(most, rel=0.05)
    currents = NOISE * np.where(RADIUS < 0.25, 30, 1)
    assert points_of(Volume(currents))[-1][0] < 0.4 * np.percentile(np.abs(currents), 99.9)


def test_a_map_is_seen_from_above_and_a_layered_field_from_beside() -> None:
    slope = {}
    for name, space in (("map", "lon (degrees_east), lat (degrees_north), lev (m)"), ("field", "")):
        values = (0.6 + 0.2 * np.sin(3 * X + Y) + 0.04 * NOISE)[:24].astype(np.float32)  # half as high as wide
        slope[name] = -Scene(Volume(values, space=space)).completed((64, 64)).camera.forward[2]
    assert slope["map"] == pytest.approx(np.cos(np.radians(35)), abs=1e-3)
    assert 0.1 < slope["field"] < 0.5


def test_a_background_without_a_valley_ends_by_its_lower_side() -> None:
    """A stain from a few thousands down to the background, which is normal about 150 with a deviation of 6."""
    stain = RANDOM.exponential(600, RADIUS.shape) * (RANDOM.random(RADIUS.shape) < 0.7)
    low, high = medium_range(Volume((150 + 6 * NOISE + stain).astype(np.uint16)))
    assert 155 < low < 260 and high > 2500


def test_a_flat_box_is_as_opaque_from_its_broad_side_as_one_a_quarter_as_thick() -> None:
    thin, thick = (proposed_in_light(Volume(SHEETS[:count])) for count in (3, SIDE))
    mean = [np.mean((count, SIDE, SIDE)) for count in (3, SIDE)]
    through = float(thin.extinctions[-1]) * 3, float(thick.extinctions[-1]) * mean[1] / 4
    assert through == (pytest.approx(75), pytest.approx(75))
