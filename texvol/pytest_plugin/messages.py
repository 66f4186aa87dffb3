"""Messages of a failed picture: the broken limits, the kind of difference, the files, and the command to update."""

from __future__ import annotations

from pathlib import Path

from texvol.comparison.outcome import Outcome

_MOST_LINES = 3  # of each list; the page has the rest


def difference(outcome: Outcome, repeats: str) -> list[str]:
    """Lines on a picture that is different or broken."""
    lines = [f"picture {outcome.name!r} is {outcome.status}", *_some(outcome.violations), *outcome.scene_words]
    lines += _some(tuple(kind.words for kind in outcome.kinds))
    if outcome.measures is not None and outcome.measures.max_error > 0:
        (column, row), (ours, theirs) = outcome.measures.worst_pixel, outcome.measures.worst_values
        lines.append(f"worst pixel: column {column}, row {row}, {_rgba(ours)}, reference {_rgba(theirs)}")
    if outcome.three_way is not None:
        lines.append(outcome.three_way.words)
    lines += outcome.notes
    return [*lines, *([repeats] if repeats else [])]


def positions(candidate: Path | None, reference: str, page: Path | None) -> list[str]:
    """Lines with the paths of candidate, reference and page."""
    found = {"candidate": candidate, "reference": reference, "page": page}
    return [f"{what + ':':11}{position}" for what, position in found.items() if position]


def how_to_update(test: str) -> str:
    """Line with the command that makes the candidate the reference."""
    path, _, rest = test.partition("::")
    chosen = f"{path}::{rest}" if rest else path
    quoted = f"'{chosen}'" if any(each in chosen for each in " []()") else chosen
    return f"look at the candidate, and if it is right: pytest --texvol-update {quoted}"


def _some(lines: tuple[str, ...]) -> list[str]:
    more = len(lines) - _MOST_LINES
    return [*lines[:_MOST_LINES], *([f"and {more} more"] if more > 0 else [])]


def _rgba(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in values) + ")"
