"""One report of several runs: a column for each, links that lead to pages, a comment, files of others left alone."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta

import pytest
from support.pages import Parsed
from support.picture_project import Project
from support.picture_suite import links, suite

from texvol.cli.command_line import main
from texvol.comparison.runs.comment import MARK

pytest_plugins = ("pytester", "support.picture_project")


@pytest.fixture
def runs(project: Project, monkeypatch: pytest.MonkeyPatch) -> Project:
    """Reports of two runs: one of all pictures, one of some."""
    monkeypatch.setenv("GITHUB_SHA", "0123456789abcdef")
    suite(project)
    project.run("--texvol-report", "linux")
    project.run("--texvol-report", "mac", "-k", "same or near")
    return project


def test_a_merged_report_has_all_runs_worst_first(runs: Project) -> None:
    assert main(["report", "merge", "linux", "macos=mac", "-o", "all", "--artifact", "shots=https://ci.example/1"]) == 0
    folder = runs.folder / "all"
    content = json.loads((folder / "report.json").read_text("utf-8"))
    assert [each["name"] for each in content["pictures"]][:5] == ["broken", "unreadable", "near", "far", "new"]
    by_name = {each["name"]: each["runs"] for each in content["pictures"]}
    assert set(by_name["near"]) == {"linux", "macos"} and set(by_name["far"]) == {"linux"}
    text = " ".join(Parsed((folder / "index.html").read_text("utf-8")).text.split())
    assert "5 of 11 failed in one run or more" in text
    assert "different in linux, macos" in text and "different in linux; not checked in macos" in text
    pages = links(folder / "index.html")
    assert len(pages) >= 10 and all(page.exists() for page in pages)
    comment = (folder / "comment.md").read_text("utf-8")
    assert comment.startswith(MARK) and "5 of 11 failed in 2 runs" in comment
    assert "[shots](https://ci.example/1)" in comment
    assert "| near | ❌ linux: different, ❌ macos: different |" in comment
    assert "- linux: `texvol accept DIR/runs/linux broken far near new`" in comment
    assert "- macos: `texvol accept DIR/runs/macos near`" in comment
    # A test may have ended before its picture.
    assert "Not checked in macos: " in comment and "4 not checked" in comment and "Not checked in linux" not in comment
    # When, and of which commit, is in a run's own report.
    run = json.loads((folder / "runs/linux/report.json").read_text("utf-8"))
    assert abs(datetime.now(UTC) - datetime.fromisoformat(run["time"])) < timedelta(hours=1)
    assert run["commit"] == "0123456789abcdef"
    # What is merged is accepted from as the report itself.
    assert main(["accept", "all/runs/linux", "far"]) == 0 and runs.run("-k", "far").ret == 0


def test_a_second_merge_replaces_the_first_and_nothing_else(runs: Project) -> None:
    assert main(["report", "merge", "linux", "mac", "-o", "all"]) == 0
    (runs.folder / "all/runs/linux/notes.txt").write_text("mine")
    assert main(["report", "merge", "mac", "-o", "all"]) == 0
    left = [path.name for path in (runs.folder / "all/runs/linux").rglob("*") if path.is_file()]
    assert left == ["notes.txt"] and (runs.folder / "all/runs/mac/index.html").exists()


def test_what_is_no_report_is_refused(runs: Project, capsys: pytest.CaptureFixture[str]) -> None:
    (runs.folder / "precious").mkdir()
    (runs.folder / "precious/thesis.txt").write_text("all of it")
    (runs.folder / "bad").mkdir()
    (runs.folder / "bad/report.json").write_text('{"program": "texvol pictures", "pictures": [{"name": 3}]}')
    for line, words in (
        (("nowhere", "-o", "all"), "got no folder"),
        (("references", "-o", "all"), "has no report.json"),
        (("bad", "-o", "all"), "must be a text, got 3"),
        (("linux", "linux", "-o", "all"), "'linux' twice"),
        (("a/b=linux", "-o", "all"), "letters, digits"),
        (("linux", "-o", "precious"), "must be empty or hold a merged report"),
        (("linux", "-o", "linux/all"), "outside of the reports"),
        (("linux", "-o", "all", "--artifact", "x=javascript:1"), "--artifact must be"),
    ):
        assert main(["report", "merge", *line]) == 2
        error = capsys.readouterr().err
        assert words in error and error.count("\n") == 1
        assert not (runs.folder / "all").exists()
    assert [path.name for path in (runs.folder / "precious").iterdir()] == ["thesis.txt"]
