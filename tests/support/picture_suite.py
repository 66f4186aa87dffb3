"""A project with a picture of every status, and what its report has to hold."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import unquote

from support.picture_project import Project, waves

SUITE = """
@pytest.mark.parametrize("number", range(6))
def test_same(check_picture, number):
    check_picture(waves(number), f"same/p{number}")

def test_far(check_picture):
    check_picture(waves(2.0), "far")

def test_near(check_picture):
    check_picture(waves(0.1), "near")

def test_new(check_picture):
    check_picture(waves(), "new")

def test_broken(check_picture):
    check_picture(waves(0, 12), "broken")

def test_unreadable(check_picture):
    check_picture("missing.exr", "unreadable")
"""


def suite(project: Project) -> None:
    for number in range(6):
        project.store(waves(number), f"same/p{number}")
    for name in ("far", "near", "broken", "unreadable"):
        project.store(waves(), name)
    project.write(test_it=SUITE)


def links(page: Path) -> list[Path]:
    """The files that a page links to."""
    found = re.findall(r'href="([^"#][^"]*)"', page.read_text("utf-8"))
    return [page.parent / unquote(each) for each in found if not each.startswith("data:")]


def assert_report_is_whole(project: Project, folder: str, others: str) -> None:
    """All pictures are in the report, the worst first, and its links lead to pages; `others` counts the rest."""
    report = project.report(folder)
    names = [each["name"] for each in report["pictures"]]
    assert names[:5] == ["broken", "unreadable", "far", "near", "new"]
    assert len(names) == 5 + sum(map(int, re.findall(r"\d+", others)))
    assert report["counts"] == f"2 broken, 2 different, 1 new, {others}" and report["exit_status"] == 1
    root = project.folder / folder
    text = (root / "index.html").read_text("utf-8")
    positions = [text.index(f"test_it.py::test_{name}") for name in ("broken", "far", "near", "new", "same[0]")]
    assert positions == sorted(positions)
    pages = links(root / "index.html")
    assert all(page.exists() for page in pages)
    assert {root / each["page"] for each in report["pictures"] if each["page"]} <= set(pages)
    assert (root / "index.html").resolve() in [page.resolve() for page in links(root / "pages/far.html")]
    far = report["by_name"]["far"]
    assert (root / far["candidate"]).exists() and far["kinds"] and far["max_error"] > 0.1
    assert "| far |" in (root / "summary.md").read_text("utf-8")
