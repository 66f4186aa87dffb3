"""What CI systems are told: workflow commands and Markdown that no picture's name can break, within GitHub's limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from texvol.comparison import ci
from texvol.comparison.ci import Result
from texvol.comparison.outcome import examine
from texvol.comparison.pictures import Picture

NASTY = "a|b`c\n::error::d%0A<b>e</b>,f:g*h"


def test_a_workflow_command_is_one_line_whatever_is_in_it() -> None:
    (line,) = ci.workflow_commands([Result(NASTY, "different", (NASTY, "second"), file="t,e:st.py", line=3)], {})
    assert "\n" not in line
    start, properties, message = line.split("::", 2)
    assert start == "" and properties.startswith("error file=t%2Ce%3Ast.py,line=3,title=")
    assert properties.count(",") == 2 and properties.count(":") == 0
    assert message == NASTY.replace("%", "%25").replace("\n", "%0A") + "%0Asecond"


def test_paths_are_those_of_the_repository(tmp_path: Path) -> None:
    result = Result("x", "new", ("words",), file=str(tmp_path / "tests/test_it.py"), line=1)
    (line,) = ci.workflow_commands([result], {"GITHUB_WORKSPACE": str(tmp_path)})
    assert line.startswith("::error file=tests/test_it.py,line=1,")
    (line,) = ci.workflow_commands([result], {"GITHUB_WORKSPACE": str(tmp_path / "elsewhere")})
    assert str(tmp_path / "tests/test_it.py") in line


def test_no_more_than_ten_annotations_and_none_for_what_passed() -> None:
    assert ci.workflow_commands([Result("x", "same"), Result("y", "updated")], {}) == []
    assert len(ci.workflow_commands([Result("x", "new")] * 10, {})) == 10
    lines = ci.workflow_commands([Result("x", "new")] * 14, {})
    assert len(lines) == 10 and "and 5 more" in lines[-1]


def test_a_table_has_a_row_for_each_picture_whatever_its_name() -> None:
    text = ci.job_summary(
        [Result(NASTY, "different", kinds=(NASTY,), max_error=0.25, rms_error=1e-3), Result("b", "same")]
    )
    rows = [line for line in text.splitlines() if line.startswith("|")][2:]
    assert len(rows) == 2 and all(row.count("|") == 6 for row in rows)
    assert not set("<>*`").intersection(rows[0]) and "| 0.25 | 0.001 |" in rows[0]
    assert "1 of 2 failed" in text


def test_a_summary_stays_within_what_github_takes(tmp_path: Path) -> None:
    path = tmp_path / "summary.md"
    environment = {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(path)}
    results = [Result(f"picture-{number}" * 9, "different", ("ü" * 400,)) for number in range(3000)]
    ci.tell(results, environment)
    first = path.stat().st_size
    assert 600_000 < first < 1 << 20 and " more" in path.read_text("utf-8")
    ci.tell(results, environment)
    assert path.stat().st_size == first  # the first is worth more than nothing
    ci.tell([Result("x", "same")], environment)
    assert path.stat().st_size > first


def test_outcomes_of_the_command_are_told_only_on_github(tmp_path: Path) -> None:
    reference = Picture.of_array(np.zeros((4, 4, 4), np.float32))
    outcome = examine(Picture.of_array(np.ones((4, 4, 4), np.float32)), reference, name="ones")
    path = tmp_path / "summary.md"
    assert ci.tell([Result.of(outcome)], {"GITHUB_STEP_SUMMARY": str(path)}) == [] and not path.exists()
    (line,) = ci.tell([Result.of(outcome)], {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(path)})
    assert line.startswith("::error title=picture ones is different::")
    assert "| ones |" in path.read_text("utf-8")
    assert ci.tell([Result.of(outcome)], {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": "/nowhere/at/all"}) == [line]


@pytest.mark.parametrize("status", ["same", "new", "broken"])
def test_properties_hold_what_is_known(status: str) -> None:
    assert dict(ci.properties(Result("x", status))) == {"texvol_picture": "x", "texvol_status": status}
    full = dict(ci.properties(Result("x", status, (), ("a", "b"), 0.5, 0.1, page="p.html")))
    assert full["texvol_max"] == "0.5" and full["texvol_kinds"] == "a; b" and full["texvol_page"] == "p.html"
