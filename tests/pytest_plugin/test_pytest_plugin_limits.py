"""The file of limits: reasons, drivers, names; and which limits a pair is held to."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.picture_project import Project, said, spots, waves

from texvol.comparison.limits import ONE_DRIVER, TWO_DRIVERS
from texvol.pytest_plugin.tables import Tables
from texvol.util.errors import InputError

pytest_plugins = ("pytester", "support.picture_project")

REASON = 'reason = "outlines are a medium of rounding"'


def tables(folder: Path, text: str) -> Tables:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return Tables.read(path)


def test_without_a_table_the_defaults_hold(tmp_path: Path) -> None:
    for rules in (
        Tables.read(tmp_path / "limits.toml").rules_for("x"),
        tables(tmp_path, "[y]\nrms = 0").rules_for("x"),
    ):
        assert rules.limits(None, None) == rules.limits("a", "a") == rules.limits("a", None) == ONE_DRIVER
        assert rules.limits("a", "b") == TWO_DRIVERS


def test_a_picture_s_own_table_wins_over_the_default_one(tmp_path: Path) -> None:
    found = (
        tables(tmp_path, '[default]\nrms = 1e-5\nmax-abs = 1e-4\n["a/x"]\nrms = 1e-6').rules_for("a/x").limits("d", "d")
    )
    assert (found.rms, found.max_abs, found.flip) == (1e-6, 1e-4, ONE_DRIVER.flip)


@pytest.mark.parametrize("key", ["max-abs", "fail-percent", "rms", "flip"])
@pytest.mark.parametrize("reason", ["", 'reason = ""', 'reason = "flaky"', 'reason = "TODO: 1 2 3"', "reason = 3"])
def test_each_loosening_needs_a_reason(tmp_path: Path, key: str, reason: str) -> None:
    looser = getattr(ONE_DRIVER, key.replace("-", "_")) * 1.001 + 1e-9
    with pytest.raises(InputError, match=rf"\[x\] allows more than the defaults \({key}\) without a reason"):
        tables(tmp_path, f"[x]\n{key} = {looser}\n{reason}").rules_for("x")
    limits = tables(tmp_path, f"[x]\n{key} = {looser}\n{REASON}").rules_for("x").limits("d", "d")
    assert limits.looser_than(ONE_DRIVER) == (key,)


def test_what_is_tighter_needs_none(tmp_path: Path) -> None:
    text = "[x]\nmax-abs = 1e-3\nrms = 1e-5\nhard-max = 0.5\noutlier = 0.1"
    assert tables(tmp_path, text).rules_for("x").limits("d", "d").hard_max == 0.5


def test_a_reason_of_all_pictures_is_none_for_more_than_they_have(tmp_path: Path) -> None:
    start = f"[default]\nrms = 0.01\n{REASON}\n"
    assert tables(tmp_path, start + "[x]\nrms = 0.005").rules_for("x").limits("d", "d").rms == 0.005
    with pytest.raises(InputError, match="without a reason"):
        tables(tmp_path, start + "[x]\nrms = 0.02").rules_for("x")
    with pytest.raises(InputError, match="without a reason"):
        tables(tmp_path, "[default]\nrms = 0.01\n").rules_for("x")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[x]\nrsm = 1e-5", "key 'rsm' not found; the keys are max-abs"),
        ("[x]\nmax_abs = 1e-5", "key 'max_abs' not found"),
        ("[x]\nrms = '1'", "rms must be a number"),
        ("[x]\nrms = nan", "rms must be a number"),
        ("[x]\nrms = -1", "rms must be a number"),
        ("[x]\nrms = inf", "without a reason"),
        ("[x]\nfail-percent = 101", "at most 100"),
        ("[x.front]\nrms = 1e-5", "quote names"),
        ("rms = 1e-5", "rms must be in a table"),
        ("[x]\ndrivers = 'llvmpipe'", 'drivers must be "any" or a list'),
        ("[x]\ndrivers = []", 'drivers must be "any" or a list'),
        ("[x]\ndrivers = ['']", 'drivers must be "any" or a list'),
        ("[x", "is not TOML"),
    ],
)
def test_what_a_file_of_limits_cannot_say_is_an_error(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        tables(tmp_path, text).rules_for("x")
    assert words in str(caught.value) and str(tmp_path / "limits.toml") in str(caught.value)
    assert "\n" not in str(caught.value)


TABLE = f"[x]\nmax-abs = 0.01\n{REASON}\n"


@pytest.mark.parametrize(
    ("drivers", "driver", "reference", "covered"),
    [
        ("", "llvmpipe 15", "llvmpipe 15", True),
        ("", None, None, True),
        ("", "NVIDIA", "llvmpipe 15", False),
        ("", "llvmpipe 17", "llvmpipe 15", False),
        ("", None, "llvmpipe 15", False),
        ("", "llvmpipe 15", None, False),
        ('drivers = "any"', "NVIDIA", "llvmpipe 15", True),
        ('drivers = "any"', None, "llvmpipe 15", True),
        ('drivers = ["llvmpipe", "nvidia"]', "NVIDIA H200", "AMD", True),
        ('drivers = ["llvmpipe"]', "NVIDIA H200", "llvmpipe", False),
        ('drivers = ["llvmpipe"]', "AMD", "AMD", True),
    ],
)
def test_own_limits_hold_for_the_reference_s_driver_and_those_that_are_named(
    tmp_path: Path, drivers: str, driver: str | None, reference: str | None, covered: bool
) -> None:
    rules = tables(tmp_path, TABLE + drivers).rules_for("x")
    if covered:
        limits = rules.limits(driver, reference)
        assert limits.max_abs == 0.01
        assert limits.rms == (TWO_DRIVERS if driver and reference and driver != reference else ONE_DRIVER).rms
    else:
        with pytest.raises(InputError, match="the limits of .x. in limits.toml hold for the former"):
            rules.limits(driver, reference)


def test_a_stored_picture_fails_on_a_driver_that_no_bound_covers(project: Project) -> None:
    project.store(waves(), texvol__renderer="llvmpipe 15")
    project.limits(f"[waves]\nmax-abs = 0.01\n{REASON}\n")
    project.check("waves()", driver="NVIDIA")
    result = project.run()
    result.assert_outcomes(failed=1)
    assert result.ret == 1
    assert "the reference was drawn by llvmpipe 15, the picture by NVIDIA" in said(result)
    project.limits(f'[waves]\nmax-abs = 0.01\n{REASON}\ndrivers = ["nvidia"]\n')
    assert project.run().ret == 0
    project.limits(f"[waves]\nmax-abs = 0.01\n{REASON}\n")
    assert project.run("--texvol-update").ret == 0
    assert project.stored().attributes["texvol:renderer"] == "NVIDIA" and project.run().ret == 0


def test_two_drivers_are_held_to_the_limits_of_two_and_one_to_those_of_one(project: Project) -> None:
    project.store(waves(), texvol__renderer="llvmpipe 15")
    project.check("spots()", driver="NVIDIA")
    assert project.run().ret == 0
    project.check("spots()", driver="llvmpipe 15")
    assert project.run().ret == 1


def test_limits_that_are_refused_stop_an_update_too(project: Project) -> None:
    project.limits("[waves]\nrms = 1.0\n")
    project.check("waves()")
    result = project.run("--texvol-update")
    assert result.ret == 1 and "without a reason" in said(result)
    assert not (project.references / "waves.exr").exists()


def test_one_file_may_serve_all_folders(project: Project) -> None:
    project.folder.joinpath("pytest.ini").write_text("[pytest]\ntexvol_limits = all.toml\n")
    (project.folder / "all.toml").write_text(f"[waves]\nmax-abs = 1.0\nrms = 1.0\nflip = 1.0\n{REASON}\n")
    test = "def test_it(check_picture):\n    check_picture(waves({}), 'waves')\n"
    project.write(tests__a__test_a=test.format(0), tests__b__test_b=test.format(0))
    assert project.run("--texvol-update").ret == 0
    project.write(tests__a__test_a=test.format(1), tests__b__test_b=test.format(2))
    assert project.run().ret == 0
    (project.folder / "all.toml").unlink()
    project.run().assert_outcomes(failed=2)


def test_a_limit_that_is_given_is_the_one_that_holds(project: Project) -> None:
    project.store(waves())
    project.check("spots()")
    assert project.run().ret == 1
    project.limits(f"[waves]\nmax-abs = 0.051\nrms = 0.004\n{REASON}")
    assert project.run().ret == 0
    project.limits(f"[waves]\nmax-abs = 0.049\nrms = 0.004\n{REASON}")
    assert "(max-abs, fail-percent)" in said(project.run())


def test_tables_of_no_picture_are_named_when_all_tests_ran(project: Project) -> None:
    project.store(waves())
    project.store(waves(), "skipped")
    project.limits("[waves]\nrms = 1e-5\n[skipped]\nrms = 1e-5\n[gone]\nrms = 1e-5\n")
    project.check("waves()")
    words = "[gone]: the picture no longer exists"
    result = project.run()
    assert result.ret == 0 and words in said(result)
    assert said(result).count("no longer exists") == 1
    assert words in said(project.run(project.folder))
    for narrower in (("-k", "it"), ("test_it.py::test_it",), ("test_it.py",)):
        assert words not in said(project.run(*narrower))


def test_the_candidate_file_says_its_own_driver(project: Project) -> None:
    project.store(waves(), texvol__renderer="llvmpipe 15")
    path = project.store(spots(), "other", texvol__renderer="NVIDIA")
    path.rename(project.folder / "other.exr")
    project.check("'other.exr'")
    assert project.run().ret == 0
    project.check("'other.exr'", driver="llvmpipe 15")
    assert project.run().ret == 1
