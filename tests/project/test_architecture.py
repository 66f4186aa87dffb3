"""What keeps the source readable and a picture quick to start."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from support.processes import imported_by

REPOSITORY = Path(__file__).parents[2]
PACKAGE = REPOSITORY / "texvol"
SOURCES = sorted(PACKAGE.rglob("*.py"))
OPENGL_MODULES = {"contexts", "shaders", "compositor", "texture_store", "empty_space", "shadows", "surfaces", "window"}
# A picture from a .npy file needs none of them, and each costs more time to import than the picture to draw.
HEAVY = {
    *("numba", "scipy", "matplotlib", "nrrd", "nibabel", "SimpleITK", "pydicom", "tifffile", "imagecodecs", "mrcfile"),
    *("netCDF4", "vtkmodules", "vtk", "glfw", "imgui_bundle", "OpenGL", "pandas", "dask", "zarr"),
    *("trimesh", "skimage"),
}


def imports(path: Path) -> Iterator[str]:
    """Top-level names of the packages that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]


def users(*libraries: str) -> set[str]:
    """Modules of texvol that import one of the libraries; a package counts as one module."""
    found = (path for path in SOURCES if set(libraries) & set(imports(path)))
    return {path.relative_to(PACKAGE).parts[0].removesuffix(".py") for path in found}


def test_few_modules_talk_to_opengl() -> None:
    found = users("moderngl", "glcontext", "glfw", "OpenGL")
    assert {"contexts", "shaders", "compositor"} <= found <= OPENGL_MODULES


def test_pyrr_is_used_by_the_camera_only() -> None:
    assert users("pyrr") == {"camera"}


@pytest.mark.parametrize(
    "path", sorted([*SOURCES, *(REPOSITORY / "tests").rglob("*.py")]), ids=lambda path: path.relative_to(REPOSITORY)
)
def test_a_file_fits_its_page(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 400
    assert not text or ast.get_docstring(ast.parse(text)), "a module says in its docstring what its one idea is"


def test_functions_fit_a_screen() -> None:
    long = []
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                first = node.body[1] if ast.get_docstring(node) and len(node.body) > 1 else node.body[0]
                lines = (node.end_lineno or 0) - first.lineno + 1
                if lines >= 40:
                    long.append(f"{path.relative_to(REPOSITORY)}:{node.lineno} {node.name}: {lines} lines")
    assert not long


def test_shaders_are_files() -> None:
    for path in SOURCES:
        strings = (
            node.value
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
        )
        assert not any(re.search(r"\bvoid\s+main\s*\(", string) for string in strings), path


def test_every_dependency_has_a_compatible_range() -> None:
    import tomllib

    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    wanted = [
        *project["dependencies"],
        *(each for extra in project["optional-dependencies"].values() for each in extra),
    ]
    assert all(">=" in each for each in wanted if not each.startswith("texvol["))
    # Versions that are dates promise nothing, so an upper bound would be a guess.
    dated = {"imagecodecs", "tifffile"}
    assert all("," in each for each in wanted if not each.startswith("texvol[") and each.split(">")[0] not in dated)


def test_importing_texvol_imports_nothing_else(tmp_path: Path) -> None:
    assert not imported_by("import texvol", tmp_path) & (HEAVY | {"numpy", "moderngl", "OpenImageIO", "pyrr"})


def test_a_picture_of_an_array_imports_nothing_that_it_does_not_need(tmp_path: Path) -> None:
    np.save(tmp_path / "ball.npy", np.random.default_rng(0).random((8, 8, 8), np.float32))
    code = (
        "from texvol.__main__ import main\n"
        "try: status = main(['render', 'ball.npy', '-o', 'ball.png', '--size', '32x32'])\n"
        "except SystemExit as stop: status = stop.code\n"
        "assert not status, status"
    )
    loaded = imported_by(code, tmp_path)
    assert (tmp_path / "ball.png").exists()
    assert not loaded & HEAVY
