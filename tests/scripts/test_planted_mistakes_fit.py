"""The mistakes of scripts/planted_mistakes.py fit the source: a change of the source does not leave them behind."""

from __future__ import annotations

import re
import runpy
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
Check = Callable[[Path], tuple[int, str]]


@pytest.fixture
def check(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Check:
    """The check of a source tree by its own script; exit status, and what it prints."""
    monkeypatch.syspath_prepend(str(REPOSITORY / "scripts"))  # the script imports its neighbours
    monkeypatch.setattr("sys.argv", ["planted_mistakes.py", "--check"])

    def checked(tree: Path) -> tuple[int, str]:
        script = runpy.run_path(str(tree / "scripts/planted_mistakes.py"), run_name="planted_mistakes")
        status = script["main"]()
        said = capsys.readouterr()
        return status, said.out + said.err

    return checked


def test_every_package_and_shader_has_a_mistake_that_fits(check: Check) -> None:
    status, said = check(REPOSITORY)
    assert status == 0, said
    count = re.search(r"(\d+) mistakes fit the source", said)
    assert count and int(count[1]) >= 60


def test_a_mistake_that_does_not_fit_is_an_error(check: Check, tmp_path: Path) -> None:
    for name in ("texvol", "shaders", "scripts", "tests"):
        shutil.copytree(REPOSITORY / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__", "references"))
    assert check(tmp_path)[0] == 0
    module = tmp_path / "texvol/scene/optics.py"
    right = module.read_text("utf-8")
    for wrong, message in (
        (right.replace("def over", "def under"), "one function of that name must be in the package"),
        (right.replace("(1 - front[..., 3:])", "(1 - front[..., -1:])"), "and not once: (1 - front[..., 3:])"),
    ):
        module.write_text(wrong, "utf-8")
        status, said = check(tmp_path)
        assert status == 2 and message in said
    module.write_text(right, "utf-8")
    (tmp_path / "texvol/new").mkdir()
    (tmp_path / "texvol/new/__init__.py").write_text("")
    status, said = check(tmp_path)
    assert status == 2 and "a mistake must be planted in texvol/new" in said
