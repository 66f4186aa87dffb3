"""check_picture and references: found, missing, written; and how a run ends."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest
from support.picture_project import Project, said, waves

from texvol.formats.pictures import image
from texvol.pytest_plugin.summary import status_of
from texvol.util.version import __version__

pytest_plugins = ("pytester", "support.picture_project")


def test_a_picture_without_a_reference_fails_and_says_how_to_make_one(project: Project) -> None:
    project.check("waves()")
    result = project.run()
    assert result.ret == 10
    text = said(result)
    assert "picture 'waves' is new: there is no reference references/waves.exr yet" in text
    assert "pytest --texvol-update test_it.py::test_it" in text
    assert not project.references.exists()


def test_update_makes_the_reference_that_the_next_run_is_held_against(project: Project) -> None:
    project.check("waves()", driver="a driver")
    result = project.run("--texvol-update")
    assert result.ret == 0 and "wrote references/waves.exr" in said(result)
    stored = project.stored()
    np.testing.assert_array_equal(stored.pixels, waves())
    fingerprint = json.loads(stored.attributes["texvol:fingerprint"])
    assert fingerprint["driver"] == stored.attributes["texvol:renderer"] == "a driver"
    assert fingerprint["texvol"] == __version__ and f"numpy {np.__version__}" in fingerprint["libraries"]
    assert project.run().ret == 0


def test_update_writes_what_fails_and_nothing_else(project: Project) -> None:
    for name in ("same", "other"):
        project.store(waves(), name)
    (project.references / "same.exr").touch()
    before = {path.name: (path.stat().st_mtime_ns, path.stat().st_ino) for path in project.references.iterdir()}
    project.write(
        test_it="""
def test_same(check_picture):
    check_picture(waves() + np.float32(1e-5), "same")

def test_other(check_picture):
    check_picture(waves(1.0), "other")

def test_new(check_picture):
    check_picture(waves(2.0), "new")
"""
    )
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=3)
    after = {path.name: (path.stat().st_mtime_ns, path.stat().st_ino) for path in project.references.iterdir()}
    assert after["same.exr"] == before["same.exr"]
    np.testing.assert_array_equal(project.stored("other").pixels, waves(1.0))
    assert sorted(after) == ["new.exr", "other.exr", "same.exr"]
    assert [line for line in result.outlines if line.startswith("wrote")] == [
        "wrote references/new.exr",
        "wrote references/other.exr",
    ]


@pytest.mark.parametrize("exists", [True, False])
def test_update_never_writes_what_is_no_picture(project: Project, exists: bool) -> None:
    if exists:
        project.store(waves())
    project.write(
        test_it="""
def test_it(check_picture):
    picture = waves()
    picture[3, 5, 1] = np.nan
    check_picture(picture, "waves")
"""
    )
    result = project.run("--texvol-update")
    assert result.ret == 11 and "not finite in 1 of 768 pixels, first in column 5, row 3" in said(result)
    if exists:
        np.testing.assert_array_equal(project.stored().pixels, waves())
    else:
        assert not project.references.exists()


def test_a_test_does_not_replace_what_it_has_just_written(project: Project) -> None:
    """Else one of two pictures that share a reference would pass, whatever it shows."""
    project.write(
        test_it="""
@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_it(check_picture, shift):
    check_picture(waves(shift), "waves")
"""
    )
    result = project.run("--texvol-update")
    result.assert_outcomes(passed=1, failed=1)
    np.testing.assert_array_equal(project.stored().pixels, waves())


def test_where_ci_is_set_references_are_not_written(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.check("waves()")
    monkeypatch.setenv("CI", "true")
    result = project.run("--texvol-update")
    assert result.ret == pytest.ExitCode.USAGE_ERROR and "--texvol-force-update" in said(result)
    assert not project.references.exists()
    assert project.run("--texvol-force-update").ret == 0 and project.references.exists()


def test_a_different_picture_says_what_is_wrong_and_where_to_look(project: Project) -> None:
    project.store(waves())
    project.write(
        test_it="""
def test_it(check_picture):
    picture = waves()
    picture[7, 9] += np.float32(0.25)
    check_picture(picture, "waves")
"""
    )
    result = project.run()
    assert result.ret == 1
    lines = [line.removeprefix("E").strip() for line in result.outlines if line.startswith("E ")]
    assert lines[0].endswith("picture 'waves' is different")
    assert any("0.13% of the pixels differ by more than 0.001, the limit is 0%" in line for line in lines)
    assert any(line.startswith("worst pixel: column 9, row 7") for line in lines)
    positions = dict(line.split(maxsplit=1) for line in lines if line.startswith(("candidate:", "page:", "reference:")))
    assert positions["reference:"] == "references/waves.exr"
    candidate = image.read(positions["candidate:"])
    assert candidate[7, 9, 0] == pytest.approx(waves()[7, 9, 0] + 0.25)
    assert "<html" in Path(positions["page:"]).read_text("utf-8")
    assert len(lines) < 15


BROKEN = "np.full((24, 32, 4), np.inf, np.float32)"


@pytest.mark.parametrize(
    ("pictures", "status"),
    [
        (["waves()"], 0),
        (["waves(1)"], 1),
        (["NEW"], 10),
        ([BROKEN], 11),
        (["waves(0, 12)"], 11),
        (["waves()[..., :3]"], 11),
        (["'no_such_file.exr'"], 11),
        (["__file__"], 11),
        (["waves()", "NEW"], 10),
        (["NEW", BROKEN], 11),
        (["NEW", "waves(1)", BROKEN], 1),
        (["NEW", "1 / 0"], 1),
        (["NEW", "'a text', 'and no file', 3"], 1),
    ],
)
def test_the_exit_status_tells_worse_new_and_broken_apart(project: Project, pictures: list[str], status: int) -> None:
    text = ""
    for number, picture in enumerate(pictures):
        if picture == "NEW":
            picture = "waves()"
        else:
            project.store(waves(), f"p{number}")
        text += f"def test_{number}(check_picture):\n    check_picture({picture}, 'p{number}')\n"
    project.write(test_it=text)
    assert project.run().ret == status


def test_the_exit_status_may_be_that_of_pytest(project: Project) -> None:
    project.check("waves()")
    assert project.run("--texvol-exit-status", "pytest").ret == 1
    project.folder.joinpath("pytest.ini").write_text("[pytest]\ntexvol_exit_status = pytest\n")
    assert project.run().ret == 1
    project.check(BROKEN)
    assert project.run().ret == 1
    project.check("waves()")
    assert project.run("--texvol-update").ret == 0


def test_statuses_of_pytest_itself_stay() -> None:
    for own in (0, 2, 3, 4, 5):
        assert status_of(own, ["new", "broken"], 0) == own
    assert status_of(1, ["new"], 1) == 1


def test_an_unreadable_reference_is_broken_and_can_be_replaced(project: Project) -> None:
    path = project.store(waves())
    path.write_bytes(path.read_bytes()[:200])
    project.check("waves()")
    result = project.run()
    assert result.ret == 11 and "references/waves.exr: cannot be read" in said(result)
    assert project.run("--texvol-update").ret == 0
    np.testing.assert_array_equal(project.stored().pixels, waves())


SOURCES = {
    "grey": "waves()[..., 0]",
    "one channel": "waves()[..., :1]",
    "grey and opacity": "np.ascontiguousarray(waves()[..., [0, 3]])",
    "three channels": "waves()[..., :3]",
    "double": "waves().astype(np.float64)",
    "half": "waves().astype(np.float16)",
    "8 bits": "(255 * waves()).astype(np.uint8)",
    "8 bits, three channels": "(255 * waves()[..., :3]).astype(np.uint8)",
    "16 bits": "(65535 * waves()).astype(np.uint16)",
    "a function": "lambda: waves()",
    "a file": "'picture.exr'",
    "a path": "__import__('pathlib').Path('picture.png')",
    "a function of a path": "lambda: 'picture.png'",
}


def test_whatever_is_a_picture_is_stored_and_found_the_same(project: Project) -> None:
    image.write(project.folder / "picture.exr", waves())
    image.write(project.folder / "picture.png", waves())
    names = {source: source.replace(" ", "-").replace(",", "") for source in SOURCES}
    tests = (
        f"def test_{number}(check_picture):\n    check_picture({SOURCES[source]}, {name!r})\n"
        for number, (source, name) in enumerate(names.items())
    )
    project.write(test_it="\n".join(tests))
    project.run("--texvol-update").assert_outcomes(passed=len(SOURCES))
    project.run().assert_outcomes(passed=len(SOURCES))
    # 0.02 of light is no rounding of any of them.
    for name in names.values():
        stored = project.stored(name)
        channels = {1: [0], 2: [0, 3], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[stored.channels]
        dimmer = np.ascontiguousarray(stored.pixels[..., channels] * 0.98)
        image.write(project.references / f"{name}.exr", dimmer)
    project.run().assert_outcomes(failed=len(SOURCES))


def test_what_is_no_picture_is_said(project: Project) -> None:
    for picture, words in (
        ("object()", "picture must be a"),
        ("np.zeros((2, 2, 7))", "(2, 2, 7)"),
        ("np.zeros((4, 4), int)", "int64"),
        ("waves(), 'x', 3", "positional argument"),
    ):
        project.check(picture)
        result = project.run()
        assert result.ret == 1 and words in said(result)
    project.check("waves()", size=(3, 3))
    assert "options of drawing need a scene" in said(project.run())


def test_references_of_other_formats_are_found_and_two_of_a_name_are_an_error(project: Project) -> None:
    project.references.mkdir()
    image.write(project.references / "waves.png", waves())
    image.write(project.folder / "other.png", waves(1))
    project.check("'references/waves.png'")
    assert project.run().ret == 0
    project.check("'other.png'")
    assert project.run().ret == 1
    assert project.run("--texvol-update").ret == 0
    assert [path.name for path in project.references.iterdir()] == ["waves.png"]
    assert project.run().ret == 0
    # Grey numbers would be rounded in a PNG.
    project.check("waves()[..., 0] / 3")
    assert project.run("--texvol-update").ret == 0
    assert [path.name for path in project.references.iterdir()] == ["waves.exr"]
    np.testing.assert_array_equal(project.stored().pixels[..., 0], waves()[..., 0] / 3)
    image.write(project.references / "waves.png", waves())
    result = project.run()
    assert result.ret == 1 and "waves.exr and waves.png; keep one" in said(result)


def test_runs_that_check_no_picture_are_as_without_the_plugin(project: Project) -> None:
    text = "import sys\n\ndef test_it():\n    print('loaded', *sys.modules)\n    assert 0\n"
    (project.folder / "test_it.py").write_text(text)
    loaded = []
    for options in ([], ["-p", "no:texvol"]):
        result = project.run_apart(*options)
        assert result.ret == 1 and "pictures ==" not in said(result)
        (line,) = (line for line in result.outlines if line.startswith("loaded "))
        loaded.append({name.split(".")[0] for name in line.split()})
    # What a run pays for: modules of the standard library besides, and nothing that takes long to load.
    assert loaded[0] - loaded[1] - sys.stdlib_module_names == {"texvol"}
    assert {path.name for path in project.folder.iterdir()} == {"test_it.py"}


def test_a_failure_elsewhere_in_a_test_is_no_picture(project: Project) -> None:
    project.store(waves())
    project.write(test_it="def test_it(check_picture):\n    check_picture(waves(), 'waves')\n    assert 0\n")
    assert project.run().ret == 1
    project.write(
        test_it="""
def test_new(check_picture):
    check_picture(waves(), "new")

@pytest.fixture
def bad():
    yield
    assert 0

def test_teardown(bad):
    pass
"""
    )
    assert project.run().ret == 1


def test_only_what_failed_runs_again(project: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    project.store(waves(), "good")
    project.write(
        test_it="""
def test_good(check_picture):
    check_picture(waves(), "good")

def test_bad(check_picture):
    check_picture(waves(), "bad")
"""
    )
    monkeypatch.setenv("PYTEST_ADDOPTS", "-p no:hypothesispytest")  # with the cache of what failed
    assert project.run().ret == 10
    result = project.run("--lf", "--texvol-update")
    result.assert_outcomes(passed=1)
    assert project.run("-x").ret == 0 and os.path.exists(project.references / "bad.exr")
