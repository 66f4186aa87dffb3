"""Scenes with every mistake planted in them, for the tests of mistakes, limits and explanations."""

from __future__ import annotations

from typing import Any

import numpy as np

from texvol.comparison.mistakes import MistakeTrial, drawn
from texvol.comparison.planting import PlantedRenderer
from texvol.provenance.stored_scene import StoredScene
from texvol.scene.scene import Scene

SIZE = (48, 40)
CLASSIFICATIONS = ("slab", "extinction", "post", "integrated")
NAMED = (  # that have to be there
    *("dropped slab", "swapped order", "half a texel", "wrong gamma", "straight colour", "linear opacity"),
    *("other axis", "one wrong pixel"),
)


def planted(
    renderer: PlantedRenderer, scene: Scene, **settings: Any
) -> tuple[MistakeTrial, dict[str, np.ndarray | str]]:
    """A bench, and the picture of each mistake by its name."""
    bench = MistakeTrial(renderer, StoredScene(scene, settings), SIZE)
    return bench, {mistake.name: picture for mistake, picture in drawn(bench)}
