"""Label volumes: which labels there are, a colour and an opacity for each, and what is said of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from texvol import InputError, TransferFunction, Volume
from texvol.cli import information
from texvol.scene.label_counts import label_counts, listed
from texvol.scene.transfer import PRESETS, label_function, loads, parse_labels, preset, proposed_for
from texvol.scene.transfer.labels import OPACITY, color_list
from texvol.scene.volume import LARGEST_LABEL

SPACING = (3.0, 2.0, 5.0)  # the smallest is along y


def labelled(*labels: int, dtype: str = "int32") -> Volume:
    """A row of samples, one for each label and one more for the last."""
    values = np.array([*labels, labels[-1]], dtype).reshape(1, 1, -1)
    return Volume(values, SPACING, labels=True, name="organs.nii")


def looks(function: TransferFunction, label: float) -> tuple[np.ndarray, float]:
    """Straight colour and opacity over the smallest spacing."""
    numbers = function.at(label)
    return numbers[:3], float(-np.expm1(-numbers[3] * min(SPACING)))


@pytest.mark.parametrize("dtype", ["uint8", "int16", "int32", "uint64", "float32"])
@pytest.mark.parametrize("far", [False, True])
def test_labels_are_counted(dtype: str, far: bool) -> None:
    highest = LARGEST_LABEL if far and dtype not in ("uint8", "int16") else 120
    lowest = -5 if dtype in ("int16", "int32", "float32") else 0
    values = np.full((60, 200, 100), 7, dtype)  # more than is looked at in one go
    values[0, 0, :3], values[-1, -1, -1] = lowest, highest
    found = label_counts(Volume(values, labels=True))
    assert dict(zip(found.labels.tolist(), found.counts.tolist(), strict=True)) == {
        lowest: 3, 7: values.size - 4, highest: 1,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("labels", "text"),
    [
        ([5], "5"),
        ([0, 1], "0, 1"),
        (range(30), "0 … 29"),
        ([-3, 0, 1, 2, 7, 9], "-3, 0 … 2, 7, 9"),
        (range(0, 40, 2), "0, 2, 4, 6, 8, 10, 12, 14, …, 24, 26, 28, 30, 32, 34, 36, 38"),
    ],
)
def test_labels_are_listed_by_runs(labels: range | list[int], text: str) -> None:
    assert listed(np.array(list(labels))) == text


# Neighbours, gaps, negative ones, and the largest, which single precision has no halves between.
@pytest.mark.parametrize(
    "labels",
    [
        (0, 1, 2, 3),
        (-7, -1, 0, 4, 100),
        (8388607, 8388608, 8388609),
        (-LARGEST_LABEL, LARGEST_LABEL - 1, LARGEST_LABEL),
        (4,),
    ],
)
def test_each_label_looks_as_it_is_told_whatever_is_beside_it(labels: tuple[int, ...]) -> None:
    rng = np.random.default_rng(1)
    opacities = {label: float(rng.random()) for label in labels}
    colors = {label: tuple(rng.random(3)) for label in labels}
    function = label_function(labelled(*labels), opacities, colors)
    for label in labels:
        # As they are, and where single precision may have rounded what a label is divided by and multiplied with.
        for value in (label, float(np.float32(label))):
            color, opacity = looks(function, value)
            np.testing.assert_array_equal(color, colors[label])
            assert opacity == pytest.approx(opacities[label], rel=1e-13)  # expm1 of log1p: a rounding each


def test_steps_lie_half_way_where_single_precision_has_halves() -> None:
    function = label_function(labelled(0, 1, 2, 10))
    assert function.values.tolist() == [0.5, 0.5, 1.5, 1.5, 6.0, 6.0]
    for high in (2**22, LARGEST_LABEL):
        steps = label_function(labelled(high - 2, high - 1, high)).values.astype(np.float32)
        assert high - 2 < steps[0] <= high - 1 < steps[-1] <= high  # the right side holds at a step itself


def test_what_has_no_label_is_transparent_unless_told() -> None:
    volume = labelled(0, 1, 2)
    assert looks(label_function(volume), 0)[1] == 0 and looks(label_function(volume), 1)[1] == pytest.approx(OPACITY)
    assert looks(label_function(volume, others=1.0), 0)[1] == 0
    assert looks(label_function(volume, {0: 0.25}), 0)[1] == pytest.approx(0.25)


def test_opacity_is_over_one_smallest_spacing_and_one_is_opaque() -> None:
    function = label_function(labelled(0, 1, 2), {1: 0.75, 2: 1})
    assert function.classify(1).extinction == pytest.approx(-np.log(0.25) / 2.0)
    assert np.isinf(function.classify(2).extinction)
    np.testing.assert_array_equal(function.classify(2).emission, function.at(2)[:3])


def test_others_are_those_that_are_not_named() -> None:
    function = label_function(labelled(0, 1, 2, 3), {1: 0.5}, {2: (1, 0, 0)}, others=0.0)
    assert [looks(function, label)[1] for label in range(4)] == pytest.approx([0, 0.5, OPACITY, 0])


def test_a_label_keeps_its_colour_whatever_others_there_are() -> None:
    many, few = label_function(labelled(*range(-40, 1000))), label_function(labelled(0, 17, 900))
    for label in (0, 17, 900):
        np.testing.assert_array_equal(many.at(label)[:3], few.at(label)[:3])


def test_neighbouring_labels_have_colours_that_differ_and_stand_out() -> None:
    count = len(color_list())
    function = label_function(labelled(*range(-3, 2 * count)))
    colors = function.at(np.arange(-3, 2 * count))[:, :3]
    # CIE L*a*b* of D65 (CIE 15): where two colours are 10 apart, nobody takes one for the other.
    xyz = colors @ np.array([[0.4124, 0.2126, 0.0193], [0.3576, 0.7152, 0.1192], [0.1805, 0.0722, 0.9505]])
    fractions = xyz / (0.9505, 1.0, 1.089)
    roots = np.where(fractions > 216 / 24389, np.cbrt(fractions), (24389 / 27 * fractions + 16) / 116)
    lightness = 116 * roots[:, 1] - 16
    lab = np.stack([lightness, 500 * (roots[:, 0] - roots[:, 1]), 200 * (roots[:, 1] - roots[:, 2])], axis=1)
    assert np.linalg.norm(np.diff(lab, axis=0), axis=1).min() > 10
    # The colours of the first 30 are all told from one another, and none is lost before black or white.
    first = lab[4:34]
    apart = np.linalg.norm(first[:, np.newaxis] - first, axis=2)
    assert apart[np.triu_indices(30, 1)].min() > 20
    assert lightness.min() > 30 and lightness.max() < 96


def test_other_lists_go_by_their_names() -> None:
    function = label_function(labelled(0, 1, 21), colors="tab20")
    np.testing.assert_array_equal(function.at(1), function.at(21))
    # The first of tab20 is #1f77b4.
    from texvol.util.color import srgb_from_linear

    np.testing.assert_allclose(srgb_from_linear(function.at(1)[:3]) * 255, [0x1F, 0x77, 0xB4], atol=1e-6)
    with pytest.raises(InputError, match="viridis must be a list of colours, got a ramp"):
        label_function(labelled(0, 1), colors="viridis")
    with pytest.raises(
        InputError, match="list of colours 'nosuch' not found; known are glasbey, tab20 and Set1 among others"
    ):
        label_function(labelled(0, 1), colors="nosuch")


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"opacities": {57: 1}}, "label 57 not found: organs.nii has 0 … 29"),
        ({"colors": {-1: (1, 0, 0)}}, "label -1 not found: organs.nii has 0 … 29"),
        ({"opacities": {1: 1.5}}, r"the opacity of label 1 must be from 0 to 1, got 1.5"),
        ({"opacities": {1: np.nan}}, r"the opacity of label 1 must be from 0 to 1, got nan"),
        ({"others": -1}, r"the opacity of all other labels must be from 0 to 1"),
        ({"colors": {1: (1, 0, 2)}}, r"the colour of label 1 must be three numbers from 0 to 1"),
        ({"colors": {1: (1, 0)}}, r"the colour of label 1 must be three numbers from 0 to 1"),
    ],
)
def test_what_is_wrong_with_a_look_is_said(how: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        label_function(labelled(*range(30)), **how)


def test_measured_values_have_no_labels() -> None:
    with pytest.raises(InputError, match="read labels with --labels"):
        label_function(Volume(np.zeros((2, 2, 2))))


def test_a_text_says_how_labels_look() -> None:
    look = parse_labels("*=0, 7=0.5,-3 = #ff8000:1e-1,4=#00FF00,+12=1")
    assert look.opacities == {7: 0.5, -3: 0.1, 12: 1.0} and look.others == 0
    # sRGB 0x80 is 0.21586 of white's light (IEC 61966-2-1).
    assert look.colors[4] == (0, 1, 0) and look.colors[-3] == pytest.approx((1, 0.21586, 0), abs=1e-5)
    function = label_function(labelled(-3, 0, 4, 7, 8, 12), **look._asdict())
    assert [looks(function, label)[1] for label in (-3, 0, 4, 7, 8, 12)] == pytest.approx([0.1, 0, OPACITY, 0.5, 0, 1])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((text, "LABEL=OPACITY") for text in ("", "1", "1=", "=1", "a=1", "1.5=1", "1=1;2=1", "1=#12345", "1=nan")),
        *((text, "LABEL=OPACITY") for text in ("*=#ff0000", "1=0.5:#ff0000", "1=#ff0000:", "1=1,", "99999999999=1")),
        ("1=1.5", r"label 1 must be from 0 to 1, got 1.5"),
        ("1=-1", r"label 1 must be from 0 to 1"),
        ("*=2", r"label \* must be from 0 to 1"),
        ("1=1,2=1,+1=0", "label 1 must be given once"),
        ("*=1,*=0", r"label \* must be given once"),
    ],
)
def test_a_text_that_says_nothing_of_the_kind_is_refused_in_a_line(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        parse_labels(text)
    assert "\n" not in str(caught.value)


def test_labels_are_proposed_their_colours() -> None:
    volume = labelled(0, 1, 5)
    proposed, function = proposed_for(volume), label_function(volume)
    for field in ("values", "colors", "extinctions"):
        np.testing.assert_array_equal(getattr(proposed, field), getattr(function, field))


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_for_measured_values(name: str) -> None:
    with pytest.raises(InputError, match=f"the preset {name} needs measured values, got labels"):
        preset(name, labelled(0, 1, 300))


def test_files_in_data_units_serve_labels_and_others_are_refused() -> None:
    black = '"color": [0, 0, 0]'
    text = f'{{"points": [{{"value": 0, {black}, "extinction": 0}}, {{"value": 1, {black}, "extinction": 2}}]'
    volume = labelled(0, 1)
    assert loads(text + "}", "tf.json", volume).classify(1).extinction == 2
    for units in ("percentile", "range", "matter"):
        with pytest.raises(InputError, match=f'values in "{units}" need measured values'):
            loads(text + f', "values": "{units}"}}', "tf.json", volume)


def test_a_label_function_is_stored_and_read_again() -> None:
    import json

    function = label_function(labelled(-2, 0, 1, 9), {9: 1, 1: 0.1})
    again = loads(json.dumps(function.as_json()))
    for field in ("values", "colors", "extinctions", "materials", "material_colors"):
        np.testing.assert_array_equal(getattr(again, field), getattr(function, field))
    assert function.materials == ("label -2", "label 1", "label 9")


def test_information_counts_labels() -> None:
    metadata = information.metadata(labelled(0, 3, 4))
    assert metadata["labels"] == {
        "count": 3,
        "first": [{"label": 0, "samples": 1}, {"label": 3, "samples": 1}, {"label": 4, "samples": 2}],
    }
    page = information.text(metadata)
    assert "3, from 0 to 4" in page and "0: 1, 3: 1, 4: 2" in page and "mean" not in page and "percentile" not in page
    many = information.metadata(labelled(*range(100)))
    assert many["labels"]["count"] == 100 and len(many["labels"]["first"]) == information.MOST_LABELS
    assert f"{100 - information.MOST_LABELS} more are not listed" in information.text(many)
    assert information.metadata(Volume(np.zeros((2, 2, 2))))["labels"] is None


def test_who_has_no_labels_does_not_pay_for_them(tmp_path: Path) -> None:
    import subprocess
    import sys

    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((4, 4, 4)))
    script = (
        "import sys, texvol; from texvol.scene.transfer import proposed_for; from texvol.cli import information\n"
        f"v = texvol.load({str(tmp_path / 'v.npy')!r}); proposed_for(v); information.metadata(v)\n"
        "assert 'cmap' not in sys.modules and 'texvol.formats.pictures.image' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
