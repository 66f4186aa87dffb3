"""The page of a pair opened in a browser, and what can be seen and read on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from support.browser import Browser, Page
from support.compared_pictures import filled, outcome_of

RED, BLUE, GREEN, MAGENTA = (255, 0, 0), (0, 0, 255), (0, 255, 0), (255, 0, 255)
Open = Callable[..., Page]


@pytest.fixture
def open_page(browser: Browser, tmp_path: Path) -> Iterator[Open]:
    """Opens the page of a pair; at the end it must have neither complained nor asked for anything."""
    from texvol.comparison.page import comparison_page

    opened: list[Page] = []

    def close() -> None:
        for page in opened:
            assert page.complaints() == []
            assert page.requests() == []
            page.close()
        opened.clear()

    def open_pair(candidate: Any, reference: Any, width: int = 1280, *, flip: bool = False, **how: Any) -> Page:
        close()
        path = tmp_path / "page.html"
        path.write_text(comparison_page(outcome_of(candidate, reference, explain=False), flip=flip), "utf-8")
        opened.append(Page(browser, path, width, **how))
        opened[-1].wait_for("document.documentElement.dataset.ready === 'true'")
        return opened[-1]

    yield open_pair
    close()


def frame(page: Page) -> None:
    """Wait until what was asked for is drawn."""
    page.tell("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


# Each look is at a copy of its own: a browser complains of a canvas that is read again and again.
LOOK = """(() => { const c = document.querySelectorAll('.pane canvas')[PANE];
const copy = new OffscreenCanvas(1, 1).getContext('2d');
copy.drawImage(c, -Math.floor(ACROSS * c.width), -Math.floor(DOWN * c.height));
return [...copy.getImageData(0, 0, 1, 1).data].slice(0, 3); })()"""
PANE_SIZE = "(() => { const p = document.querySelector('.pane'); return [p.clientWidth, p.clientHeight]; })()"


def look(x: float, y: float, pane: int = 0) -> str:
    """Script that tells the colour at (x, y) of a pane, as shares of its size."""
    return LOOK.replace("PANE", str(pane)).replace("ACROSS", str(x)).replace("DOWN", str(y))


def color(page: Page, x: float, y: float, pane: int = 0) -> tuple[int, ...]:
    """Colour at (x, y) of a pane, as shares of its size."""
    frame(page)
    return tuple(page.tell(look(x, y, pane)))


def fraction(page: Page, column: float, row: float, width: int, height: int) -> tuple[float, float]:
    """Where the middle of a pixel is in a pane that shows a whole picture, as shares of the pane's size."""
    across, tall = page.tell(PANE_SIZE)
    side = zoom(page) / 100
    return 0.5 + (column + 0.5 - width / 2) * side / across, 0.5 + (row + 0.5 - height / 2) * side / tall


def at(page: Page, x: float, y: float, pane: int = 0) -> tuple[float, float]:
    """Place in the window of a place in a pane, as shares of its size."""
    page.middle(f".pane:nth-of-type({pane + 1})")
    left, top, width, height = page.tell(
        f"(() => {{ const b = document.querySelectorAll('.pane')[{pane}].getBoundingClientRect();"
        "return [b.x, b.y, b.width, b.height]; })()"
    )
    return left + x * width, top + y * height


def zoom(page: Page) -> float:
    return float(page.tell("parseFloat(document.getElementById('zoom-text').textContent)"))


def numbers(page: Page, name: str) -> list[float]:
    values = page.tell(f"[...document.querySelectorAll('tr[data-picture={name}] td')].map(e => e.dataset.value)")
    return [float(each) if each else math.nan for each in values]


def pointed(page: Page) -> str:
    return str(page.tell("document.querySelector('#readout caption').textContent"))


def pressed(page: Page) -> str:
    return str(page.tell("document.querySelector('[data-mode][aria-pressed=true]').dataset.mode"))


def red_and_blue(open_page: Open, **how: Any) -> Page:
    """A page of a red candidate and a blue reference."""
    return open_page(filled(40, 30, 1, 0, 0), filled(40, 30, 0, 0, 1), **how)
