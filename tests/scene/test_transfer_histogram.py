"""Transfer functions proposed from a volume's histogram."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support.real_data import real_volume

from texvol.formats.readers import load
from texvol.scene import transfer
from texvol.scene.transfer.histogram import regions_of
from texvol.scene.volume import Volume

RANDOM = np.random.default_rng


def mixed(parts: list[tuple[float, float, float]], samples: int = 64**3) -> Volume:
    """Normally distributed values: mean, standard deviation and share of each part."""
    random = RANDOM(0)
    counts = [int(fraction * samples) for _, _, fraction in parts]
    counts[0] += samples - sum(counts)
    values = [random.normal(mean, width, count) for (mean, width, _), count in zip(parts, counts, strict=True)]
    return Volume(random.permutation(np.concatenate(values)).astype(np.float32).reshape(64, 64, 64))


def test_peaks_are_materials_and_valleys_are_boundaries() -> None:
    volume = mixed([(0, 10, 0.6), (300, 25, 0.2), (600, 25, 0.15), (900, 25, 0.05)])
    regions = regions_of(volume)
    assert len(regions.boundaries) == 3
    # The background ends between it and the first peak; valleys lie somewhere between the feet of their peaks.
    first, second, third = regions.boundaries
    assert 10 < first < 250 and 375 < second < 525 and 675 < third < 825
    assert regions.background == pytest.approx(0, abs=10)
    function = transfer.preset("histogram", volume)
    assert function.materials == ("material-1", "material-2", "material-3")
    extinction = function.classify([0, 300, 600, 900]).extinction * 64
    assert extinction[0] == 0
    assert extinction[1] > 2 and extinction[2] > 1.5 * extinction[1] and extinction[3] > 1.5 * extinction[2]


@pytest.mark.parametrize("scale, offset", [(1e-6, 0), (1, -1000), (1e300, 0)])
def test_a_scale_changes_nothing(scale: float, offset: float) -> None:
    volume = mixed([(0, 10, 0.6), (300, 25, 0.3), (600, 25, 0.1)])
    values = volume.values.astype(np.float64)
    plain = regions_of(Volume(values))
    scaled = regions_of(Volume(values * scale + offset))
    np.testing.assert_allclose((np.array(scaled.boundaries) - offset) / scale, plain.boundaries, rtol=1e-6, atol=1)


def test_matter_of_one_peak_is_parted() -> None:
    boundaries = regions_of(mixed([(0, 5, 0.5), (300, 60, 0.5)])).boundaries
    assert len(boundaries) == 3
    assert boundaries[1] == pytest.approx(300, abs=15)  # half of the matter
    assert boundaries[2] == pytest.approx(300 + 1.036 * 60, abs=20)  # all but the highest 15%


def test_what_there_is_much_of_does_not_hide_what_is_denser() -> None:
    volume = mixed([(0, 10, 0.1), (300, 25, 0.8), (600, 25, 0.1)])
    extinction = transfer.preset("histogram", volume).classify([300, 600]).extinction * 64
    assert extinction[0] * 0.8 == pytest.approx(3, rel=0.02)  # a mean optical depth of 3 through the box
    assert extinction[1] > 50


def test_homogeneous_regions_of_boundaries_are_clear() -> None:
    volume = mixed([(0, 10, 0.6), (300, 25, 0.3), (600, 25, 0.1)])
    function = transfer.preset("boundaries", volume)
    values = np.linspace(0, 600, 50)
    assert not function.classify(values, 0.0).extinction.any()
    assert function.classify(300.0, 200.0).extinction * 64 > 1
    assert not function.classify(0.0, 200.0).extinction  # the background's noise has gradients, too


def test_contours_lie_where_materials_begin() -> None:
    volume = mixed([(0, 10, 0.6), (300, 25, 0.3), (600, 25, 0.1)])
    regions, contours = regions_of(volume), transfer.preset("contours", volume).contours
    assert 2 <= len(contours) <= 3
    assert contours[-1].value == regions.boundaries[-1]
    assert regions.boundaries[0] < contours[0].value < 300
    depths = [each.extinction * each.thickness for each in contours]
    assert (np.diff(depths) > 0).all()


def test_labels_are_materials_each() -> None:
    values = np.zeros((16, 16, 16), np.uint8)
    values[4:8], values[8:10], values[10:] = 3, 7, 9
    regions = regions_of(Volume(values))
    assert regions.boundaries == (1.5, 5.0, 8.0) and regions.background == 0
    function = transfer.preset("histogram", Volume(values))
    extinction = function.classify([0, 3, 7, 9]).extinction
    assert extinction[0] == 0 and (np.diff(extinction) > 0).all()


def test_many_labels_are_at_most_five_materials() -> None:
    values = RANDOM(0).integers(0, 30, (32, 32, 32)).astype(np.uint8)
    assert 1 <= len(regions_of(Volume(values)).boundaries) <= 5
    values %= 12
    assert len(regions_of(Volume(values)).boundaries) == 5


def heavy_tail() -> np.ndarray:
    return RANDOM(0).standard_cauchy((24, 24, 24))


@pytest.mark.parametrize(
    "values",
    [
        lambda: np.zeros((3, 3, 3)),
        lambda: np.full((3, 3, 3), -7.5),
        lambda: np.full((3, 3, 3), 1e308),
        lambda: np.full((3, 3, 3), np.nan),
        lambda: np.full((3, 3, 3), np.inf),
        lambda: np.arange(27.0).reshape(3, 3, 3) % 2,
        lambda: np.array([[[0.0, 1e308, -1e308]]]),
        lambda: RANDOM(0).integers(0, 2, (9, 9, 9)).astype(np.uint8) * 255,
        lambda: RANDOM(0).random((24, 24, 24)),
        lambda: RANDOM(0).integers(0, 256, (24, 24, 24)).astype(np.uint8),
        lambda: RANDOM(0).normal(0, 1, (24, 24, 24)),
        lambda: RANDOM(0).integers(-(2**63), 2**63 - 1, (24, 24, 24)),
        heavy_tail,
        lambda: np.exp(5 * heavy_tail().clip(-50, 50)),
        lambda: np.where(heavy_tail() > 1, heavy_tail(), np.nan),
        lambda: np.full((1, 1, 1), 3, np.uint8),
        lambda: np.r_[np.zeros(9999), 1.0].reshape(10, 10, 100),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["histogram", "contours", "boundaries"])
def test_any_volume_has_one(name: str, values: Callable[[], np.ndarray]) -> None:
    volume = Volume(values())
    with np.errstate(over="ignore"):
        function = transfer.preset(name, volume)
    numbers = [function.values, function.colors, function.extinctions]
    for each in function.graded:
        numbers += [each.values, each.emissions, each.extinctions]
    assert all(np.isfinite(each).all() for each in numbers)
    low, high = volume.finite_range or (0.0, 0.0)
    if name == "histogram":
        assert function.classify(np.linspace(low / 2, high / 2, 9) * 2).extinction.max() > 0


@pytest.mark.parametrize(
    "file, values",
    [
        ("tooth/tooth.nhdr", [400, 800, 1200]),  # air, dentine, enamel
        ("engine/engine.nii.gz", [0, 140, 250]),  # air, aluminium, steel
        ("lung/3DCT_lung.mha", [-1000, 40, 500]),  # air, soft tissue, bone
        ("brain/mni_icbm152_t1_tal_nlin_sym_09a_converted.nii.gz", [0, 170, 219]),  # air, grey and white matter
    ],
)
def test_what_one_knows_of_a_volume_is_told_apart(file: str, values: list[float]) -> None:
    volume = load(real_volume(file))
    extinction = transfer.preset("histogram", volume).classify(values).extinction
    assert extinction[0] == 0 and extinction[1] > 0 and extinction[2] > 2 * extinction[1]
