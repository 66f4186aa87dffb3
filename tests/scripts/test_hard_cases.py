"""Every hard case is within its bound, and the bounds bite."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import pytest
from support.hard_cases import table
from support.hard_cases.cases import HardCase, hard_cases
from support.hard_cases.table import COLUMNS, as_csv, as_html, as_markdown, run, worst_first

from texvol.rendering.renderer import Renderer

CASES = hard_cases()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_hard_case_is_within_its_bound(case: HardCase, renderer: Renderer) -> None:
    outcome = run(case, renderer, times=1)
    assert outcome.max_error <= outcome.bound, case.why
    # Another driver rounds otherwise: the bound has to be tight where the software driver measures it.
    assert "llvmpipe" not in renderer.renderer_name or not outcome.loose, "a loose bound says nothing, or says why"


@pytest.mark.parametrize("case", CASES[::4], ids=lambda case: case.name)
def test_polygons_are_within_it_as_well(case: HardCase, renderer: Renderer) -> None:
    outcome = run(case, renderer, times=1, slicing="polygons")
    assert outcome.max_error <= outcome.bound, case.why


def test_cases_that_a_slicing_does_not_draw_are_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    post = next(case for case in CASES if case.scene.classification == "post")
    slab = next(case for case in CASES if case.scene.classification == "slab" and case.scene.mode == "composite")
    monkeypatch.setattr(table, "hard_cases", lambda: [post, replace(slab, bound=lambda _: 9.0)])
    monkeypatch.setattr("sys.argv", ["hard_cases.py", "--slicing", "wilson", "-o", str(tmp_path)])
    assert table.main() == 0
    said = capsys.readouterr()
    assert "does not draw classification post" in said.err and slab.name in said.out and post.name not in said.out


def test_every_case_has_a_name_of_its_own_and_a_derivation() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
    assert all(case.why for case in CASES)


def test_an_error_over_its_bound_is_the_first_row_of_each_table(renderer: Renderer) -> None:
    sound = [run(case, renderer, times=1) for case in CASES[:3]]
    outcomes = worst_first([*sound, replace(sound[0], max_error=2 * sound[0].bound)])
    assert [outcome.verdict for outcome in outcomes] == ["over", *["within"] * 3]
    rows = list(csv.reader(io.StringIO(as_csv(outcomes))))
    assert tuple(rows[0]) == COLUMNS and rows[1][6] == "over" and len(rows) == 5
    assert as_markdown(outcomes).splitlines()[2].count("| over |") == 1
    page = as_html(outcomes, "a <driver>")
    assert "4 pictures" in page and "1 over" in page and "a &lt;driver&gt;" in page
    assert "http" not in page and page.index('class="over"') < page.index('class="within"')


def test_an_error_that_is_not_a_number_is_over(renderer: Renderer) -> None:
    outcome = run(CASES[0], renderer, times=1)
    assert replace(outcome, max_error=float("nan")).over and replace(outcome, max_error=float("inf")).over


@pytest.mark.parametrize("bound, status", [(1.0, 0), (-1.0, 1)])
def test_the_script_writes_both_tables_and_ends_with_1_if_a_case_is_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], bound: float, status: int
) -> None:
    monkeypatch.setattr(table, "hard_cases", lambda: [replace(CASES[0], bound=lambda _: bound)])
    monkeypatch.setattr("sys.argv", ["hard_cases.py", "-o", str(tmp_path / "new")])
    assert table.main() == status
    assert {path.name for path in (tmp_path / "new").iterdir()} == {"hard_cases.csv", "hard_cases.html"}
    assert CASES[0].name in capsys.readouterr().out
