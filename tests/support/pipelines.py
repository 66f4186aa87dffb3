"""Random scenes, drawn by polygons and by the compute shader: how far apart are the pictures?

    python scripts/compare_pipelines.py [--count N] [--seed N]

Every scene is drawn whole, and with room for textures of a few bricks only. Numbers count relative to the largest one
of the picture, or 1. Exit status 1 if a scene is farther apart than `SAME`.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from support.odd_scenes.outcomes import differences, size_of
from support.odd_scenes.scenes import OddScene, odd_scene
from support.quick_stats import quick_stats
from texvol.rendering.renderer import Renderer
from texvol.util.errors import TexvolError

SAME = 2e-6
IN_BRICKS = 0.003  # megabytes


def apart(odd: OddScene, by_fragments: Renderer, by_compute: Renderer) -> float | None:
    """Difference of both pictures, relative to the size of their numbers; None if the scene is refused."""
    how: dict[str, Any] = {"sampling_rate": 1.0} | {
        name: each for name, each in odd.options.items() if name != "max_error"
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            one = by_fragments.render(odd.scene, odd.size, **how)
        except TexvolError:
            return None
        other = by_compute.render(odd.scene, odd.size, **how)
    assert quick_stats(by_compute)["pipeline"] == "compute" or not one.any()
    one, other = np.asarray(one), np.asarray(other)
    return float((differences(other, one) / max(size_of(one), 1.0)).max())


def compared(numbers: range, seed: int = 0) -> Iterator[tuple[OddScene, str, float | None]]:
    """Yield scenes, how they are drawn, and their differences."""
    for how, memory in (("whole", None), ("in bricks", IN_BRICKS)):
        with (
            Renderer(texture_memory=memory, pipeline="fragment") as by_fragments,
            Renderer(texture_memory=memory, pipeline="compute") as by_compute,
        ):
            for number in numbers:
                odd = odd_scene(number, seed)
                yield odd, how, apart(odd, by_fragments, by_compute)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, metavar="N", help="number of scenes")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="another seed makes other scenes")
    arguments = parser.parse_args()
    farthest, refused, drawn = 0.0, 0, 0
    far = []
    for odd, how, found in compared(range(arguments.count), arguments.seed):
        if found is None:
            refused += 1
            continue
        drawn, farthest = drawn + 1, max(farthest, found)
        if found > SAME:
            far.append(f"{odd.number} {how}: {found:.3g}: {', '.join(odd.words)}")
    print(*far, sep="\n")
    print(f"{drawn} pictures drawn, {refused} refused; farthest apart {farthest:.3g}, {len(far)} beyond {SAME:g}")
    return int(bool(far))
