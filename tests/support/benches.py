"""Scenes with every mistake planted in them, for the tests of mistakes, limits and explanations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from texvol.comparison.mistakes import CATALOGUE, DoesNotApply, MistakeTrial
from texvol.comparison.planting import PlantedRenderer
from texvol.provenance.stored_scene import StoredScene
from texvol.scene.scene import Scene

SIZE = (48, 40)
CLASSIFICATIONS = ("slab", "extinction", "post", "integrated")
NAMED = (  # that have to be there
    *("dropped slab", "swapped order", "half a texel", "wrong gamma", "straight colour", "linear opacity"),
    *("other axis", "one wrong pixel"),
)


class MistakePictures(Mapping[str, Any]):
    """Picture of each mistake by its name, or the reason why it does not apply; each is drawn when it is looked up."""

    def __init__(self, trial: MistakeTrial) -> None:
        self._trial = trial
        self._mistakes = {each.name: each for each in CATALOGUE}
        self._drawn: dict[str, np.ndarray | str] = {}

    def __getitem__(self, name: str) -> Any:
        mistake = self._mistakes[name]
        if name not in self._drawn:
            try:
                self._drawn[name] = mistake.draw(self._trial)
            except DoesNotApply as reason:
                self._drawn[name] = str(reason)
        return self._drawn[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._mistakes)

    def __len__(self) -> int:
        return len(self._mistakes)


def planted(renderer: PlantedRenderer, scene: Scene, **settings: Any) -> tuple[MistakeTrial, MistakePictures]:
    """A trial of mistakes, and the picture of each mistake by its name."""
    trial = MistakeTrial(renderer, StoredScene(scene, settings), SIZE)
    return trial, MistakePictures(trial)
