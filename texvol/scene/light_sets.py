"""Sets of lights by name, placed by a camera: "three-point" and "studio".

Directions are those of the picture: to its right, upwards, and to the eye. The lights stay where they are in the world
when the camera moves on. The exposure of each set keeps highlights: a straight colour of 1 is lit to 1 at most,
whatever its normal and its gradient confidence.

- three-point: a warm key light from the left above, a cool and weak fill light from the right, and a rim light from
  behind, which parts the subject from the background.
- studio: two large soft lights at the front, one from above and one from behind: even light, with little shadow.

Both light one side of surfaces, that of lower values. From two sides, what faces away from a light would be as bright
as what faces it, and the light from the side would show less of the shape.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from texvol.scene.camera import Camera
from texvol.scene.lighting import Light, Lighting, Triple
from texvol.util.suggestions import check_one_of


class _Placed(NamedTuple):
    """Light of a set: direction to it in the picture's frame, and linear colour."""

    direction: Triple
    color: Triple


_WARM, _COOL = (1.0, 0.95, 0.88), (0.86, 0.93, 1.0)


def _colored(color: Triple, strength: float) -> Triple:
    return color[0] * strength, color[1] * strength, color[2] * strength


_SETS: dict[str, tuple[tuple[_Placed, ...], Lighting]] = {
    "three-point": (
        (
            _Placed((-0.6, 0.65, 0.8), _WARM),
            _Placed((0.85, -0.05, 0.6), _colored(_COOL, 0.3)),
            _Placed((0.5, 0.55, -0.7), (0.5, 0.5, 0.5)),
        ),
        Lighting((), ambient=0.12, diffuse=0.49, specular=0.25, shininess=24.0, two_sided=False),
    ),
    "studio": (
        (
            _Placed((-0.65, 0.45, 0.9), _colored(_WARM, 0.8)),
            _Placed((0.75, 0.25, 0.85), _colored(_COOL, 0.55)),
            _Placed((0.0, 1.0, 0.1), (0.3, 0.3, 0.3)),
            _Placed((-0.3, 0.35, -0.9), (0.25, 0.25, 0.25)),
        ),
        Lighting((), ambient=0.2, diffuse=0.42, specular=0.22, shininess=40.0, two_sided=False),
    ),
}
LIGHT_SETS = tuple(_SETS)


def light_set(name: str, camera: Camera) -> Lighting:
    """Return the lights of a set as they stand about a camera, with their exposure.

    Raises
    ------
    InputError
        If there is no set of that name.
    """
    check_one_of("light: set", name, LIGHT_SETS)
    placed, exposure = _SETS[name]
    frame = np.stack([camera.right, camera.upward, -camera.forward], axis=1)
    lights = []
    for each in placed:
        x, y, z = frame @ (np.array(each.direction) / np.linalg.norm(each.direction))
        lights.append(Light("directional", (float(x), float(y), float(z)), each.color))
    return replace(exposure, lights=tuple(lights))
