"""Place and kind of an open volume changed: another spacing, another transform, values as labels or not.

Samples stay where they are in memory. The source of the new volume says how to read it so, for scene files.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texvol.scene import spaces
from texvol.scene.kinds import as_labels
from texvol.scene.label_counts import label_counts
from texvol.scene.large_volume import LargeVolume
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window.stand_in import StandIn

IDENTITY = np.eye(4)
_OVERVIEWS = ("overview", "whole")  # which lie where the volume was


def turn_of(volume: Volume) -> NDArray[np.float64]:
    """Return the matrix, shape (4, 4), that has turned the volume from its file's world into that of the scene."""
    turn = spaces.turn(volume.own_space, volume.space)
    return np.eye(4) if turn is None else turn


def transform_of(volume: Volume) -> NDArray[np.float64]:
    """Return the matrix that --transform gives: what has moved the volume beside that turn."""
    moved = np.asarray(volume.source.get("transform", np.eye(4)), np.float64)
    return np.asarray(moved @ turn_of(volume).T)  # a turn's inverse is its transpose


def spacing_of(volume: Volume) -> tuple[float, float, float]:
    """Return the distance of samples in the world of the file, before any transform."""
    own = np.linalg.inv(_moved_by(volume))[:3, :3] @ volume.world_from_index
    x, y, z = (float(f"{each:.12g}") for each in np.linalg.norm(own, axis=0))
    return x, y, z


def with_transform(volume: Volume, matrix: ArrayLike) -> Volume:
    """Return the volume with another transform, shape (4, 4).

    Raises
    ------
    InputError
        If the matrix leaves no volume.
    """
    wanted = np.asarray(matrix, np.float64) @ turn_of(volume)
    return _moved(volume, wanted @ np.linalg.inv(_moved_by(volume)), {"transform": wanted.tolist()})


def with_spacing(volume: Volume, spacing: Sequence[float]) -> Volume:
    """Return the volume with another spacing in the world of its file, where its first sample stays.

    Raises
    ------
    InputError
        If the spacing is not positive.
    """
    if not all(np.isfinite(each) and each > 0 for each in spacing):
        raise InputError(f"spacing must be positive along every axis, got {', '.join(f'{each:g}' for each in spacing)}")
    moved = _moved_by(volume)
    back = np.linalg.inv(moved)
    axes = back[:3, :3] @ volume.world_from_index
    origin = back[:3, :3] @ volume.origin + back[:3, 3]
    lengths = np.linalg.norm(axes, axis=0)
    scaled = np.eye(4)
    scaled[:3, :3] = axes @ np.diag(np.array(spacing) / lengths) @ np.linalg.inv(axes)
    scaled[:3, 3] = origin - scaled[:3, :3] @ origin
    return _moved(volume, moved @ scaled @ back, {"spacing": [float(each) for each in spacing]})


def with_labels(volume: Volume, on: bool) -> Volume:
    """Return the volume with its values as labels, or as measured values; slow, for a thread.

    Raises
    ------
    InputError
        If the values can't be labels.
    """
    if on == volume.labels:
        return volume
    if on:
        other = as_labels(volume)
        if isinstance(volume, StandIn):
            assert isinstance(other, StandIn)
            other.large = as_labels(volume.large)  # type: ignore[assignment]
        if not isinstance(other, LargeVolume):
            label_counts(other)
        return other
    return _as_values(volume)


def _as_values(volume: Volume) -> Volume:
    other = copy(volume)
    other.labels = False
    other.source = {name: each for name, each in volume.source.items() if name != "labels"}
    _forget(other)
    if isinstance(volume, StandIn):
        assert isinstance(other, StandIn)
        other.large = _as_values(volume.large)  # type: ignore[assignment]
    return other


def _moved_by(volume: Volume) -> NDArray[np.float64]:
    return np.asarray(volume.source.get("transform", np.eye(4)), np.float64)


def _moved(volume: Volume, matrix: NDArray[np.float64], source: dict[str, Any]) -> Volume:
    """Return the volume moved by a matrix; its source says `source` instead of that."""
    matrix[3] = 0, 0, 0, 1
    other = volume.moved(matrix)
    kept = {**volume.source, **source}
    if np.array_equal(kept.get("transform", np.eye(4)), np.eye(4)):
        kept.pop("transform", None)
    other.source = kept if volume.source else {}
    _forget(other)
    if isinstance(other, StandIn) and isinstance(volume, StandIn):
        other.large = _moved(volume.large, matrix, source)  # type: ignore[assignment]
    return other


def _forget(volume: Volume) -> None:
    for name in _OVERVIEWS:
        volume.__dict__.pop(name, None)
