"""The page of one pair in headless Chromium: its views, by mouse, touch and keyboard."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.compared_pictures import blob, filled
from support.viewer import (
    BLUE,
    GREEN,
    MAGENTA,
    RED,
    Open,
    at,
    color,
    fraction,
    frame,
    look,
    numbers,
    pointed,
    pressed,
    red_and_blue,
    zoom,
)

from texvol.formats.pictures import image
from texvol.util import color as srgb


# Every shape in a narrow window, light and dark; long ones in a wide window.
@pytest.mark.parametrize(
    "size, width, dark",
    [
        ((60, 40), 400, True),
        ((3, 2), 400, False),
        ((1400, 100), 400, True),
        ((30, 700), 400, False),
        ((1400, 100), 1280, False),
        ((30, 700), 1280, True),
    ],
)
def test_every_view_fits_the_window(
    open_page: Open, tmp_path: Path, size: tuple[int, int], width: int, dark: bool
) -> None:
    page = open_page(blob(*size, 0.3), blob(*size), width, dark=dark, flip=True)
    for key in "sbwdcf":
        page.key(key)
        frame(page)
        assert page.tell("document.documentElement.scrollWidth") <= width
        assert page.tell("Math.min(...[...document.querySelectorAll('.pane')].map(e => e.clientHeight))") >= 80
        assert page.tell("document.querySelector('#stage').clientHeight") <= 900
    smallest = page.tell("""Math.min(...[...document.querySelectorAll('main *')].filter(e => e.checkVisibility()
        && [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim())).map(e => {
            const drawing = e.ownerSVGElement;
            const shrunk = drawing ? drawing.clientWidth / drawing.viewBox.baseVal.width : 1;
            return shrunk * parseFloat(getComputedStyle(e).fontSize); }))""")
    assert smallest >= 11, "pixels; smaller letters can't be read"
    page.screenshot(tmp_path / "page.png")
    picture = image.read(tmp_path / "page.png")[..., :3]
    assert picture[2, 2].mean() < 0.2 if dark else picture[2, 2].mean() > 0.8


def test_buttons_are_large_enough_for_a_finger(open_page: Open) -> None:
    page = red_and_blue(open_page, width=400)
    for key in "sbwdc":
        page.key(key)
        heights = page.tell(
            "[...document.querySelectorAll('#viewer button, select')].filter(e => e.checkVisibility())"
            ".map(e => e.getBoundingClientRect().height)"
        )
        assert min(heights) >= 44


def test_side_by_side_shows_both_and_their_difference(open_page: Open) -> None:
    page = red_and_blue(open_page)
    assert [color(page, 0.1, 0.9, pane) for pane in range(3)] == [RED, BLUE, MAGENTA]


def test_blink_by_itself_by_key_and_by_hand(open_page: Open) -> None:
    page = red_and_blue(open_page)
    page.click("[data-mode=blink]")
    assert pressed(page) == "blink"
    page.tell(
        "(() => { const e = document.getElementById('rate'); e.value = 10; e.dispatchEvent(new Event('input')); })()"
    )
    seen = look(0.3, 0.9) + "[0]"
    for wanted in MAGENTA:
        page.wait_for(f"{seen} === {wanted}")
    page.key("p")
    assert color(page, 0.3, 0.9) == RED
    page.tell("new Promise(done => setTimeout(done, 300))")
    assert color(page, 0.3, 0.9) == RED, "by hand it stays"
    during: list[Any] = []
    page.key(" ", between=lambda: during.append(color(page, 0.3, 0.9)))
    page.drag([at(page, 0.5, 0.5)], lambda: during.append(color(page, 0.3, 0.9)))
    page.drag([page.middle("#hold")], lambda: during.append(color(page, 0.3, 0.9)))
    assert during == [BLUE] * 3
    assert color(page, 0.3, 0.9) == RED
    page.key("p")
    page.wait_for(f"{seen} === 0")


def test_the_rate_is_kept(open_page: Open) -> None:
    page = red_and_blue(open_page)
    page.key("b")
    assert page.tell("document.getElementById('rate-text').textContent") == "2 a second"
    page.tell("""(() => { window.turns = 0; let last = null; const look = () => {
        const now = document.querySelector('.tag').textContent; if (last !== null && now !== last) turns++; last = now;
        requestAnimationFrame(look); }; look(); })()""")
    page.key("]")
    page.key("]")
    assert page.tell("document.getElementById('rate-text').textContent") == "3 a second"
    page.tell(
        "(() => { const e = document.getElementById('rate'); e.value = 6; e.dispatchEvent(new Event('input')); })()"
    )
    page.tell("turns = 0")
    page.tell("new Promise(done => setTimeout(done, 1000))")
    # 6 in 1 s; one more or less at the ends, and one for a machine that is busy.
    assert 4 <= page.tell("turns") <= 8


def test_the_wipe_follows_mouse_touch_and_keys(open_page: Open) -> None:
    page = red_and_blue(open_page)
    page.click("[data-mode=wipe]")
    fraction = "Number(document.getElementById('divider').getAttribute('aria-valuenow'))"
    assert color(page, 0.45, 0.9) == RED and color(page, 0.55, 0.9) == BLUE
    page.drag([at(page, 0.5, 0.5), at(page, 0.4, 0.5), at(page, 0.35, 0.5)])
    assert page.tell(fraction) == 35
    # The picture is in the middle of the pane; 36 % and 34 % of the pane are within it.
    assert color(page, 0.45, 0.9) == BLUE
    page.drag([at(page, 0.6, 0.2), at(page, 0.7, 0.3)])
    assert page.tell(fraction) == 70, "where there is nothing to move, the picture is a handle too"
    for key, wanted in (("ArrowLeft", 69), ("ArrowRight", 70), ("Home", 0), ("End", 100), ("[", 95)):
        page.key(key)
        assert page.tell(fraction) == wanted
    page.touch("touchStart", at(page, 0.95, 0.5))
    page.touch("touchMove", at(page, 0.7, 0.5))
    page.touch("touchMove", at(page, 0.6, 0.5))
    page.touch("touchEnd")
    assert page.tell(fraction) == 60
    during: list[Any] = []
    page.key(" ", between=lambda: during.append(color(page, 0.5, 0.9)))
    assert during == [BLUE] and color(page, 0.5, 0.9) == RED


def test_difference_is_multiplied_by_the_gain(open_page: Open) -> None:
    page = open_page(filled(9, 9, 0.5, 0.25, 0.0), filled(9, 9, 0.5, 0.24, 0.0))
    page.key("d")
    # 0.01 is less than 2^-6, so it is shown 64 times.
    level = round(float(255 * srgb.srgb_from_linear(np.array(0.64))))
    assert page.tell("document.getElementById('gain-text').textContent") == "× 64"
    assert color(page, 0.5, 0.9) == pytest.approx((0, level, 0), abs=1)
    page.key("[")
    assert color(page, 0.5, 0.9)[1] == pytest.approx(255 * float(srgb.srgb_from_linear(np.array(0.32))), abs=1)
    page.tell("document.getElementById('gain').focus()")
    page.key("ArrowRight")
    assert color(page, 0.5, 0.9)[1] == pytest.approx(level, abs=1)


def test_false_colours_have_a_scale_with_the_limit(open_page: Open) -> None:
    reference = filled(40, 10, 0, 0, 0)
    candidate = reference.copy()
    candidate[..., 1] = np.repeat(10.0 ** np.arange(-5, -1), 10)
    page = open_page(candidate, reference)
    page.key("c")
    colors = [color(page, *fraction(page, 4 + 10 * k, 8, 40, 10)) for k in range(4)]
    brightness = [sum(each) for each in colors]
    assert brightness == sorted(set(brightness))
    ticks = page.tell("[...document.querySelectorAll('.ticks span')].map(e => e.textContent)")
    assert ticks == ["1e-7", "1e-6", "1e-5", "1e-4", "1e-3", "1e-2"]
    assert page.tell("document.querySelector('.limit').style.left") == "80%"


def test_what_is_no_number_is_magenta_and_explained(open_page: Open) -> None:
    candidate, reference = filled(30, 20, 0, 1, 0), filled(30, 20, 0, 1, 0)
    candidate[15, 22, 0] = np.nan
    page = open_page(candidate, reference)
    assert page.tell("document.getElementById('not-finite').checkVisibility()")
    page.key("m")
    position = fraction(page, 22, 15, 30, 20)
    assert [color(page, *position, pane) for pane in range(3)] == [MAGENTA, GREEN, MAGENTA]
    page.click("#next-broken")
    assert pointed(page).startswith("Column 22, row 15:")


def test_pictures_of_two_sizes_are_shown_beside_each_other(open_page: Open) -> None:
    page = open_page(filled(40, 30, 1, 0, 0), filled(20, 50, 0, 0, 1))
    assert page.tell("[...document.querySelectorAll('[data-mode]:enabled')].map(e => e.dataset.mode)") == ["side"]
    for key in "bwdcfx":
        page.key(key)
    assert pressed(page) == "side"
    assert color(page, 0.5, 0.1) == RED and color(page, 0.5, 0.95, 1) == BLUE
    page.mouse("mouseMoved", *at(page, 0.4, 0.9))
    assert math.isnan(numbers(page, "candidate")[0]) and numbers(page, "reference")[2] == 1


def test_opacity_and_what_is_behind(open_page: Open) -> None:
    clear = np.zeros((20, 20, 4), np.float32)
    clear[:, 10:] = [0.25, 0, 0, 0.5]
    page = open_page(clear, clear * np.float32(0.9))
    grey = {color(page, x, 0.9) for x in (0.06, 0.11, 0.16, 0.21)}
    assert len(grey) == 2 and all(r == g == b for r, g, b in grey), "a checker"
    page.key("g")
    assert color(page, 0.1, 0.9) == (0, 0, 0)
    page.key("g")
    assert color(page, 0.1, 0.9) == (255, 255, 255)
    # Over white, 0.25 + (1 - 0.5) in linear light.
    assert color(page, 0.9, 0.9)[0] == pytest.approx(255 * float(srgb.srgb_from_linear(np.array(0.75))), abs=1)
    for _ in range(4):
        page.key("k")
    assert color(page, 0.9, 0.9)[0] == pytest.approx(127.5, abs=1) and color(page, 0.1, 0.9) == (0, 0, 0)


def test_exposure_brings_back_what_is_over_one(open_page: Open) -> None:
    page = open_page(filled(9, 9, 2, 0, 0), filled(9, 9, 2.5, 0, 0))
    assert color(page, 0.5, 0.9) == RED
    for _ in range(4):
        page.key(",")
    assert color(page, 0.5, 0.9)[0] == pytest.approx(255 * float(srgb.srgb_from_linear(np.array(0.5))), abs=1)
    assert "brighter than 1" in page.tell("document.querySelector('.clipped').textContent")


def test_the_address_keeps_what_is_looked_at(open_page: Open) -> None:
    page = red_and_blue(open_page)
    page.key("w")
    page.wait_for("location.hash.includes('mode=wipe')")
    fragment = "#mode=difference&gain=3&zoom=20&x=30&y=20&pixel=31%2C22"
    page = red_and_blue(open_page, fragment=fragment)
    assert pressed(page) == "difference" and zoom(page) == 2000
    assert pointed(page).startswith("Column 31, row 22:")
    page = red_and_blue(open_page, fragment="#mode=constructor&gain=x&zoom=&pixel=,&channel=9")
    assert pressed(page) == "side"


def test_the_keyboard_alone_is_enough(open_page: Open) -> None:
    page = red_and_blue(open_page)
    focused = "document.activeElement.dataset.mode ?? document.activeElement.id"
    order = []
    for _ in range(5):
        page.key("Tab")
        order.append(page.tell(focused))
    assert order == ["side", "blink", "wipe", "difference", "false"]
    page.key("Enter")
    assert pressed(page) == "false" and page.tell(focused) == "false", "it stays on the button"
    page.key("Tab")
    assert page.tell(focused) == "stage"
    page.key("?")
    assert page.tell("document.getElementById('keys').open") is True
    unnamed = page.tell("""[...document.querySelectorAll('button, input, select, [role]')].filter(e => !(e.ariaLabel
        || e.textContent.trim() || e.labels?.length || e.id === 'readout')).map(e => e.outerHTML)""")
    assert unnamed == []


def test_equal_pictures_have_nothing_to_mark(open_page: Open) -> None:
    page = open_page(blob(30, 20), blob(30, 20))
    assert page.tell("document.getElementById('worst').checkVisibility()") is False
    page.key("d")
    assert color(page, 0.5, 0.5) == (0, 0, 0)
    assert page.tell("document.querySelectorAll('.histogram').length") == 0


def test_a_large_picture_works(open_page: Open) -> None:
    # More numbers than a function may have arguments, some 120,000 in V8.
    page = open_page(blob(640, 480, 0.5), blob(640, 480))
    page.key("c")
    page.key("x")
    assert max(map(abs, numbers(page, "difference"))) > 1e-3
