"""Reports for CI systems: annotations and a job summary for GitHub, properties and attachments for JUnit.

GitHub    `::error file=…,line=…,title=…::…` on standard output, and Markdown at the end of $GITHUB_STEP_SUMMARY
JUnit     properties of a test case, and lines [[ATTACHMENT|path]] in its output, as Jenkins and GitLab read them
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from texvol.util.shown_text import markdown, one_line, shown, shown_line

if TYPE_CHECKING:
    from texvol.comparison.outcome import Outcome

FAILING = ("broken", "different", "new", "refused")
SIGNS = {"broken": "❌", "different": "❌", "new": "🆕", "refused": "❌", "updated": "✏️", "same": "✅"}
# GitHub drops the summary of a step that exceeds 1 MiB; the step may have written to it already.
_MOST_BYTES = 1 << 20
_MOST_OF_SUMMARY = _MOST_BYTES * 3 // 4
_MOST_ANNOTATIONS = 10  # that GitHub shows for a step
_MOST_WORDS = 300  # of a cell


@dataclass(frozen=True)
class Result:
    """Result of one picture's comparison, for a CI system.

    Attributes
    ----------
    status : str
        "same", "different", "broken", "new", "updated" or "refused".
    words : tuple of str
        Reasons of the failure.
    kinds : tuple of str
        Kinds of difference.
    file, line : str, int
        Position of the test that checks the picture.
    page : str
        Path of the picture's page.
    attachments : tuple of str
        Files for JUnit.
    """

    name: str
    status: str
    words: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    max_error: float | None = None
    rms_error: float | None = None
    file: str | None = None
    line: int | None = None
    page: str | None = None
    attachments: tuple[str, ...] = ()

    @classmethod
    def of(cls, outcome: Outcome, page: str | None = None) -> Result:
        """Return the result of an outcome that belongs to no test."""
        measures = outcome.measures
        return cls(
            outcome.name,
            outcome.status,
            outcome.violations,
            (*outcome.scene_words, *(kind.words for kind in outcome.kinds)),
            measures.max_error if measures else None,
            measures.rms_error if measures else None,
            page=page,
        )


def on_github(environment: Mapping[str, str] = os.environ) -> bool:
    """True in a workflow of GitHub Actions."""
    return environment.get("GITHUB_ACTIONS") == "true"


def tell(results: Sequence[Result], environment: Mapping[str, str] = os.environ) -> list[str]:
    """Return annotations of results to print, and write their table to the job summary; empty outside of GitHub."""
    if not on_github(environment) or not results:
        return []
    add_to_summary(job_summary(results), environment)
    return workflow_commands(results, environment)


def workflow_commands(results: Iterable[Result], environment: Mapping[str, str] = os.environ) -> list[str]:
    """Return a workflow command for each failed picture, as many as GitHub shows; the last one counts the rest."""
    failed = [result for result in results if result.status in FAILING]
    shown = failed if len(failed) <= _MOST_ANNOTATIONS else failed[: _MOST_ANNOTATIONS - 1]
    lines = [_annotation(result, environment) for result in shown]
    if len(failed) > len(shown):
        lines.append(f"::error title=Pictures::and {len(failed) - len(shown)} more, see the job summary")
    return lines


def add_to_summary(markdown: str, environment: Mapping[str, str] = os.environ) -> None:
    """Append to the job summary, if there is one and it has room.

    Errors of writing are ignored: a missing summary is no reason to fail.
    """
    path = environment.get("GITHUB_STEP_SUMMARY")
    if not path:
        return
    with suppress(OSError):
        there = Path(path).stat().st_size if Path(path).exists() else 0
        content = markdown.encode()
        if there + len(content) < _MOST_BYTES:
            with open(path, "ab") as file:
                file.write(content)


def job_summary(results: Sequence[Result]) -> str:
    """Return a Markdown table in the order of the results; rows beyond GitHub's limit are counted."""
    failed = sum(result.status in FAILING for result in results)
    lines = [
        "### Pictures: " + (f"{failed} of {len(results)} failed" if failed else f"all {len(results)} fine"),
        "",
        "| picture | status | what | max | rms |",
        "|---|---|---|---:|---:|",
    ]
    size = sum(len(line.encode()) + 1 for line in lines)
    for number, result in enumerate(results):
        row = _row(result)
        size += len(row.encode()) + 1
        if size > _MOST_OF_SUMMARY:
            lines += ["", f"and {len(results) - number} more"]
            break
        lines.append(row)
    return "\n".join(lines) + "\n\n"


def properties(result: Result) -> list[tuple[str, str]]:
    """Properties of a JUnit test case."""
    found = {
        "texvol_picture": result.name,
        "texvol_status": result.status,
        "texvol_max": None if result.max_error is None else f"{result.max_error:.6g}",
        "texvol_rms": None if result.rms_error is None else f"{result.rms_error:.6g}",
        "texvol_kinds": "; ".join(result.kinds) or None,
        "texvol_page": result.page,
    }
    return [(name, text) for name, text in found.items() if text is not None]


def attachment(path: str) -> str:
    """Line of a test case's output that Jenkins and GitLab read as an attachment."""
    return f"[[ATTACHMENT|{shown_line(path)}]]"


def _annotation(result: Result, environment: Mapping[str, str]) -> str:
    position = {"file": _in_workspace(result.file, environment), "line": result.line if result.file else None}
    position["title"] = f"picture {result.name} is {result.status}"
    told = ",".join(f"{key}={_escaped(str(value), of_property=True)}" for key, value in position.items() if value)
    return f"::error {told}::{_escaped(chr(10).join(dict.fromkeys((*result.words, *result.kinds))) or result.status)}"


def _in_workspace(file: str | None, environment: Mapping[str, str]) -> str | None:
    """Return the file's path from the root of the repository, as GitHub expects it."""
    root = environment.get("GITHUB_WORKSPACE")
    if file is None or not root:
        return file
    path, root = os.path.realpath(file), os.path.realpath(root)
    return os.path.relpath(path, root) if path.startswith(root + os.sep) else file


def _escaped(text: str, *, of_property: bool = False) -> str:
    """Escape text of a workflow command: in percent, control characters, and in a property the separators."""
    special = "%\r\n:," if of_property else "%\r\n"
    return "".join(f"%{ord(each):02X}" if each in special else each for each in shown(text))


def _row(result: Result) -> str:
    # A picture that did not fail has no reasons.
    what = "; ".join(result.kinds or result.words[1:] or result.words) if result.status in FAILING else ""
    if result.status == "updated":
        what = "; ".join(result.words)
    numbers = ["" if each is None else f"{each:.3g}" for each in (result.max_error, result.rms_error)]
    status = f"{SIGNS.get(result.status, '')} {cell(result.status)}"
    return f"| {' | '.join((cell(result.name), status, cell(what), *numbers))} |"


def cell(text: str) -> str:
    """Return text as one line of Markdown without markup or HTML."""
    line = one_line(text)
    return markdown(line if len(line) <= _MOST_WORDS else line[: _MOST_WORDS - 1] + "…")
