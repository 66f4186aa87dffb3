"""The legend: colours, opacities and numbers stand where their values do, in each mode."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.annotated import blank, crooked
from support.scenes import BONE, FOG

from texvol.annotation import Annotation, annotate
from texvol.annotation.drawing import place_all
from texvol.annotation.legend import draw_legends
from texvol.annotation.legend_content import Content, contents_of
from texvol.annotation.lettering import Lettering
from texvol.scene import display, transfer
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError

SIZE = (400, 500)
# Values from 0 to 1, both among them.
RAMP = Volume(np.linspace(0, 1, 64).reshape(4, 4, 4), unit="mm", name="ramp")
STEP = TransferFunction(
    np.array([0, 0.5, 0.5, 1]), np.array([(0.1, 0.2, 0.9)] * 2 + [(0.9, 0.6, 0.1)] * 2), np.array([0.1, 0.1, 3.0, 3.0])
)


def content_of(scene: Scene, value_name: str, window: display.Window | None) -> Content:
    """The content of the only legend of a scene."""
    (content,) = contents_of(scene, value_name, window, Lettering())
    return content


def content(**scene: Any) -> Content:
    return content_of(Scene(RAMP, **({"classification": "slab"} | scene)), "", None)


def drawn(scene: Scene) -> tuple[np.ndarray, dict[str, Any]]:
    """The legend over black with white ink, and where its numbers are written."""
    sheet, _ = blank(scene, SIZE)
    draw_legends(sheet, [content_of(scene, "", None)])
    return sheet.over(np.zeros((SIZE[1], SIZE[0], 4)), (0, 0, 0)), dict(zip(sheet.texts, sheet.written, strict=True))


def middle(rect: Any) -> float:
    """Height of the middle of figures."""
    return float(rect.top + rect.bottom) / 2


@pytest.mark.parametrize("medium", [FOG, STEP, BONE])
def test_the_colours_beside_a_number_are_those_of_its_value(medium: TransferFunction) -> None:
    scene = Scene(RAMP, medium, classification="slab")
    picture, texts = drawn(scene)
    numbers = {float(text): rect for text, rect in texts.items() if rect.left > texts["0"].right + 5 and "." in text}
    assert len(numbers) >= 4
    low, high = min(numbers), max(numbers)
    column = int(texts["0"].left + texts["0"].right) // 2 + 8  # the 0 of the opacities stands at the bar's left side
    per_value = (middle(numbers[low]) - middle(numbers[high])) / (high - low)
    for row in range(int(middle(numbers[high])) + 3, int(middle(numbers[low])) - 3):
        value = low + (middle(numbers[low]) - row - 0.5) / per_value
        # Figures stand on whole pixels: values are known to one.
        near = transfer_colors(medium, value + np.linspace(-1.5, 1.5, 31) / per_value)
        found = picture[row, column, :3]
        assert (found >= near.min(axis=0) - 1e-3).all()
        assert (found <= near.max(axis=0) + 1e-3).all()


def transfer_colors(medium: TransferFunction, values: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(values, medium.values, medium.colors[:, part]) for part in range(3)], axis=1)


def test_the_opacity_reaches_as_far_as_it_is_and_says_of_which_length() -> None:
    """Extinctions 0.1 and 3 per mm: the least round length of 0.9 for the denser is ln 10 / 3 = 0.77, so 1 mm."""
    picture, texts = drawn(Scene(RAMP, STEP, classification="slab"))
    assert {"opacity of", "1 mm"} <= set(texts)
    left, right = texts["1"].left, (texts["0"].left + texts["0"].right) / 2  # of what goes from 1 to 0
    top, bottom = middle(texts["1.0"]), middle(texts["0.0"])
    for fraction, extinction, color in ((0.25, 0.1, (0.1, 0.2, 0.9)), (0.75, 3.0, (0.9, 0.6, 0.1))):
        row = picture[int(bottom + fraction * (top - bottom)), round(left) : round(right), :3]
        # The frame and the line along the end of the opacities are white, and a bit more than one pixel wide.
        filled = np.abs(row - color).max(axis=1) < 1e-6
        wanted = (right - left) * -np.expm1(-extinction)
        assert filled.sum() == pytest.approx(wanted, abs=4.5)  # a pixel at each end, and the line's half twice
        assert filled[::-1][2 : max(int(wanted) - 4, 2)].all()


def test_infinite_extinction_is_opaque_and_none_has_a_length_too() -> None:
    solid = TransferFunction(np.array([0.0, 1.0]), np.full((2, 3), 0.5), np.array([0.0, np.inf]))
    bar = content(transfer_function=solid).bar
    assert bar is not None
    assert bar.opacities is not None
    np.testing.assert_array_equal(bar.opacities(np.array([0.0, 0.5])), [0, 1])
    nothing = TransferFunction(np.zeros(1), np.zeros((1, 3)), np.zeros(1))
    assert content(transfer_function=nothing).bar is not None


def test_the_range_is_where_colours_change_among_the_volumes_values() -> None:
    bar = content(transfer_function=STEP).bar
    assert bar is not None
    assert (bar.low, bar.high) == (0, 1)
    narrow = TransferFunction(np.array([0.4, 0.6]), np.full((2, 3), 0.5), np.array([0.0, 1.0]))
    bar = content(transfer_function=narrow).bar
    assert bar is not None
    assert (bar.low, bar.high) == pytest.approx((0.39, 0.61))  # with 5 % on either side
    elsewhere = TransferFunction(np.array([4.0, 6.0]), np.full((2, 3), 0.5), np.array([0.0, 1.0]))
    bar = content(transfer_function=elsewhere).bar
    assert bar is not None
    assert (bar.low, bar.high) == (0, 1)


@pytest.mark.parametrize("values", [np.zeros((2, 2, 2)), np.full((2, 2, 2), np.nan), np.full((2, 2, 2), 1e300)])
def test_volumes_of_one_value_or_none_have_a_legend(values: np.ndarray) -> None:
    for mode in ("composite", "mip"):
        scene = Scene(Volume(values), mode=mode, classification="slab")  # type: ignore[arg-type]
        sheet, _ = blank(scene, SIZE)
        draw_legends(sheet, [content_of(scene, "", None)])
        assert sheet.texts


def test_what_depends_on_the_gradient_is_shown_where_there_is_most_of_it() -> None:
    text = """{"points": [{"value": 0, "color": [0, 0, 1], "extinction": 1}], "gradient": [[0, 0], [10, 0.5]],
               "contours": [{"value": 0.25, "world_thickness": 1, "color": [1, 0, 0], "extinction": 2}]}"""
    scene = Scene(RAMP, transfer.loads(text), classification="slab")
    bar = content_of(scene, "", None).bar
    assert bar is not None
    assert bar.opacities is not None
    assert bar.opacity_of == ("opacity of", "2 mm", "at full gradient")  # ln 10 / 2 = 1.15
    np.testing.assert_allclose(bar.opacities(np.array([0.5])), -np.expm1(-0.5 * 2))
    ((value, color, opacity),) = bar.contours
    assert (value, opacity) == (0.25, pytest.approx(-np.expm1(-2 * 2)))
    np.testing.assert_allclose(color, (1, 0, 0))


def test_materials_are_named() -> None:
    text = """{"materials": [{"name": "fat", "to": [0.2, 0.3], "color": [1, 1, 0], "extinction": 1},
                             {"name": "bone", "from": [0.6, 0.7], "color": [1, 1, 1], "extinction": 1}]}"""
    scene = Scene(RAMP, transfer.loads(text), classification="slab")
    _, texts = drawn(scene)
    assert {"fat", "bone"} <= set(texts)
    assert scene.transfer_function is not None
    again = transfer.loads(json.dumps(scene.transfer_function.as_json()))
    for (_, color), wanted in zip(
        content_of(Scene(RAMP, again, classification="slab"), "", None).entries, [(1, 1, 0), (1, 1, 1)], strict=True
    ):
        np.testing.assert_array_equal(color, wanted)
    # Between them is nothing, and no colour of it.
    bar = content_of(scene, "", None).bar
    assert bar is not None
    assert np.isnan(bar.colors(np.array([0.45]))).all()
    assert np.isfinite(bar.colors(np.array([0.1, 0.9]))).all()


def test_modes_of_numbers_show_their_window() -> None:
    for mode, caption in (("mip", "largest value"), ("minip", "least value")):
        found = content(mode=mode)
        assert found.caption == caption
        assert found.bar is not None
        assert (found.bar.low, found.bar.high) == (0, 1)
    scene = Scene(RAMP, mode="xray", classification="slab")
    found = content_of(scene, "", (10, 4))
    assert found.caption == "value × mm"
    assert found.bar is not None
    assert (found.bar.low, found.bar.high) == (8, 12)
    np.testing.assert_allclose(
        found.bar.colors(np.array([8, 9.0, 12])), linear_from_srgb(np.array([[0], [0.25], [1]])) * [1, 1, 1]
    )
    assert content_of(scene, "HU", (10, 4)).caption == "HU × mm"
    with pytest.raises(InputError, match="window is missing; the legend of mode xray needs the window"):
        content_of(scene, "", None)
    for air, said in ((-100.5, "HU above −100.5 × mm"), (0, "HU × mm"), ("hounsfield", "mm of water")):
        assert content_of(Scene(RAMP, mode="xray", air=air, classification="slab"), "HU", (10, 4)).caption == said
    colored = Scene(RAMP, STEP, mode="mip", coloring="tf", classification="slab")
    bar = content_of(colored, "", None).bar
    assert bar is not None
    np.testing.assert_array_equal(bar.colors(np.array([0.75])), [(0.9, 0.6, 0.1)])


def test_an_isosurface_shows_its_colour_and_value() -> None:
    scene = Scene(RAMP, mode="isosurface", isovalue=-0.25, classification="slab")
    found = content_of(scene, "HU", None)
    ((name, color),) = found.entries
    assert name == "HU = −0.25"
    np.testing.assert_array_equal(color, display.ISOSURFACE_COLOR)
    picture, texts = drawn(scene)
    assert list(texts) == ["value = −0.25"]
    swatch = (0.9 * SIZE[1] / 40 - 2) ** 2  # nine tenths of an em wide and high, in a frame of a pixel
    assert (np.abs(picture[..., :3] - display.ISOSURFACE_COLOR).max(axis=2) < 1e-9).sum() > 0.9 * swatch


def test_what_has_no_room_is_left_out() -> None:
    """First the opacity, then all of it."""
    scene = Scene(crooked(), FOG, classification="slab")
    found = []
    for width in (400, 60, 20):
        sheet, view = blank(scene, (width, 400))
        place_all(sheet, view, scene, Annotation(legend=True), None)
        found.append(("opacity of" in sheet.texts, "value" in sheet.texts))
    assert found == [(True, True), (False, True), (False, False)]


def test_a_name_of_the_values_stands_above() -> None:
    scene = Scene(RAMP, FOG, classification="slab")
    sheet, view = blank(scene, SIZE)
    place_all(sheet, view, scene, Annotation(legend=True, value_name="CT number (HU)"), None)
    assert "CT number (HU)" in sheet.texts
    assert "value" not in sheet.texts


def test_the_window_reaches_the_picture() -> None:
    scene = Scene(RAMP, mode="average", classification="slab")
    picture = np.zeros((SIZE[1], SIZE[0], 4), np.float32)
    shown = [annotate(picture, scene, SIZE, Annotation(legend=True), window=window) for window in ((0.5, 1), (50, 100))]
    assert (shown[0] != shown[1]).any()


@pytest.mark.parametrize("size", [(200, 200), (320, 240), (400, 600), (1280, 720), (2160, 2160)])
@pytest.mark.parametrize("name", ["", "pressure at the inlet (Pa)"])
@pytest.mark.parametrize("with_opacity", [True, False])
def test_numbers_at_the_ends_of_the_bar_keep_away_from_the_texts_above_and_below(
    size: tuple[int, int], name: str, with_opacity: bool
) -> None:
    """Numbers 0.0 and 1.0 stand at the ends of the bar, and texts reach over and under them."""
    scene = Scene(RAMP, STEP, classification="slab")
    found = content_of(scene, name, None)
    assert found.bar is not None
    bar = found.bar if with_opacity else replace(found.bar, opacities=None)
    sheet, view = blank(scene, size)
    place_all(sheet, view, scene, Annotation(title="A title as long as the picture is wide, " * 2), None)
    draw_legends(sheet, [replace(found, bar=bar, entries=(("a material with a long name", None),))])
    texts = dict(zip(sheet.texts, sheet.written, strict=True))
    assert {"0.0", "1.0"} <= set(texts), "both ends have a number"
    for number in ("0.0", "1.0"):
        around = texts[number].grown(0.3 * sheet.em)
        assert not [text for text, rect in texts.items() if text != number and around.meets(rect)]
        ends = texts[number]
        around_all = [rect for rect in sheet.taken if rect.top <= ends.top and rect.bottom >= ends.bottom]
        assert any(rect.left <= ends.left and rect.right >= ends.right for rect in around_all)
