"""Options and settings of the plugin, as `pytest --help` shows them, and the folders of a run.

The controller of pytest-xdist sends the folders to its workers, which may have another current folder.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import pytest

_SHARED = pytest.StashKey[Path]()
# Above pytest's own statuses, which end at 5, and below those of shells and signals, which begin at 124.
NEW, BROKEN = 10, 11


def add_options(parser: pytest.Parser) -> None:
    """Add the options and settings to pytest."""
    group = parser.getgroup("texvol", "texvol: pictures")
    group.addoption(
        "--texvol-update", action="store_true",
        help="write the references of pictures that are new or fail, after all tests have run; "
        "not for names that two tests share; not in CI",
    )  # fmt: skip
    group.addoption("--texvol-force-update", action="store_true", help="like --texvol-update, also in CI")
    group.addoption(
        "--texvol-report", metavar="DIR",
        help="write a page of all pictures, worst first (index.html), a page for each, report.json and summary.md",
    )  # fmt: skip
    group.addoption(
        "--texvol-self-test", action="store_true",
        help="plant mistakes in the first scene that is checked, and report the mistakes that the limits find",
    )  # fmt: skip
    group.addoption(
        "--texvol-exit-status", choices=("pictures", "pytest"), default=None,
        help=f"pictures (default): if only pictures failed, {NEW} if all of them are new, {BROKEN} if some "
        "are broken (not finite, of another size, unreadable) and the rest new, and 1 if one is different; "
        "pytest: always pytest's own",
    )  # fmt: skip
    parser.addini("texvol_references", "folder of reference pictures, beside each test file (references)", default="")
    parser.addini(
        "texvol_limits", "file of limits, from pytest's rootdir (limits.toml in each folder of references)", default=""
    )
    parser.addini("texvol_exit_status", "pictures or pytest, see --texvol-exit-status", default="pictures")


def updates(config: pytest.Config) -> bool:
    """True if references of failing pictures are written."""
    return bool(config.option.texvol_update or config.option.texvol_force_update)


def own_exit_status(config: pytest.Config) -> bool:
    """True if the exit status distinguishes new and broken pictures."""
    return str(config.option.texvol_exit_status or config.getini("texvol_exit_status")) == "pictures"


def check(config: pytest.Config) -> None:
    """Raise UsageError if options contradict each other."""
    in_ci = os.environ.get("CI", "").lower() not in ("", "0", "false")
    if in_ci and config.option.texvol_update and not config.option.texvol_force_update:
        raise pytest.UsageError(
            "--texvol-update in CI would make any picture of this machine a reference; "
            "run it locally, look at the pictures and commit them (or --texvol-force-update)"
        )
    given = config.getini("texvol_exit_status")
    if given not in ("pictures", "pytest"):
        raise pytest.UsageError(f"texvol_exit_status must be pictures or pytest, got {given}")
    if config.option.texvol_self_test and not config.option.texvol_report:
        raise pytest.UsageError("--texvol-self-test needs --texvol-report DIR")


def for_worker(config: pytest.Config) -> dict[str, str | None]:
    """Return the folders of the run that the controller sends to a worker."""
    folder = report_folder(config)
    return {"report": str(folder) if folder else None, "shared": str(shared_folder(config))}


def report_folder(config: pytest.Config) -> Path | None:
    """Return the folder of the report as an absolute path, or None."""
    given = _sent(config)["report"] if is_worker(config) else config.option.texvol_report
    return Path(os.path.abspath(config.invocation_params.dir / given)) if given else None


def shared_folder(config: pytest.Config) -> Path:
    """Return the folder that all processes of the run share; it is created when first written to."""
    if is_worker(config):
        return Path(_sent(config)["shared"])
    if _SHARED not in config.stash:
        config.stash[_SHARED] = Path(tempfile.gettempdir(), f"texvol-pictures-{os.urandom(12).hex()}")
    return config.stash[_SHARED]


def remove_shared_folder(config: pytest.Config) -> None:
    """Remove the folder that the processes of the run shared."""
    if _SHARED in config.stash:
        shutil.rmtree(config.stash[_SHARED], ignore_errors=True)


def is_worker(config: pytest.Config) -> bool:
    """True in a worker of pytest-xdist."""
    return hasattr(config, "workerinput")


def _sent(config: Any) -> dict[str, Any]:
    """Return the folders that the controller has sent to this worker."""
    return dict(config.workerinput["texvol"])
