"""Names of pictures, whose they are, and the folders that their references are in."""

from __future__ import annotations

import numpy as np
import pytest
from support.picture_project import Project, said, waves

pytest_plugins = ("pytester", "support.picture_project")

NO_NAMES = ["", "../out", "a/../../out", "/elsewhere/out", "a b", "Ü", "a\\b", ".hidden", "con", "a/", "default"]


def test_a_name_that_is_no_name_is_refused(project: Project) -> None:
    test = "@pytest.mark.parametrize('name', {})\ndef test_it(check_picture, name):\n    check_picture(waves(), name)\n"
    project.write(test_it=test.format(NO_NAMES))
    result = project.run("--texvol-update")
    result.assert_outcomes(failed=len(NO_NAMES))
    assert not [name for name in NO_NAMES if f"picture {name!r}" not in said(result)]
    assert not list(project.folder.parent.rglob("out.exr")) and not project.references.exists()


def test_a_name_may_have_folders(project: Project) -> None:
    project.check("waves()", "clouds/low-1.5/front")
    assert project.run("--texvol-update").ret == 0 and project.run().ret == 0
    assert (project.references / "clouds/low-1.5/front.exr").exists()


TWO_TESTS = {
    "test_it": "def test_one(check_picture):\n    check_picture(waves(), 'waves')\n",
    "test_more": "def test_two(check_picture):\n    check_picture(waves(), 'waves')\n",
}


def test_two_tests_that_share_a_name_are_an_error_that_names_both(project: Project) -> None:
    project.store(waves())
    project.write(**TWO_TESTS)
    result = project.run()
    result.assert_outcomes(passed=1, failed=1)
    text = said(result)
    assert "checked by two tests" in text and "test_it.py::test_one" in text and "test_more.py::test_two" in text


@pytest.mark.parametrize("exists", [True, False])
def test_nothing_is_written_for_two_tests_that_share_a_name(project: Project, exists: bool) -> None:
    if exists:
        project.store(waves())
    before = project.references.joinpath("waves.exr").read_bytes() if exists else b""
    other = "def test_other(check_picture):\n    check_picture(waves(3.0), 'other')\n"
    project.write(**{name: text.replace("waves()", f"waves({len(name)})") for name, text in TWO_TESTS.items()})
    project.write(test_other=other)
    result = project.run("--texvol-update", "--texvol-report", "report")
    result.assert_outcomes(passed=2, failed=1)
    assert result.ret == 1
    text = said(result)
    assert "not written: picture 'waves' is checked by two tests" in text and "wrote references/waves" not in text
    there = {"other.exr", "waves.exr"} if exists else {"other.exr"}
    assert {path.name for path in project.references.iterdir()} == there
    if exists:
        assert project.references.joinpath("waves.exr").read_bytes() == before
    assert "wrote references/other.exr" in text
    statuses = [each["status"] for each in project.report()["pictures"] if each["name"] == "waves"]
    assert statuses == ["refused", "refused"]
    index = (project.folder / "report/index.html").read_text("utf-8")
    assert "was not written" in index


def test_names_that_differ_by_case_alone_are_one(project: Project) -> None:
    project.write(
        test_it="""
def test_one(check_picture):
    check_picture(waves(), "Waves/low")

def test_two(check_picture):
    check_picture(waves(1.0), "waves/LOW")
""",
        test_more="""
def test_itself(check_picture):
    check_picture(waves(), "cloud")
    check_picture(waves(1.0), "Cloud")
""",
    )
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=1, failed=2)
    text = said(result)
    assert "'Waves/low' and 'waves/LOW' differ only in case" in text and "'cloud' and 'Cloud'" in text
    assert not project.references.exists()


def test_one_folder_by_two_paths_is_one_folder(project: Project) -> None:
    project.folder.joinpath("pytest.ini").write_text("[pytest]\ntexvol_references = ../shared\n")
    for folder in ("a", "b[1]"):
        test = f"def test_{folder[0]}(check_picture):\n    check_picture(waves({ord(folder[0])}), 'waves')\n"
        project.write(**{f"{folder}__test_{folder[0]}": test})
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=1, failed=1)
    assert "checked by two tests, a/test_a.py::test_a and b[1]/test_b.py::test_b" in said(result)
    assert not (project.folder / "shared").exists()


def test_tests_in_a_folder_with_brackets_are_told_apart(project: Project) -> None:
    tests = "".join(
        f"def test_{each}(check_picture):\n    check_picture(waves({number}), 'waves')\n"
        for number, each in enumerate(("one", "two"))
    )
    project.write(**{"a[1]__test_it": tests})
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=1, failed=1)
    assert "checked by two tests" in said(result)


UNLIKE = """
@pytest.mark.parametrize("shift", [1.0, 2.0])
def test_it(check_picture, shift):
    check_picture(waves(shift), "waves")
"""


def test_a_reference_is_not_replaced_by_one_of_two_unlike_pictures(project: Project) -> None:
    project.store(waves())
    project.write(test_it=UNLIKE)
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=1, failed=1)
    np.testing.assert_array_equal(project.stored().pixels, waves())
    assert "not written: " in said(result) and "gives another picture of that name" in said(result)


def test_what_waits_is_written_though_another_test_failed(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
def test_it(check_picture):
    check_picture(waves(1.0), "waves")
    check_picture(waves(1.0), "waves")
    assert not list(Path("references").glob("new*"))

def test_new(check_picture):
    check_picture(waves(2.0), "new")
    raise ValueError
""".replace("\ndef test_it", "\nfrom pathlib import Path\n\ndef test_it", 1)
    )
    project.run("--texvol-update").assert_outcomes(passed=1, failed=1)
    np.testing.assert_array_equal(project.stored().pixels, waves(1.0))
    np.testing.assert_array_equal(project.stored("new").pixels, waves(2.0))


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
    assert result.ret == 1 and "references: cannot be created" in said(result)


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
