"""All pictures of a run as one HTML page, worst first, with links to each one's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from texvol.comparison.entries import THUMBNAIL_DECADES
from texvol.comparison.html_parts import SIGNS, STATUSES, document, fact_list, listed, number, status_sign
from texvol.util.shown_text import escaped

_HINT = (
    "A new picture has no reference yet. Look at it, and if it is right run "
    "<code>pytest --texvol-update</code>, which makes the reference of it; then keep that with the tests."
)
_SCALE_WORDS = (
    f'<p class="dim">Differences are in false colour: black is a {10**THUMBNAIL_DECADES}th of the limit of a pixel or '
    f"less, purple and red the limit, pale yellow {10**THUMBNAIL_DECADES} times it or more; magenta is no number.</p>"
)
_NUMBERS = (
    ("max", "max_error"),
    ("rms", "rms_error"),
    ("pixels over, %", "percent_over"),
    ("SSIM", "ssim"),
    ("ꟻLIP", "flip"),
)


def index_page(
    entries: Sequence[Mapping[str, Any]],
    *,
    title: str = "Pictures",
    metadata: Mapping[str, str] = {},
    self_test: str = "",
) -> str:
    """The page's text.

    Parameters
    ----------
    entries : sequence
        As `entry_of` makes them; what one lacks is left out.
    facts : mapping
        What all of them were made with, such as the driver and versions.
    self_test : str
        HTML of a table that says which planted mistakes the limits catch.
    """
    ordered = sorted(entries, key=_badness)
    counts = {status: sum(_status(each) == status for each in ordered) for status in STATUSES}
    tested = f'<section id="self-test"><h2>What the limits catch</h2>\n{self_test}</section>' if self_test else ""
    made = f"<h2>Made with</h2>\n{fact_list(metadata)}" if metadata else ""
    body = f"""<h1>{escaped(title)}</h1>
{_summary(counts)}
{_filter(counts) if ordered else ""}
{f'<p class="hint">{_HINT}</p>' if counts["new"] else ""}
{_SCALE_WORDS if any("difference" in (each.get("thumbnails") or ()) for each in ordered) else ""}
<p id="none" role="status" hidden>No picture is of that kind.</p>
<div id="entries">
{"".join(_article(each, metadata) for each in ordered)}
</div>
{tested}
{made}"""
    return document(_page_title(title, counts), body, ("style.css", "index.css"), ("index.js",))


def _status(entry: Mapping[str, Any]) -> str:
    """The entry's status; one that is not known is a failure."""
    status = str(entry.get("status", "broken"))
    return status if status in STATUSES else "broken"


def _badness(entry: Mapping[str, Any]) -> tuple[int, float, str]:
    """Sorts the worst first: by status, by how far over the limits or near to them, by name."""
    status = _status(entry)
    excess = entry.get("excess") or 0.0
    if status == "same":
        excess = _rms_fraction(entry)
    return STATUSES.index(status), -excess, str(entry.get("name", ""))


def _rms_fraction(entry: Mapping[str, Any]) -> float:
    """How much of the limit of the rms difference is used up."""
    measures, limits = entry.get("measures") or {}, entry.get("limits") or {}
    return float((measures.get("beyond_rms") or 0.0) / (limits.get("rms") or 1.0))


def _page_title(title: str, counts: Mapping[str, int]) -> str:
    failed = sum(count for status, count in counts.items() if status != "same")
    return f"{failed} failed: {title}" if failed else title


def _summary(counts: Mapping[str, int]) -> str:
    total = sum(counts.values())
    if not total:
        return "<p>No pictures were compared.</p>"
    failed = total - counts["same"]
    pictures = "1 picture" if total == 1 else f"{total} pictures"
    if failed:
        verdict = f"{failed} of {pictures} failed."
    else:
        verdict = f"{pictures}: the same as " + ("its reference." if total == 1 else "their references.")
    return f'<p class="lead">{verdict}</p>'


def _filter(counts: Mapping[str, int]) -> str:
    buttons = "".join(
        f'<button type="button" data-status="{status}" aria-pressed="false"><span class="sign {status}" '
        f'data-sign="{sign}"></span>{status} <b>{counts[status]}</b></button>'
        for status, sign in SIGNS.items()
        if counts[status]
    )
    return f"""<div class="bar" role="group" aria-label="Which pictures to show">
<button type="button" data-status="" aria-pressed="true">all <b>{sum(counts.values())}</b></button>{buttons}
<label class="search">Find
<input type="search" id="search" placeholder="name, test, kind" autocomplete="off"></label></div>"""


def _article(entry: Mapping[str, Any], common: Mapping[str, str]) -> str:
    status, name = _status(entry), str(entry.get("name", "picture"))
    page = str(entry.get("page") or "")
    link = f'<a href="{escaped(quote(page))}">{escaped(name)}</a>' if page else escaped(name)
    test = f'<p class="dim">{escaped(str(entry["test"]))}</p>' if entry.get("test") else ""
    kinds, notes = entry.get("kinds") or (), entry.get("notes") or ()
    oracle = f"<p><b>Oracle:</b> {escaped(str(entry['oracle']))}</p>" if entry.get("oracle") else ""
    own = {key: value for key, value in (entry.get("facts") or {}).items() if common.get(key) != value}
    return f"""<article data-status="{status}">
<div class="thumbs">{_pictures(entry, page)}</div>
<div class="words"><h3>{status_sign(status)} {link}</h3>{test}
{listed(map(str, entry.get("violations") or ()))}
{f'<p class="kinds">{escaped("; ".join(map(str, kinds)))}</p>' if kinds else ""}{oracle}
{_numbers(entry)}
{f'<p class="dim">{escaped("; ".join(map(str, notes)))}</p>' if notes else ""}
{_own_metadata(own)}</div></article>
"""


def _pictures(entry: Mapping[str, Any], page: str) -> str:
    thumbnails = entry.get("thumbnails") or {}
    figures = []
    for role in ("candidate", "reference", "difference"):
        if role not in thumbnails:
            continue
        picture = f'<img src="{escaped(thumbnails[role])}" alt="{role}" decoding="async">'
        # The link of the name says where it goes; three more would only be in the way of the tab key.
        linked = f'<a href="{escaped(quote(page))}" tabindex="-1" aria-hidden="true">{picture}</a>' if page else picture
        figures.append(f"<figure>{linked}<figcaption>{role}</figcaption></figure>")
    return "".join(figures)


def _numbers(entry: Mapping[str, Any]) -> str:
    size = f"<span>{escaped(str(entry['size']))} pixels</span>" if entry.get("size") else ""
    measures = entry.get("measures")
    if not measures:
        return f'<p class="numbers">{size}</p>' if size else ""
    if measures.get("max_error") == 0:
        return f'<p class="numbers">{size}<span>every pixel is equal</span></p>'
    parts = "".join(
        f"<span>{name} <b>{_measured(measures.get(key))}</b></span>" for name, key in _NUMBERS if key in measures
    )
    return f'<p class="numbers">{size}{parts}</p>'


def _measured(value: float | None) -> str:
    """A measure; JSON has none for an infinity, which is what there is where a number is none."""
    return "∞" if value is None else number(value, 3)


def _own_metadata(metadata: Mapping[str, str]) -> str:
    return f"<details><summary>Made with</summary>{fact_list(metadata)}</details>" if metadata else ""
