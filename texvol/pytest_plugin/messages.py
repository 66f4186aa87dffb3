"""Messages of a failed picture: the broken limits, the kind of difference, the files, and the command to update."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from texvol.comparison.outcome import Outcome

_MOST_LINES = 3  # of each list; the page has the rest


def difference(outcome: Outcome, repeats: str) -> list[str]:
    """Lines on a picture that is different or broken."""
    lines = [
        f"picture {outcome.name!r} is {outcome.status}",
        *first(outcome.violations, _MOST_LINES),
        *outcome.scene_words,
    ]
    lines += first([kind.words for kind in outcome.kinds], _MOST_LINES)
    if outcome.measures is not None and outcome.measures.max_error > 0:
        (column, row), (ours, theirs) = outcome.measures.worst_pixel, outcome.measures.worst_values
        lines.append(f"worst pixel: column {column}, row {row}, {_rgba(ours)}, reference {_rgba(theirs)}")
    if outcome.three_way is not None:
        lines.append(outcome.three_way.words)
    lines += outcome.notes
    return [*lines, *([repeats] if repeats else [])]


def positions(candidate: str | None, reference: str, page: str | None) -> list[str]:
    """Lines with the paths of candidate, reference and page."""
    found = {"candidate": candidate, "reference": reference, "page": page}
    return [f"{what + ':':11}{position}" for what, position in found.items() if position]


def how_to_update(test: str) -> str:
    """Line with the command that makes the candidate the reference."""
    quoted = f"'{test}'" if any(each in test for each in " []()") else test
    return f"look at the candidate, and if it is right: pytest --texvol-update {quoted}"


def first(lines: Sequence[str], most: int) -> list[str]:
    """Return the first lines, and a line that counts the rest."""
    more = len(lines) - most
    return [*lines[:most], *([f"and {more} more"] if more > 0 else [])]


def _rgba(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in values) + ")"
