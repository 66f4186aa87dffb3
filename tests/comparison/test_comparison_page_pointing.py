"""Zoom, position and the numbers of a pixel on the page of one pair, by mouse, touch and keyboard."""

from __future__ import annotations

import numpy as np
import pytest
from support.compared_pictures import blob, filled
from support.viewer import (
    PANE_SIZE,
    Open,
    at,
    color,
    fraction,
    frame,
    numbers,
    pointed,
    zoom,
)

from texvol.util import color as srgb


def test_zoom_is_the_same_in_all_panes_and_stays_at_the_mouse(open_page: Open) -> None:
    candidate, reference = blob(400, 300, 3), blob(400, 300)
    page = open_page(candidate, reference)
    start = zoom(page)
    page.key("+")
    # The wheel knows whole pixels of the screen only; two of them are one of the picture.
    x, y = at(page, *fraction(page, 120, 180, 400, 300))
    position = round(x), round(y)
    page.mouse("mouseMoved", *position)
    before = pointed(page)
    for _ in range(5):
        page.wheel(*position, -120)
    page.mouse("mouseMoved", *position)
    assert zoom(page) == pytest.approx(2 * start * 2 ** (5 * 120 / 200), rel=0.01)
    assert pointed(page) == before
    column, row = 120, 180
    assert before.startswith(f"Column {column}, row {row}:")
    shown = [
        (position[k] - each) / size
        for k, (each, size) in enumerate(zip(at(page, 0, 0), page.tell(PANE_SIZE), strict=True))
    ]
    for pane, picture in enumerate((candidate, reference)):
        # A pixel is several of the screen's, so that the middle of one has its colour and nothing of its neighbours'.
        wanted = np.rint(255 * srgb.srgb_from_linear(picture[row, column, :3]))
        assert np.abs(np.subtract(color(page, *shown, pane), wanted)).max() <= 1
    page.key("0")
    assert zoom(page) == start


def test_pixels_are_crisp(open_page: Open) -> None:
    reference = filled(8, 8, 0, 0, 0)
    reference[::2, ::2] = reference[1::2, 1::2] = 1
    page = open_page(reference * np.float32([1, 1, 0, 1]), reference)
    page.key("1")
    for _ in range(5):
        page.key("+")
    frame(page)
    levels = page.tell("""(() => { const c = document.querySelectorAll('.pane canvas')[1];
        const row = c.getContext('2d').getImageData(0, c.height / 2 + 9, c.width, 1).data;
        return [...new Set(row)].sort((a, b) => a - b); })()""")
    assert levels == [0, 255]


def test_keys_and_buttons_zoom_and_arrows_and_dragging_move(open_page: Open) -> None:
    page = open_page(blob(400, 300, 3), blob(400, 300))
    start = zoom(page)
    page.key("+")
    page.click("#zoom-in")
    assert zoom(page) == pytest.approx(4 * start, rel=0.01)
    page.key("-")
    page.click("#zoom-out")
    assert zoom(page) == pytest.approx(start, rel=0.01)
    page.key("1")
    assert zoom(page) == 100
    for _ in range(3):
        page.key("+")

    def middle() -> tuple[int, int]:
        page.mouse("mouseMoved", *at(page, 0.5, 0.5))
        column, row = pointed(page).split(":")[0].replace("Column ", "").split(", row ")
        return int(column), int(row)

    column, row = middle()
    page.key("ArrowRight")
    page.key("ArrowDown")
    right, down = middle()
    assert right > column and down > row
    page.key("ArrowLeft")
    page.key("ArrowUp")
    assert middle() == (column, row)
    page.drag([at(page, 0.5, 0.5), at(page, 0.4, 0.5), at(page, 0.25, 0.5)])
    width = page.tell("document.querySelector('.pane').clientWidth")
    assert middle()[0] - column == pytest.approx(0.25 * width / 8, abs=1.1)
    page.click("#zoom-fit")
    assert zoom(page) == start


def test_two_fingers_zoom(open_page: Open) -> None:
    page = open_page(blob(400, 300, 3), blob(400, 300), 400)
    page.tell("scrollTo(0, document.getElementById('stage').getBoundingClientRect().top)")
    start, a, b = zoom(page), at(page, 0.4, 0.5), at(page, 0.6, 0.5)
    apart = b[0] - a[0]
    page.touch("touchStart", a, b)
    for step in (10, 20, 30):
        page.touch("touchMove", (a[0] - step, a[1]), (b[0] + step, b[1]))
    page.touch("touchEnd")
    assert zoom(page) == pytest.approx(start * (apart + 60) / apart, rel=0.03)


def test_the_numbers_of_the_pixel_that_is_pointed_at_are_true(open_page: Open) -> None:
    rng = np.random.default_rng(2)
    reference = rng.normal(size=(4, 6, 4)).astype(np.float32) * 10.0 ** rng.integers(-20, 20, (4, 6, 4))
    reference = reference.astype(np.float32)
    candidate = (reference * (1 + rng.choice([0, 1e-6, -0.3, 5.0], (4, 6, 4)))).astype(np.float32)
    candidate[1, 2, 0], reference[1, 3, 1], candidate[2, 2, 3] = np.nan, np.inf, -np.inf
    page = open_page(candidate, reference)
    page.key("c")
    for row in range(4):
        for column in range(6):
            page.mouse("mouseMoved", *at(page, *fraction(page, column, row, 6, 4)))
            assert pointed(page).startswith(f"Column {column}, row {row}:")
            ours, theirs = candidate[row, column].astype(float), reference[row, column].astype(float)
            # The tolerances of pixel_data.py.
            assert numbers(page, "reference") == pytest.approx(theirs, rel=2**-15, nan_ok=True)
            assert numbers(page, "candidate") == pytest.approx(ours, rel=2**-14, nan_ok=True)
            assert numbers(page, "difference") == pytest.approx(ours - theirs, rel=5 * 2**-15, nan_ok=True)


def test_the_keyboard_chooses_a_pixel_and_goes_to_the_worst(open_page: Open) -> None:
    candidate, reference = blob(90, 70), blob(90, 70)
    candidate[12, 80, 2] += 0.5
    page = open_page(candidate, reference)
    page.key("x")
    assert pointed(page).startswith("Column 80, row 12:")
    assert numbers(page, "difference") == pytest.approx([0, 0, 0.5, 0], rel=5 * 2**-15)
    assert zoom(page) >= 1600
    page.key("ArrowLeft", shift=True)
    page.key("ArrowDown", shift=True)
    assert pointed(page).startswith("Column 79, row 13:")
    page.key("0")
    page.click("#worst")
    assert pointed(page).startswith("Column 80, row 12:")
