"""Another program draws a scene for `benchmark_beside.py`: the process that it runs in.

    python side_process.py PROGRAM FOLDER

It runs in the environment that `sh scripts/setup.sh "" others` makes, where texvol is not installed, and imports
`side_PROGRAM.py`, whose `Program` draws. FOLDER holds what `Given` reads. Each line of the input asks for one frame,
and is answered by a line with its seconds.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from side_given import Array, Given, Medium


class Program(Protocol):
    """Another program, ready to draw the scene."""

    def classify(self, medium: Medium) -> None:
        """Take another transfer function."""

    def draw(self, family: str, rate: float) -> Array:
        """Return the picture (height, width, 4), linear, premultiplied, top row first."""


def serve(program: Program, media: dict[str, Medium], answer: Callable[[dict[str, Any]], None]) -> None:
    """Draw what is asked for, until the input ends."""
    classified = ""
    for line in sys.stdin:
        asked = json.loads(line)
        if asked["medium"] != classified:
            classified = asked["medium"]
            program.classify(media[classified])
        start, processor_start = time.perf_counter(), time.process_time()
        picture = program.draw(asked["family"], asked["rate"])
        seconds, processor_seconds = time.perf_counter() - start, time.process_time() - processor_start
        np.save(asked["picture"], np.asarray(picture, np.float32))
        answer({"seconds": seconds, "processor_seconds": processor_seconds})


def main(name: str, place: str) -> None:
    """Make the program ready, then serve."""
    # What programs print goes to stderr, and only answers to where they are awaited.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    folder = Path(place)
    told = json.loads((folder / "request.json").read_text())
    program: Program = import_module(f"side_{name}").Program(Given.of(folder, told))

    def answer(found: dict[str, Any]) -> None:
        print(json.dumps(found), file=answers, flush=True)

    answer({"about": getattr(program, "about", "")})
    serve(program, {each: Medium.of(table) for each, table in told["media"].items()}, answer)


if __name__ == "__main__":
    main(*sys.argv[1:])
