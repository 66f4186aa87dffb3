"""Accepted pictures: chosen ones only, all or none, below the project; a button that only its page can press."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
from support.browser import Browser, Page, browser  # noqa: F401 (fixture)
from support.picture_project import Project, waves
from support.picture_suite import suite
from support.report_server import asked, serving

from texvol.cli.command_line import main
from texvol.comparison.pictures import read_picture

pytest_plugins = ("pytester", "support.picture_project")


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first project of `reported`, as it was made; empty before."""
    return tmp_path_factory.mktemp("first")


@pytest.fixture
def reported(project: Project, first: Path) -> Project:
    """A project with a report of pictures of every status; but for the first it is a copy."""
    if any(first.iterdir()):
        shutil.copytree(first, project.folder, dirs_exist_ok=True)
    else:
        suite(project)
        project.run("--texvol-report", "report")
        shutil.copytree(project.folder, first, dirs_exist_ok=True)
    return project


def changed_by(project: Project, *line: str) -> tuple[int, set[str]]:
    """Status of a command, and the references that it wrote."""

    def contents() -> dict[str, bytes]:
        paths = [path for path in project.references.rglob("*") if path.is_file()]
        return {str(path.relative_to(project.references)): path.read_bytes() for path in paths}

    before = contents()
    status = main(["accept", *line])
    after = contents()
    return status, {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}


def test_only_what_is_chosen_is_accepted_and_passes_then(reported: Project, capsys: pytest.CaptureFixture[str]) -> None:
    assert changed_by(reported, "report", "far", "new") == (0, {"far.exr", "new.exr"})
    told = capsys.readouterr().out
    assert "far: replaced references/far.exr" in told and "new: wrote references/new.exr" in told
    assert reported.run("-k", "far or new").ret == 0 and reported.run("-k", "near").ret == 1
    # All of the rest that has a candidate; the unreadable picture has none.
    assert changed_by(reported, "report", "--all") == (0, {"near.exr", "broken.exr"})


def test_a_reference_keeps_its_format(project: Project) -> None:
    from texvol.formats.pictures import image

    project.references.mkdir()
    image.write(project.references / "waves.png", waves())
    project.check("waves(2.0)")
    project.run("--texvol-report", "report")
    assert changed_by(project, "report", "waves") == (0, {"waves.png"})
    assert project.run().ret == 0


def test_what_is_not_on_offer_changes_nothing(reported: Project, capsys: pytest.CaptureFixture[str]) -> None:
    for line, words in (
        (("report", "far", "fra"), "'fra' not found among the failed pictures of the report; did you mean 'far'"),
        (("report", "same/p0"), "not found among"),
        (("--all", "report", "far"), "--all takes no names"),
        (("report", "far", "--root", "elsewhere"), "--root must be a folder"),
        (("report", "far", "--root", "report"), "must exist; name the project's folder by --root"),
        (("references", "far"), "has no report.json"),
        (("nowhere", "far"), "got no folder"),
    ):
        status, changed = changed_by(reported, *line)
        error = capsys.readouterr().err
        assert status == 2 and words in error and error.count("\n") == 1
        assert not changed and not (reported.folder / "report/references").exists()


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("reference", "../outside/far.exr"),
        ("reference", "/elsewhere/far.exr"),
        ("reference", "references/near.exr"),
        ("reference", "conftest.py"),
        ("name", "../far"),
        ("candidate", "../references/near.exr"),
        ("candidate", "/etc/hostname"),
        ("candidate", "report.json"),
    ],
)
def test_a_report_leads_out_of_no_folder(reported: Project, key: str, text: str) -> None:
    file = reported.folder / "report/report.json"
    content = json.loads(file.read_text("utf-8"))
    for each in content["pictures"]:
        if each["name"] == "far":
            each[key] = text
    file.write_text(json.dumps(content), "utf-8")
    before = {path: path.read_bytes() for path in reported.folder.rglob("*") if path.is_file()}
    assert main(["accept", "report", "far"]) == 2
    assert before == {path: path.read_bytes() for path in reported.folder.rglob("*") if path.is_file()}
    for outside in (reported.folder.parent / "outside", reported.folder.parent / "far.exr", Path("/elsewhere")):
        assert not outside.exists()


@pytest.mark.parametrize("is_link", [False, True])
def test_a_new_picture_is_written_below_the_project_only(reported: Project, is_link: bool) -> None:
    outside = reported.folder.parent / f"outside-{reported.folder.name}"
    outside.mkdir()
    if is_link:
        (reported.folder / "linked").symlink_to(outside)
    file = reported.folder / "report/report.json"
    content = json.loads(file.read_text("utf-8"))
    (new,) = (each for each in content["pictures"] if each["name"] == "new")
    new["reference"] = "linked/new.exr" if is_link else f"../{outside.name}/new.exr"
    file.write_text(json.dumps(content), "utf-8")
    assert main(["accept", "report", "new"]) == 2 and not list(outside.iterdir())


def test_a_picture_with_a_nan_is_never_accepted(project: Project, capsys: pytest.CaptureFixture[str]) -> None:
    project.store(waves())
    project.check("waves() * np.float32(np.nan)")
    project.run("--texvol-report", "report")
    assert changed_by(project, "report", "waves") == (2, set())
    assert "must be finite" in capsys.readouterr().err
    # It neither has a box in the page nor keeps the others from being accepted.
    assert 'name="accept"' not in (project.folder / "report/index.html").read_text("utf-8")
    assert changed_by(project, "report", "--all") == (0, set())
    assert "waves: left out: it must be finite" in capsys.readouterr().out


def test_what_a_report_says_cannot_be_accepted_is_not(reported: Project, capsys: pytest.CaptureFixture[str]) -> None:
    """As of a picture that is held against the oracle, and has no reference."""
    file = reported.folder / "report/report.json"
    content = json.loads(file.read_text("utf-8"))
    (far,) = (each for each in content["pictures"] if each["name"] == "far")
    far["not_accepted"] = "it has no reference"
    file.write_text(json.dumps(content), "utf-8")
    assert changed_by(reported, "report", "far", "new") == (2, set())
    assert "picture 'far' cannot be accepted: it has no reference" in capsys.readouterr().err


def test_the_server_answers_its_own_page_only(reported: Project) -> None:
    before = (reported.references / "far.exr").read_bytes()
    with serving(reported.folder / "report", reported.folder) as server:
        start, wanted = f"/{server.token}", {"pictures": ["far"]}
        action = f"{start}/accept"
        assert asked(server, "GET", f"{start}/index.html")[0] == 200
        assert asked(server, "GET", f"{start}/pages/far.html")[0] == 200
        for path in ("/", "/index.html", f"{start[:-1]}/index.html", "/accept"):
            assert asked(server, "GET", path)[0] == 403
        for path in ("../references/far.exr", "%2e%2e/references/far.exr", "//etc/hostname", "pages", "nothing.html"):
            assert asked(server, "GET", f"{start}/{path}")[0] == 404
        for headers in (
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Host": "evil.example", "Origin": "http://evil.example"},
        ):
            assert asked(server, "POST", action, wanted, **headers)[0] == 403
        for body in ({"pictures": []}, {"pictures": "far"}, {"pictures": ["far", "fra"]}, [], None):
            assert asked(server, "POST", action, body)[0] == 400
        assert asked(server, "POST", action, wanted, Content_Type="text/plain")[0] == 400
        assert (reported.references / "far.exr").read_bytes() == before and not server.accepted
        # Another name of this machine, as a page elsewhere could make it up; and a link in the report that leads out.
        assert asked(server, "GET", f"{start}/index.html", Host=f"evil.example:{server.server_port}")[0] == 403
        assert asked(server, "POST", action, wanted, Host=f"evil.example:{server.server_port}")[0] == 403
        (reported.folder / "report/link.exr").symlink_to(reported.references / "far.exr")
        assert asked(server, "GET", f"{start}/link.exr")[0] == 404
        status, content = asked(server, "POST", action, wanted)
        assert status == 200 and json.loads(content)["accepted"] == server.accepted and len(server.accepted) == 1
    candidate = read_picture(reported.folder / "report/pages/far.exr")
    assert np.array_equal(reported.stored("far").pixels, candidate.pixels)


def test_the_page_has_a_command_and_where_it_is_served_a_button(
    reported: Project,
    browser: Browser,  # noqa: F811
) -> None:
    index = reported.folder / "report/index.html"
    page = Page(browser, index)
    page.click("input[value=far]")
    page.click("input[value=new]")
    assert page.tell("document.getElementById('accept-command').textContent") == "texvol accept report far new"
    assert page.tell("document.getElementById('accept-button').hidden")
    with serving(index.parent, reported.folder) as server:
        page.call("Page.navigate", url=server.address)
        page.wait_for("document.readyState === 'complete' && location.protocol === 'http:'")
        assert page.tell("document.getElementById('accept-button').disabled"), "nothing is chosen yet"
        page.click("input[value=far]")
        page.click("#accept-button")
        page.wait_for("document.getElementById('accept-result').textContent.includes('far: replaced')")
        assert page.tell("document.querySelector('input[value=far]').disabled")
        assert [line.split(":")[0] for line in server.accepted] == ["far"]
        Path(reported.folder / "report/pages/new.exr").unlink()
        page.click("input[value=new]")
        page.click("#accept-button")
        page.wait_for("document.getElementById('accept-result').textContent.startsWith('Not accepted: picture')")
    assert reported.run("-k", "far").ret == 0
    assert not page.complaints()[1:], "but for the refused request"
    page.close()


def test_the_command_of_a_report_that_was_moved_names_the_folder_where_it_is(
    reported: Project,
    browser: Browser,  # noqa: F811
    tmp_path: Path,
) -> None:
    moved = (reported.folder / "report").rename(tmp_path / "it's ü")
    page = Page(browser, moved / "index.html")
    page.click("input[value=far]")
    lines = page.tell("[...document.querySelectorAll('#accept code')].map(each => each.textContent)")
    assert [shlex.split(line) for line in lines] == [
        ["texvol", "accept", str(moved)], ["texvol", "accept", str(moved), "far"]
    ]  # fmt: skip
    page.close()
