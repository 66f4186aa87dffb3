"""Workers of pytest-xdist share names, pictures that wait, and one report: two runs in projects with everything."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from support.picture_project import ALONE, Project, said, waves
from support.picture_suite import assert_report_is_whole, suite

WORKER = "open(__import__('os').environ['PYTEST_XDIST_WORKER'], 'w').close()"
ONE = f"\ndef test_one(check_picture):\n    {WORKER}\n    check_picture(waves({{shift}}), 'shared')\n"
TWO = ONE.replace("test_one", "test_two")
UNLIKE = """
@pytest.mark.parametrize("shift", [1.0, 2.0])
def test_unlike(check_picture, shift):
    open("unlike" + __import__("os").environ["PYTEST_XDIST_WORKER"], "w").close()
    check_picture(waves(shift), "unlike")
"""


class Run(NamedTuple):
    """A run of two workers: its project, what it printed, and the folder of its temporary files."""

    project: Project
    result: pytest.RunResult
    scratch: Path

    @property
    def text(self) -> str:
        return said(self.result)


def run_of_two(folder: Path, project: Project, *arguments: str) -> Run:
    scratch = folder / "scratch"
    scratch.mkdir()
    result = project.run_apart("-n", "2", "--texvol-report", "out/report", *arguments, TMPDIR=str(scratch))
    return Run(project, result, scratch)


@pytest.fixture(scope="module")
def checked(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run that checks a picture of every status, and a name that tests of two workers share: each has a file."""
    folder = tmp_path_factory.mktemp("checked")
    project = Project(folder / "project")
    suite(project)
    project.store(waves(), "shared")
    path = project.folder / "test_it.py"
    path.write_text(path.read_text() + ONE.format(shift=0))
    project.write(test_more=TWO.format(shift=0))
    project.limits("[far]\nrms = 1e-5\n[gone]\nrms = 1e-5\n")
    return run_of_two(folder, project, "--dist", "loadfile")


@pytest.fixture(scope="module")
def updated(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run that updates; pytest-xdist gives the first two tests to one worker, the next two to the other."""
    folder = tmp_path_factory.mktemp("updated")
    project = Project(folder / "project")
    for name in ("shared", "unlike"):
        project.store(waves(), name)
    other = "\ndef test_other(check_picture):\n    check_picture(waves(3.0), 'other')\n"
    project.write(test_it=ONE.format(shift=1) + UNLIKE + TWO.format(shift=2) + other)
    return run_of_two(folder, project, "--texvol-update")


def test_a_report_of_workers_has_all_pictures_worst_first_and_links(checked: Run) -> None:
    assert checked.result.ret == 1
    checked.result.assert_outcomes(passed=7, failed=6)
    assert_report_is_whole(checked.project, "out/report", others="1 refused, 7 same")


def test_tests_of_two_workers_that_share_a_name_are_an_error_that_names_both(checked: Run) -> None:
    assert {"gw0", "gw1"} <= set(os.listdir(checked.project.folder)), "they ran in one worker"
    assert "checked by two tests" in checked.text
    assert "test_it.py::test_one" in checked.text and "test_more.py::test_two" in checked.text


def test_tables_of_no_picture_are_named_where_workers_ran_all_tests(checked: Run) -> None:
    assert "[gone]: the picture no longer exists" in checked.text
    assert checked.text.count("no longer exists") == 1


def test_workers_leave_nothing_behind(checked: Run, updated: Run) -> None:
    for run in (checked, updated):
        assert not [name for name in os.listdir(run.scratch) if name.startswith("texvol")]


def test_nothing_is_written_for_tests_of_two_workers_that_share_a_name(updated: Run) -> None:
    assert {"gw0", "gw1"} <= set(os.listdir(updated.project.folder)), "they ran in one worker"
    assert updated.result.ret == 1
    updated.result.assert_outcomes(passed=3, failed=2)
    assert "not written: picture 'shared' is checked by two tests" in updated.text
    assert "wrote references/shared" not in updated.text
    np.testing.assert_array_equal(updated.project.stored("shared").pixels, waves())
    assert "wrote references/other.exr" in updated.text
    np.testing.assert_array_equal(updated.project.stored("other").pixels, waves(3.0))
    pictures = updated.project.report("out/report")["pictures"]
    assert [each["status"] for each in pictures if each["name"] == "shared"] == ["refused", "refused"]
    assert "was not written" in (updated.project.folder / "out/report/index.html").read_text("utf-8")


def test_a_reference_is_not_replaced_by_one_of_two_workers_unlike_pictures(updated: Run) -> None:
    assert {"unlikegw0", "unlikegw1"} <= set(os.listdir(updated.project.folder)), "they ran in one worker"
    np.testing.assert_array_equal(updated.project.stored("unlike").pixels, waves())
    assert "gives another picture of that name" in updated.text


# The controller has the report of the first test when it writes "started"; the second one sleeps after "sleeping".
CONFTEST = """
def pytest_runtest_logreport(report):
    if report.when == "teardown" and hasattr(report, "node"):
        open("started", "w").close()
"""
SLEEPER = "def test_two():\n    import time\n    open('sleeping', 'w').close()\n    time.sleep(60)\n"


def test_a_run_of_workers_that_ctrl_c_ends_reports_what_there_was(tmp_path: Path) -> None:
    project = Project(tmp_path)
    project.store(waves())
    one = "def test_one(check_picture):\n    check_picture(waves(), 'waves')\n"
    project.write(conftest=CONFTEST, test_it=f"{one}\n{SLEEPER}")
    line = [sys.executable, "-m", "pytest", "-n", "2", "--texvol-report", "report"]
    out = subprocess.DEVNULL
    with subprocess.Popen(line, cwd=tmp_path, env=ALONE, stdout=out, stderr=out, start_new_session=True) as run:
        deadline = time.monotonic() + 60
        while not {"started", "sleeping"} <= set(os.listdir(tmp_path)):
            assert time.monotonic() < deadline, "the tests of the project don't run"
            time.sleep(0.05)
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does: the workers get it as well
        assert run.wait(timeout=60) == pytest.ExitCode.INTERRUPTED
    assert [each["name"] for each in project.report()["pictures"]] == ["waves"]
    assert (tmp_path / "report/index.html").exists()
