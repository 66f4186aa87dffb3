"""Rules that keep the source readable and a picture quick to start."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.processes import imported_by

REPOSITORY = Path(__file__).parents[2]
PACKAGE = REPOSITORY / "texvol"
SOURCES = sorted(PACKAGE.rglob("*.py"))
# Packages from top to bottom: a package imports only packages below it.
ORDER = (
    *("cli", "window", "pytest_plugin", "report", "methods", "comparison", "distributed", "output", "options"),
    *("annotation", "provenance", "rendering", "ray_casting", "opengl", "textures", "slicing", "geometry", "formats"),
    *("scene", "util"),
)
# Users of a library, and packages that a package keeps to.
USERS = {
    "moderngl": "opengl window",
    "glcontext": "opengl",
    "glfw": "window",
    "OpenGL": "window",
    "pyrr": "scene.camera",
}
KEEPS_TO = {"ray_casting": {"ray_casting", "scene", "util"}}
TOP = {"__init__.py", "__main__.py", "py.typed", *ORDER, "docs"}  # docs/ has pages and no modules
# A picture from a .npy file needs none of them, and each costs more time to import than the picture to draw.
HEAVY = {
    *("numba", "scipy", "matplotlib", "nrrd", "nibabel", "SimpleITK", "pydicom", "tifffile", "imagecodecs", "mrcfile"),
    *("netCDF4", "vtkmodules", "vtk", "glfw", "imgui_bundle", "OpenGL", "pandas", "dask", "distributed", "xarray"),
    *("trimesh", "skimage", "meshio", "h5py", "pywt", "zarr", "tensorstore"),
    *("aiohttp", "anywidget", "ipywidgets", "PIL"),
    *("astropy", "segyio", "nd2", "liffile", "pylibCZIrw"),
}


def module_of(path: Path) -> str:
    """Name of a module within texvol: `scene.camera`; a package's is that of its folder."""
    return ".".join(path.relative_to(PACKAGE).with_suffix("").parts).removesuffix("__init__").removesuffix(".")


MODULES = {module_of(path): path for path in SOURCES}


def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def trees() -> dict[Path, ast.Module]:
    """Syntax trees of all modules, which take seconds: not when the tests are collected, by each process."""
    return {path: parsed(path) for path in SOURCES}


PLUGINS = sorted((REPOSITORY / "plugins").rglob("*.py"))  # packages of their own


def imports(tree: ast.Module) -> Iterator[str]:
    """Names of all modules that a file imports, wherever in it; `from a import b` is a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"imports are absolute: {ast.unparse(node)}"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@cache
def imports_of_all() -> dict[str, set[str]]:
    return {module: set(imports(trees()[path])) for module, path in MODULES.items()}


def imported_modules(module: str) -> set[str]:
    """Modules of texvol that a module imports, but for itself."""
    own = {name for name in imports_of_all()[module] if name.split(".")[0] == "texvol"}
    names = {name.removeprefix("texvol").removeprefix(".") for name in own}
    return {name if name in MODULES else name.rpartition(".")[0] for name in names} - {module}


def circles(graph: dict[str, set[str]]) -> list[str]:
    """Nodes that can be reached from themselves."""
    reached = {node: set(edges) for node, edges in graph.items()}
    changed = True
    while changed:
        changed = False
        for edges in reached.values():
            further = set().union(*(reached[each] for each in edges)) - edges
            edges |= further
            changed |= bool(further)
    return sorted(node for node in graph if node in reached[node])


@cache
def graph() -> dict[str, set[str]]:
    return {module: imported_modules(module) for module in MODULES}


def test_no_import_points_up() -> None:
    places = {package: number for number, package in enumerate(ORDER)}
    inner = {module: edges for module, edges in graph().items() if module not in ("", "__main__")}
    pairs = {(a, b) for a, edges in inner.items() for b in edges}
    assert not {f"{a} imports texvol itself" for a, b in pairs if not b}
    # A table of packages in one order has no circle between packages where no import points up.
    up = {f"{a} imports {b}" for a, b in pairs if b and places[b.split(".")[0]] < places[a.split(".")[0]]}
    assert not up


def test_no_circle_between_files() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert not circles({module: edges - {""} for module, edges in graph().items() if module})


@pytest.mark.parametrize("package", KEEPS_TO)
def test_a_package_keeps_to_few_others(package: str) -> None:
    found = {b.split(".")[0] for a, edges in graph().items() if a.split(".")[0] == package for b in edges}
    assert found <= KEEPS_TO[package]


@pytest.mark.parametrize("library", USERS)
def test_a_library_is_used_in_one_place(library: str) -> None:
    found = {module for module, names in imports_of_all().items() if library in {name.split(".")[0] for name in names}}
    places = tuple(USERS[library].split())
    assert all(module.startswith(places) for module in found), found
    assert found or library in ("glcontext", "OpenGL"), "these are used by moderngl and imgui-bundle only"


def test_at_the_top_there_are_packages_only() -> None:
    assert {path.name for path in PACKAGE.iterdir()} - {"__pycache__", "shaders"} <= TOP


def test_the_top_has_the_public_names_only(tmp_path: Path) -> None:
    code = "import texvol; assert dir(texvol) == sorted(texvol.__all__), set(dir(texvol)) ^ set(texvol.__all__)"
    later = "; texvol.render; texvol.Scene; texvol.load"
    imported_by(f"{code}{later}{code.removeprefix('import texvol')}", tmp_path)


def test_a_file_fits_its_page() -> None:
    tests = (REPOSITORY / "tests").rglob("*.py")
    texts = {path: path.read_text(encoding="utf-8") for path in (*SOURCES, *PLUGINS, *tests)}
    assert not [str(path) for path, text in texts.items() if len(text.splitlines()) >= 400]
    silent = [str(path) for path, text in texts.items() if text and not re.match(r'r?"""\s*[^\s"]', text)]
    assert not silent, "a module says in its docstring what its one idea is"


def test_functions_fit_a_screen() -> None:
    long = []
    for path, tree in (trees() | {path: parsed(path) for path in PLUGINS}).items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                first = node.body[1] if ast.get_docstring(node) and len(node.body) > 1 else node.body[0]
                lines = (node.end_lineno or 0) - first.lineno + 1
                if lines >= 40:
                    long.append(f"{path.relative_to(REPOSITORY)}:{node.lineno} {node.name}: {lines} lines")
    assert not long


def test_shaders_are_files() -> None:
    for path, tree in trees().items():
        strings = (
            node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
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
    dated = {"imagecodecs", "tifffile", "liffile", "distributed", "xarray"}
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
