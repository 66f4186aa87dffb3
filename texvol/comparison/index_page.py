"""HTML page of all pictures of a run, worst first, with links to the pages of single pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from markupsafe import Markup

from texvol.comparison.entries import THUMBNAIL_DECADES
from texvol.comparison.templates import SIGNS, rendered

_STATUSES = tuple(SIGNS)
_EMPTY: dict[str, Any] = {
    **{"name": "picture", "test": "", "page": "", "size": "", "oracle": None, "measures": None},
    **{"violations": (), "kinds": (), "notes": (), "thumbnails": {}, "facts": {}},
    "accept": "",
}


def index_page(
    entries: Sequence[Mapping[str, Any]],
    *,
    title: str = "Pictures",
    metadata: Mapping[str, str] = {},
    self_test: str = "",
    accept: str = "",
) -> str:
    """Return the page's HTML.

    Parameters
    ----------
    entries : sequence of mapping
        As `entry_of` returns them; keys may be missing.
    metadata : mapping
        Driver, versions and the like that all pictures were made with.
    self_test : str
        HTML of the table of planted mistakes, from `self_test_page.fragment`.
    accept : str
        Command line that accepts pictures of this report, to which names are added: those of the entries' key `accept`.
    """
    ordered = sorted((_completed(each, metadata) for each in entries), key=_badness)
    counts = Counter(each["status"] for each in ordered)
    failed = len(ordered) - counts["same"]
    return rendered(
        "index.html",
        title=f"{failed} failed: {title}" if failed else title,
        heading=title,
        failed=failed,
        entries=ordered,
        counts=counts,
        scale=10**THUMBNAIL_DECADES,
        self_test=Markup(self_test),
        metadata=metadata,
        accept=accept,
    )


def _completed(entry: Mapping[str, Any], common: Mapping[str, str]) -> dict[str, Any]:
    """Return the entry with all keys; an unknown status counts as broken. Metadata in `common` are left out."""
    full = _EMPTY | {key: value for key, value in entry.items() if value is not None}
    status = full.get("status")
    own = {key: value for key, value in full["facts"].items() if common.get(key) != value}
    return full | {"status": status if status in _STATUSES else "broken", "own_metadata": own}


def _badness(entry: Mapping[str, Any]) -> tuple[int, float, str]:
    """Sorting key, worst first: status, then distance from the limits, then name."""
    status = entry["status"]
    measures, limits = entry["measures"] or {}, entry.get("limits") or {}
    rms = (measures.get("beyond_rms") or 0.0) / (limits.get("rms") or 1.0)
    excess = rms if status == "same" else entry.get("excess") or 0.0
    return _STATUSES.index(status), -excess, str(entry["name"])
