"""Where the real volumes are: the folder that TEXVOL_DATA names, or shared/data beside the repository."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from texvol.scene.volume import Volume

DATA = Path(os.environ.get("TEXVOL_DATA") or Path(__file__).resolve().parents[2] / ".." / "shared" / "data").resolve()


def real_volume(name: str) -> Path:
    """Path of a file or folder of the real volumes.

    Where it is absent the test that asks is skipped, except in CI (the environment names CI), where that is a failure:
    a test that never runs proves nothing.
    """
    path = DATA / name
    if path.exists():
        return path
    reason = f"{path} is not there; TEXVOL_DATA names the folder of real volumes"
    if os.environ.get("CI"):
        pytest.fail(reason)
    pytest.skip(reason)


def every_other_sample(volume: Volume) -> Volume:
    """The volume with half as many samples along each axis, an eighth of the work."""
    return Volume(volume.values[::2, ::2, ::2], 2 * volume.spacing, volume.origin, volume.direction, name=volume.name)
