"""Shadow error: how far a picture is from one in exact shadows, and the number of nodes for a maximum of it.

The light transmittance T of `texvol.scene.lighting` is found at the nodes of the box and trilinear between them, in
pictures of any slabs. Let I(n) be the picture with n nodes along the longest edge of the box, and S its limit. The
error of I(n) is at least of order p = 1 in the distance of the nodes, 2 where T is smooth, so that

    max |I(n) - S| <= max |I(n) - I(2n)| / (1 - 2^-p)

as in `error_control`. Both are small pictures. Where 2n nodes are too many, I(n/2) takes their place, which is twice as
far from I(n):

    max |I(n) - S| <= max |I(n/2) - I(n)| / (2^p - 1)
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from texvol.rendering.error_control import ORDER, SAFETY, DrawScene, Size, largest_difference, smaller
from texvol.rendering.settings import Settings
from texvol.scene.lighting import SHADOW_NODES, casts_shadows, checked_shadow_nodes
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.errors import AccuracyWarning, InputError, NoRoomError
from texvol.util.upward import upward

AUTO = "auto"
LIMIT = 1 / 64  # of the error by nodes, if no error is asked for: that of the default rate, see `default_rate`
_PART = 1 / 2  # of a maximum error, for the nodes
_MOST_CHOSEN = 256  # nodes that are taken unasked: these take seconds
_RATE = 2.0  # slabs per smallest spacing of pictures that are compared before the slabs are chosen


class Nodes(NamedTuple):
    """Number of nodes, their estimated error if it was needed, and what they leave of a maximum error."""

    number: int
    error: float | None
    left: float | None


class ShadowError:
    """Estimator of the error by nodes in pictures of one scene and one size."""

    def __init__(self, draw: DrawScene, scene: CompleteScene, size: Size, settings: Settings) -> None:
        self._draw, self._scene, self._size, self._settings = draw, scene, size, settings
        self._pictures: dict[int, NDArray[np.float32]] = {}

    def at(self, nodes: int) -> float:
        """Return the estimate for a number of nodes; 0 if nothing casts shadows."""
        return error_of_nodes(self._drawn, nodes) if in_shadow(self._scene) else 0.0

    def _drawn(self, nodes: int) -> NDArray[np.float32]:
        if nodes not in self._pictures:
            self._pictures[nodes] = self._draw(self._scene, self._size, replace(self._settings, shadow_nodes=nodes))
        return self._pictures[nodes]


def error_of_nodes(draw: Callable[[int], NDArray[np.float32]], nodes: int) -> float:
    """Estimate the error of a picture by its nodes; `draw` draws it with any number of nodes."""
    if 2 * nodes <= _MOST_CHOSEN:
        try:
            return SAFETY * largest_difference(draw(nodes), draw(2 * nodes)) / (1 - 2.0**-ORDER)
        except NoRoomError:
            pass
    return SAFETY * largest_difference(draw(nodes // 2), draw(nodes)) / (2.0**ORDER - 1)


def in_shadow(scene: Scene) -> bool:
    """True if shadows show in the pictures of a scene."""
    return scene.mode == "composite" and casts_shadows(scene.lighting)


def checked_asked(shadow_nodes: int | str | None) -> int | str | None:
    """Return the argument of `Renderer.render` if it is a number of nodes, "auto" or None."""
    if shadow_nodes is None or shadow_nodes == AUTO:
        return shadow_nodes
    if isinstance(shadow_nodes, str):
        raise InputError(f"shadow nodes must be a number or auto, got {shadow_nodes!r}")
    return checked_shadow_nodes(shadow_nodes)


def nodes_for_error(
    draw_exactly: DrawScene,
    scene: CompleteScene,
    size: Size,
    settings: Settings,
    asked: int | str | None,
    max_error: float | None,
) -> Nodes:
    """Choose the number of nodes by small pictures, unless it is known.

    Parameters
    ----------
    asked : int, "auto" or None
        Nodes. "auto" doubles the usual number until their estimated error is at most half of the maximum error, or
        1/64 without one. None is auto with a maximum error, and else the usual number.

    Warns
    -----
    AccuracyWarning
        If the nodes alone are off by more than the maximum error; all of this is then left for the slabs.
    """
    if asked is None and max_error is not None:
        asked = AUTO
    nodes = SHADOW_NODES if asked is None or asked == AUTO else int(asked)
    if not in_shadow(scene) or (max_error is None and asked != AUTO):
        return Nodes(nodes, None, max_error)
    settings = replace(settings, slab_thickness=scene.smallest_spacing / _RATE)
    of_nodes = ShadowError(draw_exactly, scene, smaller(size), settings)
    limit = LIMIT if max_error is None else _PART * max_error
    error = of_nodes.at(nodes)
    while asked == AUTO and error > limit and 2 * nodes <= _MOST_CHOSEN:
        try:
            finer = of_nodes.at(2 * nodes)
        except NoRoomError:
            break
        nodes, error = 2 * nodes, finer
    if max_error is None:
        return Nodes(nodes, None, None)
    if error < max_error:
        return Nodes(nodes, error, max_error - error)
    warnings.warn(
        f"requested error of {max_error:g} not reached: shadows at {nodes} nodes are off by {upward(error)} by "
        "estimate; more nodes by --shadow-nodes leave less",
        AccuracyWarning,
        stacklevel=4,
    )
    return Nodes(nodes, error, max_error)
