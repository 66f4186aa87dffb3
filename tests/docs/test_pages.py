"""Every command and every Python block of the README and of the pages runs, in a folder with small example volumes."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.page_blocks import PAGES, REPOSITORY, Block, blocks
from support.picture_project import leave_ci

import texvol
from texvol.__main__ import main as texvol_main
from texvol.distributed.workers import Workers
from texvol.formats.pictures import image
from texvol.report.convergence import Limits
from texvol.scene.demo import demo_volume

pytest_plugins = ("pytester",)

# Blocks that need a network, a display or an hour; each says so above it.
NOT_RUN = {
    "README": 2,
    "benchmarks": 5,
    "contributing": 1,
    "first-pictures": 1,
    "first-ten-minutes": 2,
    "large-volumes": 1,
    "looks": 1,
    "python": 2,
    "window": 3,
}
MARKS = {"", "file", "not run", "output", "status"}
LANGUAGES = {"sh", "python", "text", "json", "toml", "yaml"}
RUN = [page for page in PAGES if any(each.language in ("sh", "python") for each in blocks(page))]


@pytest.fixture(scope="module")
def volumes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the example volumes, a sixth as fine along each axis as the pictures of the pages are made from."""
    folder = tmp_path_factory.mktemp("volumes")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(REPOSITORY / "scripts"))  # the script imports its neighbours
        runpy.run_path(str(REPOSITORY / "scripts/example_volumes.py"))["write_volumes"](folder, 12.0)
    return folder


@pytest.fixture(scope="module")
def loaded() -> None:
    """Libraries that must not be loaded by a run of pytest within this process, which drops what it has loaded."""
    with texvol.Renderer() as renderer:
        renderer.render(texvol.Scene(demo_volume(8), classification="slab"), (4, 4))
    texvol.raycast(texvol.Scene(demo_volume(8), classification="slab"), (4, 4))


@pytest.fixture
def shared_workers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Commands of a page that draw by workers draw by those that the first of them starts."""
    start, started = Workers, []

    def once(*count: int, **how: Any) -> Workers:
        if not started:
            started.append(start(*count, **how))
            monkeypatch.setattr(started[0], "close", lambda: None)
        return started[0]

    monkeypatch.setattr("texvol.distributed.workers.Workers", once)
    yield
    for each in started:
        start.close(each)


@pytest.fixture
def workplace(
    page: str,
    volumes: Path,
    loaded: None,
    shared_workers: None,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
) -> Path:
    """The current folder of a page's commands, with the volumes in it; pictures are small, and a report is short."""
    shell = (block.commands for block in blocks(page) if block.language == "sh")
    runs_pytest = any(words[0] == "pytest" for commands in shell for words in commands)
    folder = request.getfixturevalue("pytester").path if runs_pytest else request.getfixturevalue("tmp_path")
    for path in volumes.iterdir():
        (folder / path.name).symlink_to(path)
    leave_ci(monkeypatch)
    monkeypatch.setattr("texvol.options.scene_options.DEFAULT_SIZE", (48, 48))
    monkeypatch.setattr("texvol.scene.demo.demo_volume", partial(demo_volume, 24))
    monkeypatch.setattr("texvol.report.measuring.QUICK_RATES", (1.0,))
    monkeypatch.setattr("texvol.report.vtk_mappers.MAPPERS", ())
    monkeypatch.setattr("texvol.report.measuring._limits", lambda quick: Limits(least_frames=1, frames_seconds=0))
    monkeypatch.setattr("texvol.report.plot.pareto_plot", lambda *_: image.encoded("a.png", np.zeros((1, 1, 4), "f4")))
    monkeypatch.chdir(folder)
    return folder


@pytest.mark.parametrize("page", RUN)
def test_commands_and_python_blocks_of_a_page_run(
    page: str, workplace: Path, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    names: dict[str, object] = {"__name__": "page"}
    printed = ""
    for block in blocks(page):
        where = f"{PAGES[page].name}, line {block.line}"
        if block.mark == "file":
            path = workplace / block.argument
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
        elif block.mark == "output":
            assert printed == block.text, where
        elif block.mark != "not run" and block.language == "sh":
            run_commands(block, where, request)
        elif block.language == "python":
            capsys.readouterr()
            exec(compile(block.text, where, "exec"), names)
            printed = capsys.readouterr().out


def run_commands(block: Block, where: str, request: pytest.FixtureRequest) -> None:
    """Run a shell block; each command ends with the status that the page says, 0 unless it does."""
    expected = int(block.argument) if block.mark == "status" else 0
    for words in block.commands:
        if words[0] == "texvol":
            status = texvol_main(smaller(words[1:]))
        else:
            assert words[0] == "pytest", f"{where}: {words[0]} is not run here, and no comment says why"
            for path in Path.cwd().rglob("test_*.py"):  # a test of ours may have the name of a page's
                request.getfixturevalue("monkeypatch").delitem(sys.modules, path.stem, raising=False)
            status = request.getfixturevalue("pytester").runpytest_inprocess(*words[1:]).ret
        assert status == expected, f"{where}: {' '.join(words)}"


MOST = {"--size": 64, "--orbit": 6, "--tour": 6}  # pixels along a side, and views around or along a tour


def smaller(words: list[str]) -> list[str]:
    """The words of a command whose pictures are small, and few."""
    return [
        "x".join(str(min(int(number), MOST[before])) for number in word.split("x")) if before in MOST else word
        for before, word in zip(["", *words], words, strict=False)
    ]


def test_blocks_that_are_not_run_say_why_and_are_counted() -> None:
    left_out = [(page, each) for page in PAGES for each in blocks(page) if each.mark == "not run"]
    reasons = ("needs a network", "needs a display", "needs a notebook", "takes ")
    assert all(block.argument.startswith(reasons) for _, block in left_out)
    counts = {page: sum(other == page for other, _ in left_out) for page, _ in left_out}
    assert counts == NOT_RUN


@pytest.mark.parametrize("page", PAGES)
def test_blocks_are_of_a_known_language_and_mark(page: str) -> None:
    found = list(blocks(page))
    fences = PAGES[page].read_text(encoding="utf-8").count("\n```")
    assert fences == 2 * len(found), "a block that is not closed, or stands inside a list, is not found"
    for block in found:
        assert block.language in LANGUAGES and block.mark in MARKS, f"{PAGES[page].name}, line {block.line}"
        assert block.language != "json" or block.mark == "file", "a file that is shown is written and used"


def outputs(page: str) -> Iterator[tuple[int, str]]:
    """Line and name of each file that a page's commands write with -o."""
    for block in blocks(page):
        if block.language == "sh":
            for words in block.commands:
                yield from ((block.line, words[at + 1]) for at, word in enumerate(words) if word in ("-o", "--output"))


def test_the_cookbook_has_a_picture_above_each_command() -> None:
    sections = PAGES["cookbook"].read_text(encoding="utf-8").split("\n## ")[1:]
    written = {Path(name).stem for _, name in outputs("cookbook")}
    for section in sections:
        title, _, rest = section.partition("\n\n")
        assert rest.startswith("!["), f"{title}: no picture"
        name = rest.partition("](pictures/")[2].partition(")")[0]
        assert Path(name).stem in written and f" {Path(name).stem}." in rest, f"{title}: no command writes {name}"
