"""The tables of a comparison's page: what was measured beside its limits, and the two files."""

from __future__ import annotations

from texvol.comparison.html_parts import number
from texvol.comparison.limits import DRIVER_ATTRIBUTE, Limits
from texvol.comparison.measures import Measures
from texvol.comparison.outcome import Outcome
from texvol.comparison.pictures import Picture
from texvol.util.shown_text import escaped

_ROWS = (
    ("maximum", "max_error"),
    ("rms", "rms_error"),
    ("mean", "mean_error"),
    ("PSNR, dB", "psnr"),
    ("99th percentile", "percentile_99"),
    ("99.9th percentile", "percentile_99_9"),
)


def number_tables(measures: Measures, limits: Limits) -> str:
    """What is held against limits, and the differences themselves, colour and opacity apart."""
    return f"""<h2>Numbers</h2>
<p>Of linear light, colour premultiplied; {_unit(measures)}.</p>
<div class="wide"><table class="limits"><caption hidden>What is held against limits</caption>
<thead><tr><th scope="col">held against limits</th><th scope="col">measured</th><th scope="col">limit</th></tr></thead>
<tbody>{_limit_rows(measures, limits)}</tbody></table></div>
<p class="dim" style="margin-top: 6px">The limits are those of {escaped(limits.source)}. What the files' number formats
round away is not counted in this table, and is in the next.</p>
<div class="wide"><table class="numbers"><caption hidden>Differences</caption>
<thead><tr><th scope="col">difference</th><th scope="col">all</th><th scope="col">colour</th>
<th scope="col">opacity</th></tr></thead><tbody>{_part_rows(measures)}</tbody></table></div>"""


def _unit(measures: Measures) -> str:
    return "differences are in it" if measures.scale == 1 else f"differences are shares of {measures.scale:.6g}"


def _limit_rows(measures: Measures, limits: Limits) -> str:
    rows = (
        (f"pixels off by more than {number(limits.max_abs)}, %", measures.percent_over, limits.fail_percent),
        ("largest difference", measures.beyond_max, limits.hard_max),
        ("farthest outside of its neighbours", measures.outlier, limits.outlier),
        ("rms", measures.beyond_rms, limits.rms),
        ("ꟻLIP, mean", measures.beyond_flip, limits.flip),
    )
    cells = "".join(_limit_row(*each) for each in rows)
    return cells + f'<tr><th scope="row">SSIM</th><td>{number(measures.ssim, 6)}</td><td>none</td></tr>'


def _limit_row(name: str, value: float, limit: float) -> str:
    is_over, is_there = not value <= limit, limit < float("inf")
    sign = '<span title="over the limit">✕</span> ' if is_over else "✓ " if is_there else ""
    kind = ' class="over"' if is_over else ""
    return (
        f'<tr><th scope="row">{escaped(name)}</th><td{kind}>{sign}{number(value)}</td>'
        f"<td>{number(limit) if is_there else 'none'}</td></tr>"
    )


def _part_rows(measures: Measures) -> str:
    return "".join(
        f'<tr><th scope="row">{name}</th>'
        + "".join(f"<td>{_of_part(measures, part, key)}</td>" for part in ("all", "color", "opacity"))
        + "</tr>"
        for name, key in _ROWS
    )


def _of_part(measures: Measures, part: str, key: str) -> str:
    """A number, or a dash where there is no opacity."""
    return number(getattr(measures.parts[part], key)) if part in measures.parts else "–"


def worst_pixel_words(measures: Measures) -> str:
    """Where the pictures differ most, and what is there."""
    column, row = measures.worst_pixel
    ours, theirs = (", ".join(number(each) for each in values) for values in measures.worst_values)
    return f"column {column}, row {row}: candidate ({ours}), reference ({theirs}) of red, green, blue, opacity"


def file_table(outcome: Outcome) -> str:
    """The two files, side by side."""
    pair = outcome.candidate, outcome.reference
    rows = (
        ("file", [each.name for each in pair]),
        ("pixels", [size_words(each) for each in pair]),
        ("format", [each.words for each in pair]),
        ("driver", [each.attributes.get(DRIVER_ATTRIBUTE, "–") for each in pair]),
        ("software", [each.attributes.get("Software", "–") for each in pair]),
    )
    cells = "".join(
        f'<tr><th scope="row">{name}</th>'
        + "".join(f'<td class="words">{escaped(each)}</td>' for each in texts)
        + "</tr>"
        for name, texts in rows
    )
    return f"""<div class="wide"><table class="files"><thead><tr><th></th><th scope="col" class="words">candidate</th>
<th scope="col" class="words">reference</th></tr></thead><tbody>{cells}</tbody></table></div>"""


def size_words(picture: Picture) -> str:
    """Width and height."""
    height, width = picture.pixels.shape[:2]
    return f"{width} × {height}"
