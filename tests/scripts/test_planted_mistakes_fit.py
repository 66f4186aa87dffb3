"""The mistakes of scripts/planted_mistakes.py fit the source: a change of the source does not leave them behind."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


def check(tree: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "scripts/planted_mistakes.py", "--check"]
    return subprocess.run(command, cwd=tree, capture_output=True, text=True, timeout=120, check=False)


def test_every_package_and_shader_has_a_mistake_that_fits() -> None:
    done = check(REPOSITORY)
    assert done.returncode == 0, done.stderr
    count = re.search(r"(\d+) mistakes fit the source", done.stdout)
    assert count and int(count[1]) >= 60


def test_a_mistake_that_does_not_fit_is_an_error(tmp_path: Path) -> None:
    for name in ("texvol", "shaders", "scripts", "tests"):
        shutil.copytree(REPOSITORY / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "references"))
    assert check(tmp_path).returncode == 0
    module = tmp_path / "texvol/scene/optics.py"
    right = module.read_text("utf-8")
    for wrong, message in (
        (right.replace("def over", "def under"), "one function of that name must be in the package"),
        (right.replace("(1 - front[..., 3:])", "(1 - front[..., -1:])"), "and not once: (1 - front[..., 3:])"),
    ):
        module.write_text(wrong, "utf-8")
        done = check(tmp_path)
        assert done.returncode == 2 and message in done.stderr
    module.write_text(right, "utf-8")
    (tmp_path / "texvol/new").mkdir()
    (tmp_path / "texvol/new/__init__.py").write_text("")
    assert "a mistake must be planted in texvol/new" in check(tmp_path).stderr
