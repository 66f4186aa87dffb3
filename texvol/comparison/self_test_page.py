"""HTML of a self-test of limits: the table of mistakes, each with a small picture and what it changes."""

from __future__ import annotations

from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from texvol.comparison.self_test import SelfTest
from texvol.comparison.templates import rendered
from texvol.formats.pictures.page_pictures import data_url, png
from texvol.util.shown_text import shown

_MOST_GAIN = 20  # powers of two; differences below a millionth are rounding


def page(test: SelfTest) -> str:
    """Return a whole page."""
    return rendered("self_test.html", title=f"Mistakes that the limits find: {test.name}", **_context(test))


def fragment(test: SelfTest) -> str:
    """Return the table and the cards alone, for a page that has style.css and self_test.css."""
    return rendered("self_test_table.html", **_context(test))


def failure(name: str, error: Exception) -> str:
    """Return the paragraph that replaces the table if the self-test of a picture failed."""
    return Markup("<p>{}: {}</p>").format(shown(name), shown(error))


def _context(test: SelfTest) -> dict[str, Any]:
    shown = (row for row in test.rows if row.picture is not None and not row.is_control)
    return {
        "test": test,
        "right": _url(test.right),
        "cards": [{"row": row, **_pictures(row.picture, test.right)} for row in shown],
    }


def _pictures(picture: NDArray[np.float64] | None, right: NDArray[np.float64]) -> dict[str, Any]:
    """Addresses of a picture and of its difference from the right one, and the gain of the difference."""
    assert picture is not None
    difference = np.abs(picture - right)
    largest = float(difference[..., :3].max())
    gain = 2.0 ** int(np.clip(np.floor(-np.log2(largest)), 0, _MOST_GAIN)) if largest > 0 else 1.0
    return {"picture": _url(picture), "difference": _url(difference * gain), "gain": gain}


def _url(picture: NDArray[np.float64]) -> str:
    return data_url(png(np.asarray(picture, np.float32)))
