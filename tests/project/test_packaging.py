"""The wheel, installed: it has its shaders, and its command works from any folder."""

from __future__ import annotations

import zipfile
from pathlib import Path

from support.installed_wheel import installed, run, wheel  # noqa: F401 (two are fixtures)

import texvol

REPOSITORY = Path(__file__).parents[2]


def test_the_wheel_holds_every_module_and_shader(wheel: Path) -> None:  # noqa: F811
    names = set(zipfile.ZipFile(wheel).namelist())
    files = (path.relative_to(REPOSITORY) for path in (REPOSITORY / "texvol").rglob("*") if path.is_file())
    modules = {str(path) for path in files if "__pycache__" not in path.parts}
    shaders = {f"texvol/shaders/{path.name}" for path in (REPOSITORY / "shaders").iterdir()}
    assert {name for name in names if ".dist-info/" not in name} == modules | shaders
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert wheel.name.startswith(f"texvol-{texvol.__version__}-py3-none-any")


def test_the_installed_package_draws_the_demo_by_its_own_shaders_in_any_folder(installed: Path, tmp_path: Path) -> None:  # noqa: F811
    code = """
import texvol.opengl.shaders
from texvol.__main__ import main

assert main(["demo", "-o", "picture.png"]) == 0
print(texvol.__file__, texvol.opengl.shaders.FOLDER, sep="\\n")
"""
    package, shaders = run(installed / "bin" / "python", "-c", code, cwd=tmp_path).splitlines()[-2:]
    assert Path(package).is_relative_to(installed)
    assert Path(shaders) == Path(package).parent / "shaders"
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_the_installed_command_shows_the_pages_of_the_wheel(installed: Path, tmp_path: Path) -> None:  # noqa: F811
    assert run(installed / "bin" / "texvol", "help", "cookbook", cwd=tmp_path).startswith("Cookbook\n========\n")


def test_the_checkout_finds_the_shaders_beside_it() -> None:
    from texvol.opengl import shaders

    assert shaders.FOLDER == REPOSITORY / "shaders"
