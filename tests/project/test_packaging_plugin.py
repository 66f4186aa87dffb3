"""The plugin as somebody else gets it: from the installed wheel, in a project outside of this one."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from support.installed_wheel import installed, wheel  # noqa: F401 (fixtures)
from support.picture_project import UNUSED

TESTS = """
from dataclasses import replace

import numpy as np
import texvol
from texvol.scene import demo

def demo_scene():
    return replace(demo.demo_scene(), volume=demo.demo_volume(12))

def waves(shift=0.0):
    y, x = np.mgrid[:24, :32]
    return np.repeat(0.5 + 0.4 * np.sin((x - shift) / 4)[..., None], 3, axis=2).astype(np.float32)

def test_array(check_picture):
    check_picture(waves(), "waves")

def test_scene(check_picture):
    check_picture(demo_scene(), "demo", size=(24, 16))

def test_oracle(check_picture):
    check_picture(demo_scene(), "truth", size=(4, 3), oracle=True)

def test_it_is_the_wheel_s():
    assert "fresh environment" in texvol.__file__
"""


@pytest.fixture
def python(installed: Path) -> Path:  # noqa: F811
    """Python of a fresh environment with the wheel; libraries are borrowed from the one that runs the tests."""
    return installed / "bin" / "python"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/test_pictures.py").write_text(TESTS)
    return tmp_path


def run(python: Path, project: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    kept = ("CI", "GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY")
    environment = {name: text for name, text in os.environ.items() if not name.startswith("PYT") and name not in kept}
    # The oracle's kernels take 10 s to compile; without numba's compiler they are plain Python.
    return subprocess.run(
        [python, "-m", "pytest", *UNUSED.split(), *arguments],
        cwd=project,
        env=environment | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_a_fresh_project_goes_from_new_to_same_to_different(python: Path, project: Path) -> None:
    """In one process, which compiles the modules of the wheel, and in several."""
    update = run(python, project, "--texvol-update")
    assert update.returncode == 0, update.stdout
    assert {path.name for path in (project / "tests/references").iterdir()} == {"waves.exr", "demo.exr"}
    new = "\ndef test_new(check_picture):\n    check_picture(waves(), 'new')\n"
    tests = project / "tests/test_pictures.py"
    tests.write_text(TESTS.replace("waves()", "waves(0.5)") + new)
    changed = run(python, project, "--texvol-report", "report", "-n", "2")
    assert changed.returncode == 1 and "picture 'waves' is different" in changed.stdout
    assert "pytest --texvol-update tests/test_pictures.py::test_new" in changed.stdout
    report = json.loads((project / "report/report.json").read_text("utf-8"))
    statuses = {each["name"]: each["status"] for each in report["pictures"]}
    assert statuses == {"waves": "different", "demo": "same", "truth": "same", "new": "new"}
    assert (project / "report/pages/tests/waves.html").exists()
    page = (project / "report/index.html").read_text("utf-8")
    assert "http://" not in page.replace("http://www.w3.org", "") and "https://" not in page
