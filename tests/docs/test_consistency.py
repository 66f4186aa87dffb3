"""Pages agree with the program and the repository: links, paths, packages, presets, names, options, version."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib

import pytest
from support.page_blocks import DOCS, PAGES, REPOSITORY, blocks

import texvol
from texvol.__main__ import main as texvol_main
from texvol.cli.help import topics
from texvol.comparison.kinds import NAMES
from texvol.scene.scene import CLASSIFICATIONS, MODES
from texvol.scene.transfer import PRESETS
from texvol.window.commands import TABS

LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
PATH = re.compile(r"`((?:texvol|shaders|scripts|tests)/[\w./-]+)`")


def text_of(page: str) -> str:
    return PAGES[page].read_text(encoding="utf-8")


def test_the_readme_is_two_screens_with_a_picture_at_the_top() -> None:
    lines = text_of("README").splitlines()
    assert len(lines) <= 150
    assert any("![" in line for line in lines[:20])


@pytest.mark.parametrize("page", PAGES)
def test_links_and_pictures_are_there(page: str) -> None:
    for target in LINK.findall(text_of(page)):
        assert target.startswith("https://") or (PAGES[page].parent / target).exists(), target


@pytest.mark.parametrize("page", PAGES)
def test_files_that_a_page_names_are_there(page: str) -> None:
    missing = [each for each in PATH.findall(text_of(page)) if "NAME" not in each and not (REPOSITORY / each).exists()]
    assert not missing


@pytest.mark.parametrize("page", [page for page in PAGES if page != "options"])
def test_no_heading_and_no_paragraph_is_twice_in_a_page(page: str) -> None:
    paragraphs = [each.strip() for each in text_of(page).split("\n\n") if each.startswith("#") or len(each) > 200]
    assert sorted(paragraphs) == sorted(set(paragraphs))


def test_names_in_the_contributing_page_are_in_the_source() -> None:
    source = "".join(path.read_text(encoding="utf-8") for path in (REPOSITORY / "texvol").rglob("*.py"))
    source += "".join(path.read_text(encoding="utf-8") for path in (REPOSITORY / "shaders").iterdir())
    source += (REPOSITORY / "pyproject.toml").read_text(encoding="utf-8")
    named = set(re.findall(r"`(_?[A-Za-z][A-Za-z_]*)(?:\(.*?\))?(?: -> \w+)?`", text_of("contributing")))
    assert {"_KINDS", "FORMATS", "PRESETS", "read"} <= named
    assert not named - set(re.findall(r"\w+", source))


def test_the_window_page_names_every_tab() -> None:
    assert not [tab for tab in TABS if f"*{tab}*" not in text_of("window")]


def test_every_stored_picture_is_shown() -> None:
    folder = DOCS / "pictures"
    shown = {target.partition("pictures/")[2] for page in PAGES for target in LINK.findall(text_of(page))}
    stored = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert stored == shown - {""}
    assert sum((folder / name).stat().st_size for name in stored) < 3e6, "the package stays small"


def test_every_page_has_a_title_and_is_in_the_index() -> None:
    names = PAGES.keys() - {"README", "index"}
    assert names == set(topics())
    listed = {target.removesuffix(".md") for target in LINK.findall(text_of("index")) if target.endswith(".md")}
    assert names <= listed
    assert all(text_of(page).startswith("# ") for page in PAGES)


def test_the_options_page_is_what_the_parser_has() -> None:
    script = REPOSITORY / "scripts" / "doc_options.py"
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run([sys.executable, script, "--check"], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_preset_has_a_thumbnail() -> None:
    assert {f"preset-{name}.jpg" for name in PRESETS} == {path.name for path in DOCS.glob("pictures/preset-*")}
    assert all(f"![{name}](pictures/preset-{name}.jpg)" in text_of("looks") for name in PRESETS)


def test_modes_classifications_and_kinds_are_described() -> None:
    assert all(f"`{mode}`" in text_of("looks") for mode in MODES)
    assert all(f"| `{each}`" in text_of("accuracy") for each in CLASSIFICATIONS)
    words = " ".join(text_of("ci").split())
    said = {"rounding": "number formats", "straight colour": "straight instead of premultiplied colour"}
    assert not [name for name in NAMES if said.get(name, name) not in words and name != "unexplained"]


def test_every_public_name_is_in_the_reference() -> None:
    public = {name for name in texvol.__all__ if not name.startswith("_")}
    listed = set(re.findall(r"`(\w+)`", "\n".join(re.findall(r"^\| .*? \|", text_of("reference"), re.MULTILINE))))
    assert public == listed


def test_the_drawing_of_the_layers_has_every_package() -> None:
    drawn = next(each.text for each in blocks("how-it-works") if each.language == "text")
    packages = [path.parent.name for path in (REPOSITORY / "texvol").glob("*/__init__.py")]
    assert sorted(line.split()[0] for line in drawn.splitlines()) == sorted(packages)


def test_version_and_changes_agree(capsys: pytest.CaptureFixture[str]) -> None:
    newest = re.search(r"^## (\S+)$", text_of("changes"), re.MULTILINE)
    assert newest is not None and newest[1] == texvol.__version__
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    source = (REPOSITORY / project["tool"]["hatch"]["version"]["path"]).read_text(encoding="utf-8")
    assert f'__version__ = "{newest[1]}"' in source
    with pytest.raises(SystemExit, match="0"):
        texvol_main(["--version"])
    assert capsys.readouterr().out == f"texvol {newest[1]}\n"
