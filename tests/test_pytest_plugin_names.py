"""Names of pictures, whose they are, and the folders that their references are in."""

from __future__ import annotations

import pytest
from picture_project import Project, said, waves

pytest_plugins = ("pytester", "picture_project")

NO_NAMES = ["", "../out", "a/../../out", "/elsewhere/out", "a b", "Ü", "a\\b", ".hidden", "con", "a/", "default"]


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_name_that_is_no_name_is_refused(project: Project, name: str) -> None:
    project.check("waves()", name)
    result = project.run("--texvol-update")
    assert result.ret == 1 and f"picture {name!r}" in said(result)
    assert not list(project.folder.parent.rglob("out.exr")) and not project.references.exists()


def test_a_name_may_have_folders(project: Project) -> None:
    project.check("waves()", "clouds/low-1.5/front")
    assert project.run("--texvol-update").ret == 0 and project.run().ret == 0
    assert (project.references / "clouds/low-1.5/front.exr").exists()


TWO_TESTS = {
    "test_it": "def test_one(check_picture):\n    check_picture(waves(), 'waves')\n",
    "test_more": "def test_two(check_picture):\n    check_picture(waves(), 'waves')\n",
}


@pytest.mark.parametrize("processes", [(), ("-n", "2"), ("-n", "2", "--dist", "loadfile")])
def test_two_tests_that_share_a_name_are_an_error_that_names_both(project: Project, processes: tuple[str, ...]) -> None:
    project.store(waves())
    project.write(**TWO_TESTS)
    result = project.run(*processes, apart=bool(processes))
    result.assert_outcomes(passed=1, failed=1)
    text = said(result)
    assert "checked by two tests" in text and "test_it.py::test_one" in text and "test_more.py::test_two" in text


def test_the_same_name_in_two_folders_is_two_pictures(project: Project) -> None:
    for folder, shift in (("a", 0), ("b", 1)):
        test = f"def test_it(check_picture):\n    check_picture(waves({shift}), 'waves')\n"
        project.write(**{f"{folder}__test_{folder}": test})
    assert project.run("--texvol-update").ret == 0
    result = project.run("--texvol-report", "report")
    result.assert_outcomes(passed=2)
    assert len(list((project.folder / "report/pages").rglob("waves.html"))) == 2


def test_one_test_may_share_a_name_with_itself(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
@pytest.mark.parametrize("backend", ["a", "b"])
def test_it(check_picture, backend):
    for _ in range(2):
        check_picture(waves(), "waves")
"""
    )
    result = project.run("--texvol-report", "report")
    result.assert_outcomes(passed=2)
    assert len(project.report()["pictures"]) == 4
    assert len({each["page"] for each in project.report()["pictures"]}) == 4


def test_a_folder_that_cannot_be_written_to_is_said(project: Project) -> None:
    project.references.write_text("a file where the folder should be")
    project.check("waves()")
    result = project.run("--texvol-update")
    assert result.ret == 1 and "references: cannot be made" in said(result)


def test_other_folders_and_other_current_folders(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.folder.joinpath("pytest.ini").write_text("[pytest]\ntexvol_references = data/pictures\n")
    test = "class TestIt:\n    def test_it(self, check_picture):\n        check_picture(waves(), 'waves')\n"
    project.write(tests__deep__test_it=test)
    assert project.run("--texvol-update").ret == 0
    assert (project.folder / "tests/deep/data/pictures/waves.exr").exists()
    monkeypatch.chdir(project.folder / "tests")
    assert project.run("deep").ret == 0
    elsewhere = project.folder / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert project.run(project.folder / "tests").ret == 0 and not any(elsewhere.iterdir())
