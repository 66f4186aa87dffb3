"""Transfer functions, their files, presets and proposals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.scene import transfer
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

RAMP = {
    "points": [
        {"value": 0, "color": [0, 0, 0], "extinction": 0},
        {"value": 10, "color": [1, 0.5, 0.25], "extinction": 4},
    ]
}


def test_between_points_color_and_extinction_are_linear() -> None:
    emission, extinction = transfer.loads(json.dumps(RAMP)).classify([-5, 0, 2.5, 10, 50])
    np.testing.assert_allclose(extinction, [0, 0, 1, 4, 4])
    np.testing.assert_allclose(emission[2], np.array([0.25, 0.125, 0.0625]) * 1)
    np.testing.assert_allclose(emission[4], np.array([1, 0.5, 0.25]) * 4)


def test_the_right_side_of_a_step_holds_at_the_step() -> None:
    function = TransferFunction([0, 1, 1, 2], np.zeros((4, 3)), [1, 1, 5, 5])
    extinction = function.classify([np.nextafter(1, 0), 1, np.nextafter(1, 2)]).extinction
    np.testing.assert_allclose(extinction, [1, 5, 5])


def test_a_step_at_either_end_clamps_to_the_outer_point() -> None:
    function = TransferFunction([1, 1, 2, 2], np.zeros((4, 3)), [7, 1, 1, 9])
    np.testing.assert_allclose(function.classify([0, 1, 1.5, 2, 3]).extinction, [7, 1, 1, 9, 9])


def test_a_spike_narrower_than_a_data_level_is_kept() -> None:
    values = [0, 1e6 - 1e-3, 1e6, 1e6 + 1e-3, 2e6]
    extinction = TransferFunction(values, np.zeros((5, 3)), [0, 0, 1, 0, 0]).classify([1e6, 1e6 + 5e-4]).extinction
    np.testing.assert_allclose(extinction, [1, 0.5], rtol=1e-6)


def test_infinite_extinction_holds_up_to_the_next_point() -> None:
    function = TransferFunction([0, 1, 2], np.eye(3), [0.5, np.inf, 0.5])
    emission, extinction = function.classify([0, 0.5, 1, 1.5, 2])
    np.testing.assert_array_equal(extinction, [0.5, np.inf, np.inf, np.inf, 0.5])
    np.testing.assert_allclose(emission[2], [0, 1, 0])  # what shows of opaque matter is its straight colour


def test_nan_is_nothing() -> None:
    emission, extinction = TransferFunction([0], [[1, 1, 1]], [3]).classify(np.nan)
    assert extinction == 0 and not emission.any()


def test_large_values_keep_their_differences() -> None:
    function = TransferFunction([1e9 - 1, 1e9 + 1], np.zeros((2, 3)), [0, 1])
    np.testing.assert_allclose(function.classify(np.array([1e9 - 1, 1e9, 1e9 + 1])).extinction, [0, 0.5, 1])


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_opacity_per_unit_length_is_converted(opacities: list[float]) -> None:
    points = [{"value": i, "color": [1, 1, 1], "opacity": a} for i, a in enumerate(opacities)]
    function = transfer.loads(json.dumps({"points": points}))
    with np.errstate(divide="ignore"):
        np.testing.assert_array_equal(function.extinctions, -np.log1p(-np.array(opacities)))


def test_a_function_is_what_its_json_says() -> None:
    for emissive in (False, True):
        function = TransferFunction([0, 1, 1], np.eye(3) * 0.5, [0.25, 1e-12, np.inf], emissive)
        again = transfer.loads(json.dumps(function.as_json()))
        for name in ("values", "colors", "extinctions", "emissive"):
            np.testing.assert_array_equal(getattr(again, name), getattr(function, name))


def test_values_may_be_percentiles_or_shares_of_the_range() -> None:
    volume = Volume(np.arange(1000, dtype=np.uint16).reshape(10, 10, 10))
    percentile = transfer.loads(json.dumps(RAMP | {"values": "percentile"}), volume=volume)
    np.testing.assert_allclose(percentile.values, [0, 99.9], atol=0.5)
    fractions = transfer.loads(
        json.dumps({"values": "range", "points": [p | {"value": p["value"] / 10} for p in RAMP["points"]]}),  # type: ignore[index,operator]
        volume=volume,
    )
    np.testing.assert_allclose(fractions.values, [0, 999])


def test_extinction_may_be_per_box() -> None:
    volume = Volume(np.zeros((10, 10, 10)), (2, 2, 2))
    function = transfer.loads(json.dumps(RAMP | {"length": "box"}), volume=volume)
    np.testing.assert_allclose(function.extinctions, [0, 4 / 20])


def _with(**changes: object) -> str:
    return json.dumps({"points": [RAMP["points"][0] | changes]})


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "is not JSON"),
        ("{", "is not JSON"),
        ("[" * 100_000, "nested deeper than"),
        ("[]", "must be a JSON object with points"),
        ("{}", "must have a list of points"),
        ('{"points": []}', "must have a list of points with at least one"),
        ('{"points": [3]}', "point 0 must be an object"),
        ('{"points": [], "points": []}', "the same key twice"),
        (json.dumps(RAMP | {"colour": 1}), "key 'colour' not known"),
        (json.dumps(RAMP | {"values": "dB"}), '"values" must be one of data, percentile, range'),
        (json.dumps(RAMP | {"values": "percentile"}), "a volume must be given"),
        (json.dumps({"points": RAMP["points"][::-1]}), "values must ascend, got 0 after 10"),
        (_with(value=float("nan")), "values must be finite"),
        (_with(value=float("inf")), "values must be finite"),
        (_with(value="0"), "value must be a number"),
        (_with(value=True), "value must be a number"),
        (_with(extinction=-1), "extinction must not be negative or NaN, got -1"),
        (_with(extinction=float("nan")), "extinction must not be negative or NaN"),
        (_with(opacity=0.5), "either extinction or opacity"),
        (_with(color=[0, 0]), "color must be three numbers"),
        (_with(color=[0, 0, 2]), r"colours must be from 0 to 1"),
        (_with(color=[0, 0, -1]), "not negative"),
        (_with(alpha=1), "point 0: key 'alpha' not known"),
        ('{"points": [{"value": 0, "color": [0, 0, 0]}]}', "either extinction or opacity"),
        ('{"points": [{"value": 0, "extinction": 0}]}', "must have color"),
        ('{"points": [{"value": 0, "color": [0, 0, 0], "opacity": 1.5}]}', r"opacity must be from 0 to 1"),
        (f'{{"points": [{{"value": 1{"0" * 400}, "color": [0, 0, 0], "extinction": 0}}]}}', "is too large"),
    ],
)
def test_a_file_that_is_wrong_is_refused_by_name(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "wrong.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        TransferFunction.load(path)
    assert "wrong.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="missing.json: cannot be read"):
        transfer.load(tmp_path / "missing.json")
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        transfer.load(tmp_path / "binary.json")


def _blob(low: float, high: float, dtype: type) -> Volume:
    """A bright ball in a dark, noisy surrounding."""
    axis = np.linspace(-1, 1, 32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    radius = np.sqrt(x * x + y * y + z * z)
    shape = np.clip(1.5 - 2 * radius, 0, 1) + 0.01 * np.random.default_rng(0).random(x.shape)
    return Volume((low + (high - low) * shape).astype(dtype))


@pytest.mark.parametrize("name", [name for name in transfer.PRESETS if name != "diverging"])  # which is about zero
@pytest.mark.parametrize(
    "volume",
    [_blob(-1000, 2000, np.int16), _blob(0, 250, np.uint8), _blob(1e-3, 2e-3, np.float32), _blob(0, 60000, np.uint16)],
    ids=["hounsfield", "bytes", "small", "words"],
)
def test_every_preset_shows_the_matter_and_not_the_air(name: str, volume: Volume) -> None:
    magnitudes = np.linalg.norm(np.gradient(volume.values.astype(np.float64)), axis=0)
    medium_of = transfer.preset(name, volume)
    shown = medium_of.classify(volume.values, magnitudes)
    seen = 32 * (shown.emission.max(axis=-1) if medium_of.emissive else shown.extinction)  # per box
    air, medium = seen[0, 0, 0], seen.max()
    assert medium > (1 if medium_of.emissive else 3)  # light of 1 is white
    assert air < 0.2 * medium


@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.int16])
def test_the_proposal_shows_the_matter_and_not_the_air(dtype: type) -> None:
    volume = _blob(0, 250, dtype)
    extinction = transfer.proposed_for(volume).classify(volume.values).extinction
    assert extinction[0, 0, 0] == 0
    assert extinction[16, 16, 16] * 32 > 20


@pytest.mark.parametrize("values", [np.nan, 7.0, np.inf])
def test_presets_and_proposal_take_any_values(values: float) -> None:
    volume = Volume(np.full((2, 2, 2), values))
    for function in (transfer.proposed_for(volume), *(transfer.preset(name, volume) for name in transfer.PRESETS)):
        assert np.isfinite(function.values).all()


def test_there_are_eight_presets_and_another_is_refused_with_the_list() -> None:
    assert len(transfer.PRESETS) >= 8
    with pytest.raises(
        InputError, match="preset 'bones' not found; known are ct-bone, ct-soft-tissue, ct-lung, mr, grey, fog,"
    ):
        transfer.preset("bones", Volume(np.zeros((1, 1, 1))))
