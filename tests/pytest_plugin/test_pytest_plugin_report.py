"""The report's folder: what is in it, whose it is, and that runs of every kind write it."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from support.picture_project import Project, said, waves
from support.picture_suite import assert_report_is_whole, suite

from texvol.formats.pictures import image

pytest_plugins = ("pytester", "support.picture_project")


def test_a_report_has_all_pictures_worst_first_and_links(project: Project) -> None:
    suite(project)
    result = project.run("--texvol-report", "out/report")
    assert result.ret == 1
    result.assert_outcomes(passed=6, failed=5)
    assert_report_is_whole(project, "out/report", others="6 same")


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
        assert result.ret == pytest.ExitCode.USAGE_ERROR and "hold a report of texvol" in said(result)
        assert {name: (folder / name).read_text() for name in files} == files
    file = project.folder / "file"
    file.write_text("x")
    assert "got a file" in said(project.run("--texvol-report", file))
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


def test_an_interrupted_run_reports_what_there_was(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
def test_one(check_picture):
    check_picture(waves(), "waves")

def test_two():
    raise KeyboardInterrupt
"""
    )
    with pytest.raises(KeyboardInterrupt):
        project.run("--texvol-report", "report")
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
    assert "must be a scene or a function" in text
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
