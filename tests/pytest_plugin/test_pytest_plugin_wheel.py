"""The plugin as somebody else gets it: from the installed wheel, in a project outside of this one."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

import pytest
from support.installed_wheel import installed, wheel  # noqa: F401 (fixtures)

TESTS = """
import numpy as np
import texvol
from texvol.scene.demo import demo_scene

def waves(shift=0.0):
    y, x = np.mgrid[:24, :32]
    return np.repeat(0.5 + 0.4 * np.sin((x - shift) / 4)[..., None], 3, axis=2).astype(np.float32)

def test_array(check_picture):
    check_picture(waves(), "waves")

def test_scene(check_picture):
    check_picture(demo_scene(), "demo", size=(48, 32))

def test_oracle(check_picture):
    check_picture(demo_scene(), "truth", size=(24, 16), oracle=True)

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
    return subprocess.run(
        [python, "-m", "pytest", "-p", "no:hypothesispytest", *arguments],
        cwd=project,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_a_fresh_project_goes_from_new_to_same_to_different(python: Path, project: Path) -> None:
    """In one process, and in several."""
    processes = ("-n", "2")
    first = run(python, project)
    assert first.returncode == 10 and "pytest --texvol-update" in first.stdout
    update = run(python, project, "--texvol-update", *processes)
    assert update.returncode == 0, update.stdout
    assert {path.name for path in (project / "tests/references").iterdir()} == {"waves.exr", "demo.exr"}
    again = run(python, project, "--texvol-report", "report")
    assert again.returncode == 0, again.stdout
    page = (project / "report/index.html").read_text("utf-8")
    assert "http://" not in page.replace("http://www.w3.org", "") and "https://" not in page
    tests = project / "tests/test_pictures.py"
    tests.write_text(TESTS.replace("waves()", "waves(0.5)"))
    changed = run(python, project, "--texvol-report", "report", *processes)
    assert changed.returncode == 1 and "picture 'waves' is different" in changed.stdout
    assert (project / "report/pages/tests/waves.html").exists()


def test_runs_without_pictures_pay_next_to_nothing(python: Path, project: Path) -> None:
    """Nothing heavy is loaded; what is, is in a hundredth of what a run of pytest takes."""
    (project / "tests/test_pictures.py").write_text("def test_nothing(): pass\n")
    code = (
        "import pytest, sys, time\n"
        "from importlib import import_module\n"
        "start = time.perf_counter()\n"
        "import_module('texvol.pytest_plugin')\n"
        "print(time.perf_counter() - start)\n"
        "print(*{'numpy', 'OpenImageIO', 'moderngl', 'numba'} & set(sys.modules))\n"
    )
    took = []
    for _ in range(3):
        done = subprocess.run([python, "-c", code], cwd=project, capture_output=True, text=True, check=True, timeout=60)
        seconds, loaded = done.stdout.split("\n")[:2]
        assert not loaded
        took.append(float(seconds))
        time.sleep(0)
    assert run(python, project).returncode == 0
    # 5 ms where measured; several times that where the machine is busy.
    assert min(took) < 0.1
