"""The wheel, installed: it has its shaders, and its command works from any folder."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

import texvol

REPOSITORY = Path(__file__).parents[2]

pytest.importorskip("hatchling", reason="the wheel is built with hatchling: pip install 'texvol[test]'")


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command that knows nothing of the checkout; return what it prints."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the source distribution's files as pip would, without the network."""
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    source.mkdir()
    for name in ("texvol", "shaders"):
        shutil.copytree(REPOSITORY / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for path in REPOSITORY.iterdir():
        if path.is_file() and not path.name.startswith("."):
            shutil.copy(path, source)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    run(*pip, "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, source, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the wheel; it borrows the libraries, not texvol, from the one that runs the tests."""
    folder = tmp_path_factory.mktemp("fresh environment")  # a path with a space
    run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder)
    python = folder / "bin" / "python"
    packages = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder).strip())
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python)
    run(*pip, "install", "--quiet", "--no-deps", "--no-index", wheel, cwd=folder)
    # Behind its own packages in the search path; a .pth file in there, which would lead to the checkout, is not read.
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder


def test_the_wheel_holds_every_module_and_shader(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    files = (path.relative_to(REPOSITORY) for path in (REPOSITORY / "texvol").rglob("*") if path.is_file())
    modules = {str(path) for path in files if "__pycache__" not in path.parts}
    shaders = {f"texvol/shaders/{path.name}" for path in (REPOSITORY / "shaders").iterdir()}
    assert {name for name in names if ".dist-info/" not in name} == modules | shaders
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert wheel.name.startswith(f"texvol-{texvol.__version__}-py3-none-any")


def test_the_installed_package_and_its_shaders_come_from_the_wheel(environment: Path, tmp_path: Path) -> None:
    code = "import texvol, texvol.opengl.shaders; print(texvol.__file__); print(texvol.opengl.shaders.FOLDER)"
    package, shaders = run(environment / "bin" / "python", "-c", code, cwd=tmp_path).splitlines()
    assert Path(package).is_relative_to(environment)
    assert Path(shaders) == Path(package).parent / "shaders"


def test_the_installed_command_draws_the_demo_from_any_folder(environment: Path, tmp_path: Path) -> None:
    run(environment / "bin" / "texvol", "demo", "-o", "picture.png", cwd=tmp_path)
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"]


def test_the_installed_command_shows_pages(environment: Path, tmp_path: Path) -> None:
    assert run(environment / "bin" / "texvol", "help", "cookbook", cwd=tmp_path).startswith("Cookbook\n========\n")


def test_the_checkout_finds_the_shaders_beside_it() -> None:
    from texvol.opengl import shaders

    assert shaders.FOLDER == REPOSITORY / "shaders"
