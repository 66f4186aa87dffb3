"""The plugin for napari is a package of its own: its wheel, its manifest, and what it needs."""

from __future__ import annotations

import ast
import re
import shutil
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from support.installed_wheel import run

import texvol

REPOSITORY = Path(__file__).parents[2]
FOLDER = REPOSITORY / "plugins" / "texvol-napari"


def test_the_wheel_has_the_manifest_and_what_it_names(tmp_path: Path) -> None:
    pytest.importorskip("hatchling", reason="the wheel is built with hatchling: pip install '.[test]'")
    shutil.copytree(FOLDER, tmp_path / "source", ignore=shutil.ignore_patterns("__pycache__"))
    build = "import sys, hatchling.build as b; b.build_wheel(sys.argv[1])"
    run(sys.executable, "-c", build, tmp_path, cwd=tmp_path / "source")
    (built,) = tmp_path.glob("*.whl")
    assert built.name.startswith(f"texvol_napari-{texvol.__version__}-py3-none-any")  # released together
    with zipfile.ZipFile(built) as wheel:
        names = set(wheel.namelist())
        (entries,) = (wheel.read(name).decode() for name in names if name.endswith("entry_points.txt"))
        manifest = wheel.read("texvol_napari/napari.yaml").decode()
        (named,) = re.findall(r"python_name: (\S+):(\w+)", manifest)
        tree = ast.parse(wheel.read(f"{named[0].replace('.', '/')}.py"))
    assert "[napari.manifest]\ntexvol-napari = texvol_napari:napari.yaml" in entries
    assert named[1] in {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
    # The widget names a command of the manifest.
    assert set(re.findall(r"- command: (\S+)", manifest)) == set(re.findall(r"- id: (\S+)", manifest))


def test_the_extra_installs_what_the_plugin_needs() -> None:
    def requirements(file: Path) -> dict:
        return tomllib.loads(file.read_text("utf-8"))["project"]

    extra = requirements(REPOSITORY / "pyproject.toml")["optional-dependencies"]["napari"]
    own = requirements(FOLDER / "pyproject.toml")["dependencies"]
    assert {each.replace("[pyqt6]", "") for each in extra} == {each for each in own if not each.startswith("texvol")}
    major, minor, _ = texvol.__version__.split(".")
    assert f"texvol>={major}.{minor},<{major}.{int(minor) + 1}" in own
