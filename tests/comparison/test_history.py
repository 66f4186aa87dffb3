"""History of pictures: what changed from run to run, and when; runs are added, and other files are left alone."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from support.pages import Parsed

from texvol.cli.command_line import main
from texvol.comparison.runs import history
from texvol.comparison.runs.changes import Story, stories
from texvol.comparison.runs.commits import commit_of

THUMBNAIL = "data:image/png;base64,iVBORw0KGgo="


def picture(name: str, error: float | None = 0.0, status: str = "same", **more: Any) -> dict[str, Any]:
    record = {"name": name, "test": f"test_it.py::test_{name}", "reference": "", "status": status}
    return record | {"max_error": error, "rms_error": error} | more


def report(folder: Path, day: int, *pictures: dict[str, Any], **more: Any) -> str:
    """Write the report of a run on a day of January; return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    time, commit = f"2026-01-{day:02}T12:00:00+00:00", f"{day:02}" * 20
    head = {"program": "texvol pictures", "finished": True, "time": time, "commit": commit}
    (folder / "report.json").write_text(json.dumps(head | {"pictures": pictures} | more))
    return str(folder)


def told(folder: Path, series: str = "run") -> dict[str, Story]:
    runs = [each for each in history.read(folder) if each.series == series]
    return {each.name: each for each in stories(runs)}


def states(story: Story) -> list[tuple[str, float | None, str, int]]:
    """Verdict, error, day and number of runs of each change, the oldest first."""
    return [
        (each.found["status"], each.found["max_error"], each.run.time[8:10], each.runs)
        if each.found
        else ("", None, each.run.time[8:10], each.runs)
        for each in story.changes[::-1]
    ]


def add(place: Path, day: int, *pictures: dict[str, Any], **more: Any) -> None:
    folder = report(place / "run", day, *pictures, **more)  # each run overwrites the report of the last one
    assert main(["report", "history", folder, "-o", str(place / "history")]) == 0


def test_changes_have_their_day_and_what_stays_has_none(tmp_path: Path) -> None:
    different = {"status": "different", "thumbnail": THUMBNAIL}
    add(tmp_path, 1, picture("ball", 0.001), picture("still"))
    add(tmp_path, 2, picture("ball", 0.001005), picture("still"))  # by half a per cent, as of another summation
    add(tmp_path, 3, picture("ball", 0.2, **different), picture("still"))
    add(tmp_path, 4, picture("ball", 0.1, **different), picture("still"))
    found = told(tmp_path / "history")
    assert states(found["ball"]) == [("same", 0.001, "01", 2), ("different", 0.2, "03", 1), ("different", 0.1, "04", 1)]
    assert states(found["still"]) == [("same", 0.0, "01", 4)] and not found["still"].note
    assert list(found) == ["ball", "still"]  # what fails comes first
    text = (tmp_path / "history/index.html").read_text("utf-8")
    page = " ".join(Parsed(text).text.split())
    changes = page.split("Changes of ball", 1)[1].split("that do not fail", 1)[0]
    assert "2026-01-03 12:00 UTC 0303030303" in changes and "2026-01-02" not in changes
    assert text.count(f'src="{THUMBNAIL}"') == 2 and text.count("<circle") == 8


def test_runs_that_are_added_again_are_replaced_and_old_ones_go(tmp_path: Path) -> None:
    for day in (3, 1, 2, 2):
        add(tmp_path, day, picture("ball", day / 10))
    assert [each["max_error"] for each in told(tmp_path / "history")["ball"].points] == [0.1, 0.2, 0.3]
    folder = report(tmp_path / "run", 4, picture("ball"))
    line = ["report", "history", folder, f"mac={folder}", "-o", str(tmp_path / "history"), "--keep", "2"]
    assert main(line) == 0
    assert [(each.series, each.time[8:10]) for each in history.read(tmp_path / "history")] == [
        *(("mac", "04"), ("run", "03"), ("run", "04"))
    ]


def test_of_checks_of_one_picture_in_one_test_the_worst_counts(tmp_path: Path) -> None:
    for day, statuses in ((1, ("same", "different")), (2, ("different", "same"))):
        add(tmp_path, day, *(picture("ball", 0.1, status) for status in statuses))
    assert states(told(tmp_path / "history")["ball"]) == [("different", 0.1, "01", 2)]


def test_missing_and_renamed_pictures(tmp_path: Path) -> None:
    old, renamed = picture("old", 0.1), picture("renamed", 0.1) | {"test": "test_it.py::test_old"}
    stays = picture("stays")
    add(tmp_path, 1, old, stays, picture("gone"))
    add(tmp_path, 2, stays, finished=False)  # stopped before the others
    add(tmp_path, 3, old, stays, picture("gone"))
    add(tmp_path, 4, renamed, stays)
    add(tmp_path, 5, renamed, stays, picture("late"), picture("gone"))
    add(tmp_path, 6, renamed, stays, picture("late"))
    found = told(tmp_path / "history")
    assert states(found["old"]) == [("same", 0.1, "01", 3), ("", None, "04", 3)]
    assert found["old"].note == "last checked 2026-01-03, then probably 'renamed'"
    assert found["renamed"].note == "probably 'old' until then"
    assert [each[0] for each in states(found["gone"])] == ["same", "", "same", ""]
    assert found["late"].note == "first checked 2026-01-05" and not found["stays"].note


def test_what_is_no_report_leaves_the_history_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    add(tmp_path, 1, picture("ball"))
    place = tmp_path / "history"
    before = (place / "history.json").read_bytes()
    good = report(tmp_path / "good", 2, picture("ball"))
    cases = {
        "got no folder": str(tmp_path / "nowhere"),
        "status must be one of": report(tmp_path / "a", 2, picture("ball", status="fine")),
        "time must be one such as": report(tmp_path / "b", 2, time="yesterday"),
        "commit must be": report(tmp_path / "c", 2, commit="<script>"),
    }
    (tmp_path / "cut").mkdir()
    (tmp_path / "cut/report.json").write_text('{"program": "texvol pict')
    cases["report.json"] = str(tmp_path / "cut")
    capsys.readouterr()
    for words, folder in cases.items():
        assert main(["report", "history", good, folder, "-o", str(place)]) == 2
        error = capsys.readouterr().err
        assert words in error and error.count("\n") == 1
        assert (place / "history.json").read_bytes() == before
    for words, content in (
        ("must be a history of texvol", "[]"),
        ("history.json", before.decode()[:99]),
        ("max_error of a picture must be a number", before.decode().replace('"max_error":0.0', '"max_error":"0"')),
        ("a run must be an object", before.decode().replace('"series"', '"serial"')),
    ):
        (place / "history.json").write_text(content)
        assert main(["report", "history", good, "-o", str(place)]) == 2
        error = capsys.readouterr().err
        assert words in error and error.count("\n") == 1, error
        assert (place / "history.json").read_text() == content
    for line, words in (
        ([good, "-o", good], "empty or hold history.json"),
        ([good, "-o", "h", "--keep", "0"], "--keep"),
    ):
        assert main(["report", "history", *line]) == 2 and words in capsys.readouterr().err


def test_texts_of_reports_are_no_markup(tmp_path: Path) -> None:
    evil = picture("<b>ball</b>", 0.1, "different", thumbnail='x" onerror="alert(1)')
    add(tmp_path, 1, evil)
    add(tmp_path, 2, evil)
    text = (tmp_path / "history/index.html").read_text("utf-8")
    assert "<b>ball" not in text and "onerror" not in text and "<img" not in text


def test_old_reports_have_the_time_of_their_file(tmp_path: Path) -> None:
    folder = report(tmp_path / "run", 1, picture("ball"))
    file = Path(folder) / "report.json"
    content = json.loads(file.read_text())
    del content["time"], content["commit"]
    file.write_text(json.dumps(content))
    os.utime(file, (86400 * 366, 86400 * 366))
    assert main(["report", "history", folder, "-o", str(tmp_path / "history")]) == 0
    (run,) = history.read(tmp_path / "history")
    assert (run.time, run.commit) == ("1971-01-02T00:00:00+00:00", "")


def test_the_commit_is_the_ci_system_s_or_git_s(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GIT_CEILING_DIRECTORIES", str(tmp_path.parent))
    assert commit_of({"GITHUB_SHA": "0123456789ABCDEF"}) == "0123456789abcdef"
    assert commit_of({"GITHUB_SHA": "main; rm"}) == ""  # and no repository is here
    who = ("-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "commit.gpgsign=false")
    subprocess.run(["git", "init", "-q"], check=True)
    assert commit_of({}) == ""  # of no commit yet
    subprocess.run(["git", *who, "commit", "-q", "--allow-empty", "-m", "first"], check=True)
    head = subprocess.run(["git", "log", "-1", "--format=%H"], check=True, capture_output=True, text=True).stdout
    assert commit_of({}) == head.strip()
    monkeypatch.setenv("PATH", "")
    assert commit_of({}) == ""
