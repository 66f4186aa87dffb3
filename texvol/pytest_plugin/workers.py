"""Processes of pytest-xdist: the workers' parameters, and the state that each process opens."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from texvol.pytest_plugin import options

if TYPE_CHECKING:
    from texvol.pytest_plugin.pending import Pending
    from texvol.pytest_plugin.session import PictureSession

_SHARED = pytest.StashKey[str]()


def told(config: pytest.Config) -> dict[str, Any]:
    """Return the parameters that the controller sends to a worker."""
    folder = options.report_folder(config)
    return {"report": str(folder) if folder else None, "shared": str(shared_folder(config))}


def shared_folder(config: pytest.Config) -> Path:
    """Return the folder that all processes of this run share; it is created when first written to."""
    if _SHARED not in config.stash:
        config.stash[_SHARED] = os.path.join(tempfile.gettempdir(), f"texvol-pictures-{os.urandom(12).hex()}")
    return Path(config.stash[_SHARED])


def pending_of(shared: Path) -> Pending:
    """Return the references to be written at the end of this run."""
    from texvol.pytest_plugin.pending import Pending

    return Pending(shared / "references")


def open_session(config: pytest.Config, factory: pytest.TempPathFactory) -> PictureSession:
    """Return the state that the checks of this process share."""
    from texvol.pytest_plugin.session import PictureSession

    from_controller = getattr(config, "workerinput", {}).get("texvol", {})
    folder, shared = from_controller.get("report"), from_controller.get("shared")
    return PictureSession(
        config,
        factory.getbasetemp() / "pictures-of-texvol",
        Path(folder) if folder else options.report_folder(config),
        Path(shared) if shared else None,
        pending_of(Path(shared) if shared else shared_folder(config)),
    )


def clean(config: pytest.Config) -> None:
    """Remove the folder that workers shared."""
    shared = config.stash.get(_SHARED, None)
    if shared is not None:
        shutil.rmtree(shared, ignore_errors=True)
