"""What `pytest --help` shows of the plugin: options and settings, and what they mean."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

# Beyond pytest's own statuses, which go up to 5, and far from those of shells and signals, which begin at 124.
NEW, BROKEN = 10, 11


def add_options(parser: pytest.Parser) -> None:
    """Tell pytest of them."""
    group = parser.getgroup("texvol", "texvol: pictures")
    group.addoption(
        "--texvol-update", action="store_true",
        help="write the references of pictures that are new or fail, and no others, once all tests have run; "
        "nothing for a name that two tests share; not where CI is set",
    )  # fmt: skip
    group.addoption("--texvol-force-update", action="store_true", help="the same, even where CI is set")
    group.addoption(
        "--texvol-report", metavar="DIR",
        help="write a page of all pictures, worst first (index.html), a page for each, report.json and summary.md",
    )  # fmt: skip
    group.addoption(
        "--texvol-self-test", action="store_true",
        help="plant mistakes in the first scene that is checked, and show in the report which of them the limits catch",
    )  # fmt: skip
    group.addoption(
        "--texvol-exit-status", choices=("pictures", "pytest"), default=None,
        help=f"pictures (default): where nothing but pictures failed, {NEW} if all of these are new, {BROKEN} if some "
        "are broken (not finite, of another size, unreadable) and the others new, and 1 if one is different; "
        "pytest: always pytest's own",
    )  # fmt: skip
    parser.addini("texvol_references", "folder of reference pictures, beside each test file (references)", default="")
    parser.addini(
        "texvol_limits", "file of limits, from pytest's rootdir (limits.toml in each folder of references)", default=""
    )
    parser.addini("texvol_exit_status", "pictures or pytest, see --texvol-exit-status", default="pictures")


def updates(config: pytest.Config) -> bool:
    """Whether failing pictures are written anew."""
    return bool(config.option.texvol_update or config.option.texvol_force_update)


def own_exit_status(config: pytest.Config) -> bool:
    """Whether the run's status tells new and broken pictures apart."""
    return str(config.option.texvol_exit_status or config.getini("texvol_exit_status")) == "pictures"


def check(config: pytest.Config) -> None:
    """Raise UsageError where the options don't go together."""
    import pytest

    if config.option.texvol_update and not config.option.texvol_force_update and _in_ci():
        raise pytest.UsageError(
            "--texvol-update where CI is set would make whatever this machine draws the reference: "
            "run it at home, look at the pictures and commit them (or --texvol-force-update)"
        )
    if config.getini("texvol_exit_status") not in ("pictures", "pytest"):
        raise pytest.UsageError(f"texvol_exit_status is pictures or pytest, not {config.getini('texvol_exit_status')}")
    if config.option.texvol_self_test and not config.option.texvol_report:
        raise pytest.UsageError("--texvol-self-test is a part of the report: give --texvol-report DIR as well")


def report_folder(config: pytest.Config) -> Path | None:
    """The folder of the report, absolute: workers may have another current folder."""
    given = config.option.texvol_report
    return Path(os.path.abspath(config.invocation_params.dir / given)) if given else None


def _in_ci() -> bool:
    return os.environ.get("CI", "").lower() not in ("", "0", "false")
