"""The report's folder: what is in it, whose it is, and that runs of every kind write it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest
from support.picture_project import Project, said, waves

from texvol.formats.pictures import image

pytest_plugins = ("pytester", "support.picture_project")

SUITE = """
@pytest.mark.parametrize("number", range(6))
def test_same(check_picture, number):
    check_picture(waves(number), f"same/p{number}")

def test_far(check_picture):
    check_picture(waves(2.0), "far")

def test_near(check_picture):
    check_picture(waves(0.1), "near")

def test_new(check_picture):
    check_picture(waves(), "new")

def test_broken(check_picture):
    check_picture(waves(0, 12), "broken")

def test_unreadable(check_picture):
    check_picture("missing.exr", "unreadable")
"""


def suite(project: Project) -> None:
    for number in range(6):
        project.store(waves(number), f"same/p{number}")
    for name in ("far", "near", "broken", "unreadable"):
        project.store(waves(), name)
    project.write(test_it=SUITE)


def links(page: Path) -> list[Path]:
    """The files that a page links to."""
    found = re.findall(r'href="([^"#][^"]*)"', page.read_text("utf-8"))
    return [page.parent / unquote(each) for each in found if not each.startswith("data:")]


@pytest.mark.parametrize("processes", [(), ("-n", "2")])
def test_a_report_has_all_pictures_worst_first_and_links(project: Project, processes: tuple[str, ...]) -> None:
    suite(project)
    result = project.run("--texvol-report", "out/report", *processes, apart=bool(processes))
    assert result.ret == 1
    result.assert_outcomes(passed=6, failed=5)
    report = project.report("out/report")
    names = [each["name"] for each in report["pictures"]]
    assert names[:5] == ["broken", "unreadable", "far", "near", "new"] and len(names) == 11
    assert report["counts"] == "2 broken, 2 different, 1 new, 6 same" and report["exit_status"] == 1
    folder = project.folder / "out/report"
    text = (folder / "index.html").read_text("utf-8")
    positions = [text.index(f"test_it.py::test_{name}") for name in ("broken", "far", "near", "new", "same[0]")]
    assert positions == sorted(positions)
    pages = links(folder / "index.html")
    assert all(page.exists() for page in pages)
    assert {folder / each["page"] for each in report["pictures"] if each["page"]} <= set(pages)
    assert (folder / "index.html").resolve() in [page.resolve() for page in links(folder / "pages/far.html")]
    far = report["by_name"]["far"]
    assert (folder / far["candidate"]).exists() and far["kinds"] and far["max_error"] > 0.1
    assert "| far |" in (folder / "summary.md").read_text("utf-8")


def test_a_second_report_replaces_the_first(project: Project) -> None:
    suite(project)
    folder = project.folder / "report"
    project.run("--texvol-report", folder)
    (folder / "pages/notes.txt").write_text("mine")
    (folder / "pages/mine.html").write_text("mine")
    image.write(folder / "pages/mine.exr", waves())
    project.run("--texvol-report", folder, "-k", "same")
    left = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    own = {"pages/notes.txt", "pages/mine.html", "pages/mine.exr", "index.html", "report.json", "summary.md"}
    assert left == own | {f"pages/same/p{number}.html" for number in range(6)}


def test_a_folder_of_other_things_is_refused_and_stays(project: Project) -> None:
    project.check("waves()")
    folder = project.folder / "precious"
    folder.mkdir()
    for files in ({"thesis.txt": "all of it"}, {"report.json": "{}"}, {"report.json": "[", "index.html": "x"}):
        for name, text in files.items():
            (folder / name).write_text(text)
        result = project.run("--texvol-report", folder)
        assert result.ret == pytest.ExitCode.USAGE_ERROR and "holds no report of texvol" in said(result)
        assert {name: (folder / name).read_text() for name in files} == files
    file = project.folder / "file"
    file.write_text("x")
    assert "is a file" in said(project.run("--texvol-report", file))
    (project.folder / "report").mkdir()
    assert project.run("--texvol-report", "report").ret == 10  # empty
    (project.folder / "report/index.html").write_text("another's")
    assert "was not written by texvol" in said(project.run("--texvol-report", "report"))


def test_nothing_is_written_where_tests_are_only_collected(project: Project) -> None:
    project.check("waves()")
    assert project.run("--collect-only", "--texvol-report", "report").ret == 0
    assert not (project.folder / "report").exists()


def test_a_run_that_checks_no_picture_has_a_report_that_says_so(project: Project) -> None:
    project.write(test_it="def test_it(): pass\n")
    assert project.run("--texvol-report", "report").ret == 0
    assert project.report()["pictures"] == [] and (project.folder / "report/index.html").exists()


@pytest.mark.parametrize("processes", [[], ["-n", "2"]])
def test_an_interrupted_run_reports_what_there_was(project: Project, processes: list[str]) -> None:
    project.store(waves())
    project.write(
        test_it="""
def test_one(check_picture):
    check_picture(waves(), "waves")
    open("started", "w").close()

def test_two():
    import time
    time.sleep(60)
"""
    )
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--texvol-report", "report", *processes]
    with subprocess.Popen(command, cwd=project.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as run:
        deadline = time.monotonic() + 60
        while not (project.folder / "started").exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(2 if processes else 0.5)  # for the worker's report to arrive
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=60) == pytest.ExitCode.INTERRUPTED
    assert [each["name"] for each in project.report()["pictures"]] == ["waves"]
    assert (project.folder / "report/index.html").exists()


def test_stopping_at_the_first_failure_reports_what_there_was(project: Project) -> None:
    suite(project)
    result = project.run("-x", "--texvol-report", "report", "-k", "far or near")
    assert result.ret == 1 and [each["name"] for each in project.report()["pictures"]] == ["far"]


def test_a_picture_that_was_updated_is_no_failure_in_the_report(project: Project) -> None:
    suite(project)
    assert project.run("--texvol-report", "report", "--texvol-update", "-k", "far or new").ret == 0
    report = project.report()
    assert report["counts"] == "2 updated" and report["exit_status"] == 0
    text = (project.folder / "report/index.html").read_text("utf-8")
    assert "wrote references/far.exr" in text and "wrote references/new.exr" in text


def test_junit_has_numbers_and_attachments(project: Project) -> None:
    suite(project)
    project.run("--junitxml", "junit.xml", "--texvol-report", "report", "-o", "junit_logging=all")
    cases = {case.get("name"): case for case in ElementTree.parse(project.folder / "junit.xml").iter("testcase")}
    far = cases["test_far"]
    properties = {each.get("name"): each.get("value") for each in far.iter("property")}
    assert properties["texvol_status"] == "different" and properties["texvol_picture"] == "far"
    assert float(properties["texvol_max"] or "nan") == pytest.approx(np.abs(waves(2.0) - waves()).max(), rel=1e-5)
    assert float(properties["texvol_rms"] or "nan") > 0 and properties["texvol_kinds"]
    assert "texvol_attachment" not in properties
    attached = re.findall(r"^\[\[ATTACHMENT\|(.*)\]\]$", far.findtext("system-out") or "", re.MULTILINE)
    assert [Path(each).name for each in attached] == ["far.exr", "far.html"]
    assert all(Path(each).is_absolute() and Path(each).exists() for each in attached)
    assert "ATTACHMENT" not in (cases["test_same[0]"].findtext("system-out") or "")
    assert far.find("failure") is not None and len(cases) == 11


def test_on_github_there_are_annotations_and_a_summary(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    suite(project)
    summary = project.folder / "summary.md"
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    monkeypatch.setenv("GITHUB_WORKSPACE", str(project.folder.parent))
    result = project.run()
    line = (
        project.folder.joinpath("test_it.py").read_text().split("\n").index('    check_picture(waves(2.0), "far")') + 1
    )
    start = f"::error file={project.folder.name}/test_it.py,line={line},title=picture far is different::"
    assert any(each.startswith(start) for each in result.outlines)
    assert sum(each.startswith("::error ") for each in result.outlines) == 5
    assert "5 of 11 failed" in summary.read_text("utf-8")
    monkeypatch.delenv("GITHUB_ACTIONS")
    assert "::error" not in said(project.run()) and summary.read_text("utf-8").count("5 of 11") == 1


def test_noise_is_told_from_a_systematic_difference(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
random = np.random.default_rng(0)

def noisy(shift):
    return lambda: waves() + np.float32(shift) + random.normal(0, 0.02, (24, 32, 4)).astype(np.float32)

def test_noise(check_picture):
    check_picture(noisy(0), "waves", repeat=4)

def test_both(check_picture):
    check_picture(noisy(0.05), "other", repeat=4)

def test_systematic(check_picture):
    check_picture(lambda: waves() + np.float32(0.05), "third", repeat=3)

def test_array(check_picture):
    check_picture(waves(), "fourth", repeat=2)
"""
    )
    for name in ("other", "third", "fourth"):
        project.store(waves(), name)
    result = project.run("--texvol-report", "report")
    text = said(result)
    assert "hand over a scene, or a function without arguments" in text
    by_name = project.report()["by_name"]
    # Of 24 · 32 · 4 numbers rms is known to 1 / sqrt(2 · 3072), 1.3%: 5% is four standard deviations.
    noise = by_name["waves"]["repeats"]
    assert noise["noise_rms"] == pytest.approx(0.02, rel=0.05) and "which the noise explains" in noise["words"]
    assert noise["difference_rms"] == pytest.approx(0.01, rel=0.05)
    both = by_name["other"]["repeats"]
    assert both["noise_rms"] == pytest.approx(0.02, rel=0.05)
    assert both["systematic_rms"] == pytest.approx(0.05, rel=0.05) and "systematic" in both["words"]
    assert by_name["third"]["repeats"]["noise_max"] == 0 and "all 3 repeats are the same" in text
    assert both["words"] in text and both["words"] in (project.folder / "report/pages/other.html").read_text("utf-8")


def test_noise_that_only_the_mean_hides_fails(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
signs = iter([1, -1])

def test_it(check_picture):
    check_picture(lambda: waves() + np.float32(0.1 * next(signs)), "waves", repeat=2)
"""
    )
    result = project.run()
    assert result.ret == 1 and "repeat 1 of 2, but not the mean of all" in said(result)


def test_workers_leave_nothing_behind(project: Project, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project.store(waves())
    project.check("waves()")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    assert project.run("-n", "2", apart=True).ret == 0
    assert not [name for name in os.listdir(tmp_path) if name.startswith("texvol")]
