"""Compile the oracle's kernels into their cache, each once and several at a time: `compile_oracle.py`.

Processes that use the oracle at the same time, as those of pytest-xdist do, would otherwise compile each kernel once
each, and keep the compiler's memory, some 400 MB for a kernel.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from texvol import AddedVolume, Lighting, Scene, TransferFunction, Volume, raycast
from texvol.geometry import Lines, Mesh

REPOSITORY = Path(__file__).parents[1]
SIZE = (2, 2)
CORNERS = np.array([[0.0, 0, 1], [2, 0, 1], [0, 2, 1]])


def scene() -> Scene:
    """A scene of a small volume."""
    values = np.arange(27, dtype=np.float32).reshape(3, 3, 3)
    return Scene(Volume(values), TransferFunction([0, 27], [(1, 1, 1)] * 2, [0, 1]), classification="slab")


def compile_several() -> None:
    """Several volumes, with and without light."""
    raycast(replace(scene(), added=(AddedVolume(scene().volume),)), SIZE)


def compile_lit() -> None:
    """One volume with light."""
    raycast(replace(scene(), lighting=Lighting()), SIZE)


def compile_plain() -> None:
    """One volume without light, numbers instead of colours, and surfaces in a scene."""
    raycast(scene(), SIZE)
    raycast(replace(scene(), mode="mip"), SIZE)
    surfaces = Mesh(CORNERS, [(0, 1, 2)]), Lines(CORNERS, [range(3)])
    raycast(replace(scene(), geometry=surfaces), SIZE)


FAMILIES = {"several": compile_several, "lit": compile_lit, "plain": compile_plain}


def main(arguments: list[str]) -> int:
    """Compile the families of kernels that are named, or all of them, each in a process of its own."""
    if arguments:
        for name in arguments:
            FAMILIES[name]()
        return 0
    children = [subprocess.Popen([sys.executable, __file__, name], cwd=REPOSITORY) for name in FAMILIES]
    return max(child.wait() for child in children)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
