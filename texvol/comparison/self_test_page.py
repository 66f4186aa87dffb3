"""What limits catch, as HTML: the table of mistakes, each with a small picture and what it changes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.html_parts import document, listed, number
from texvol.comparison.self_test import CAUGHT, FALSE_ALARM, MISSED, SAME, Row, SelfTest
from texvol.formats.pictures.page_pictures import data_url, png
from texvol.util.shown_text import escaped

STYLES = ("style.css", "self_test.css")
# A sign beside the colour, which not everybody sees.
_GOOD, _BAD = {CAUGHT: "✓", SAME: "✓"}, {MISSED: "✕", FALSE_ALARM: "✕"}
_WORDS = ' class="words"'
_HEAD = (
    *(("mistake", ""), ("outcome", _WORDS), ("by", _WORDS), ("largest", ""), ("rms", ""), ("ꟻLIP", "")),
    *(("% over", ""), ("told from the pictures as", _WORDS)),
)
_MOST_GAIN = 20  # powers of two: a millionth is what rounding leaves, and shows nothing


def page(test: SelfTest) -> str:
    """A whole page."""
    title = f"What the limits catch: {test.name}"
    return document(title, f"<h1>{escaped(title)}</h1>{fragment(test)}", STYLES, ())


def fragment(test: SelfTest) -> str:
    """What comes under a heading of a page that has `STYLES`."""
    width, height = test.size
    limits = ", ".join(f"{name} {value:.3g}" for name, value in test.limits.as_json().items() if _is_limit(value))
    about = (
        f"Mistakes planted in the scene, drawn at {width} × {height} by {test.driver}, and held against the right "
        f"picture with the limits “{test.limits.source}”: {limits}."
    )
    rows = "".join(map(_table_row, test.rows))
    right = f'<img alt="the right picture" src="{_url(test.right)}"><figcaption><b>right</b></figcaption>'
    return f"""<p><b>{escaped(test.words)}.</b> {escaped(about)}</p>
<div class="wide" tabindex="0"><table class="planted">
<thead><tr>{"".join(f'<th scope="col"{kind}>{name}</th>' for name, kind in _HEAD)}</tr></thead>
<tbody>{rows}</tbody></table></div>
{listed(f"{row.name}: {row.reason}" for row in test.rows if row.reason)}
<div class="cards">
<figure class="card">{right}</figure>
{"".join(_card(row, test.right) for row in test.rows if row.picture is not None and not row.is_control)}
</div>"""


def _table_row(row: Row) -> str:
    measures = row.measures
    numbers = [None] * 4
    if measures is not None:
        numbers = [measures.max_error, measures.rms_error, measures.flip, measures.percent_over]  # type: ignore[list-item]
    cells = "".join(f"<td>{number(each, 2)}</td>" for each in numbers)
    by, told = (f'<td class="words">{escaped(each)}</td>' for each in (", ".join(row.caught_by), row.told))
    name = f'<th scope="row">{escaped(row.name)}</th>'
    return f'<tr>{name}<td class="words">{_outcome(row)}</td>{by}{cells}{told}</tr>'


def _outcome(row: Row) -> str:
    kind = "good" if row.status in _GOOD else "bad" if row.status in _BAD else "none"
    sign = (_GOOD | _BAD).get(row.status, "")
    return f'<span class="outcome {kind}">{sign} {escaped(row.status)}</span>'


def _card(row: Row, right: NDArray[np.float64]) -> str:
    assert row.picture is not None
    difference = np.abs(row.picture - right)
    largest = float(difference[..., :3].max())
    gain = 2.0 ** int(np.clip(np.floor(-np.log2(largest)), 0, _MOST_GAIN)) if largest > 0 else 1.0
    told = row.outcome.kinds if row.outcome else ()
    seen = "; ".join(each.words for each in told)
    return (
        f'<figure class="card"><div class="pair"><img alt="{escaped(row.name)}" src="{_url(row.picture)}">'
        f'<img alt="difference times {gain:g}" src="{_url(difference * gain)}"></div>'
        f"<figcaption><b>{escaped(row.name)}</b>: {escaped(row.words)}. {_outcome(row)}; difference × {gain:g}."
        f"{f' Told from the pictures: {escaped(seen)}.' if seen else ''}</figcaption></figure>"
    )


def _url(picture: NDArray[np.float64]) -> str:
    return data_url(png(np.asarray(picture, np.float32)))


def _is_limit(value: object) -> bool:
    return isinstance(value, int | float)
