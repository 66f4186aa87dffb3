"""Colours are texts wherever Python takes a colour."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from texvol import Light, Lighting, Scene, TransferFunction, Volume
from texvol.geometry import Lines, Mesh
from texvol.scene.isosurfaces import Isosurface
from texvol.scene.lighting import DepthCue
from texvol.util.errors import InputError

VOLUME = Volume(np.arange(8.0).reshape(2, 2, 2))
CORNERS = np.eye(3)
MAKERS: dict[str, Any] = {
    "background": lambda color: Scene(VOLUME, background=color).background,
    "replaced background": lambda color: Scene(VOLUME).replace(background=color).background,
    "light": lambda color: Light(color=color).color,
    "depth cue": lambda color: DepthCue(color=color).color,
    "isosurface": lambda color: Isosurface(1.0, color).color,
    "mesh": lambda color: Mesh(CORNERS, [(0, 1, 2)], color).color,
    "lines": lambda color: Lines(CORNERS, [(0, 1)], color).color,
    "function": lambda color: tuple(TransferFunction([0, 1], [(0, 1, 0), color], [0, 1]).colors[1].tolist()),
    "material": lambda color: TransferFunction(
        [0], [(0, 1, 0)], [1], materials=["a"], material_colors=[color]
    ).material_colors[0],
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_color_is_a_name_a_code_or_numbers(make: Any) -> None:
    assert make("red") == make("#ff0000") == make("#F00") == make((1.0, 0.0, 0.0)) == (1.0, 0.0, 0.0)
    assert make("#808080") == pytest.approx((0.2158605,) * 3, abs=1e-6), "linear light"
    with pytest.raises(InputError, match="must be three numbers of at least 0, #RRGGBB or a name such as white"):
        make("reddish")


def test_lights_of_a_scene_keep_their_colors() -> None:
    assert Lighting(lights=(Light(color="white"),)).lights[0].color == (1.0, 1.0, 1.0)
