"""Judge the estimate, `--check 256` and `--check all` on random scenes; prints a table in Markdown.

    python scripts/judge_estimates.py [--count N] [--data FOLDER] [-o FILE.jsonl]

Each kind, that is classification, lit or unlit, or mode, gets a scene in turn: noise or a crop of a real volume, with
random transfer function, camera and slabs (`error_control`). The yardstick is `--check all`, every pixel by the oracle.
The estimate said the truth if no pixel is farther off. The check of 256 said the truth if no more pixels than it allows
are farther off than the farthest that it found. Costs are processor seconds. FILE has a line for each scene; those that
it has are not drawn again, and an interrupted campaign goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from support.error_control import FILES, random_scene
from texvol import load
from texvol.ray_casting import raycast
from texvol.rendering.checking import chosen_pixels, errors_of, fraction_at_most
from texvol.rendering.renderer import Renderer
from texvol.scene.lighting import Light, Lighting
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.volume import Volume

SIZE = (128, 128)
PIXELS = 256
MODES = ("xray", "average", "mip", "minip", "isosurface")
KINDS = (*CLASSIFICATIONS, *(f"{each}, lit" for each in CLASSIFICATIONS), *MODES)
RATES = (0.5, 1.0, 2.0, 4.0)
EXACT = 1e-6  # of the picture's numbers: rounding to float32, which no estimate counts


def scene_of(number: int, volumes: list[Volume]) -> tuple[str, Scene, float]:
    """Return kind, scene and sampling rate of a number; the same for all runs with the same volumes."""
    random, kind = np.random.default_rng([number, 24]), KINDS[number % len(KINDS)]
    scene, rate = random_scene(random, volumes), float(random.choice(RATES))
    if kind in MODES:
        low, high = scene.volume.finite_range or (0.0, 1.0)
        level = low + (high - low) * random.uniform(0.3, 0.7) if kind == "isosurface" else None
        return kind, replace(scene, mode=kind, isovalue=level, classification="post"), rate  # type: ignore[arg-type]
    classification, _, lit = kind.partition(", ")
    lighting = None
    if lit:
        vector = None if random.random() < 0.5 else tuple(random.standard_normal(3))
        lighting = Lighting(lights=(Light("head") if vector is None else Light("directional", vector),))
    return kind, replace(scene, classification=classification, lighting=lighting), rate  # type: ignore[arg-type]


def outcome(number: int, volumes: list[Volume], renderer: Renderer) -> dict[str, Any]:
    """Return what each way says of a scene, what is true, and what each cost."""
    kind, scene, rate = scene_of(number, volumes)
    warmed = scene.completed(SIZE)
    raycast(warmed, (2, 2))  # compiles
    renderer.render(scene, SIZE, sampling_rate=rate)
    start = time.process_time()
    picture = renderer.render(scene, SIZE, sampling_rate=rate)
    drawn = time.process_time()
    estimate = renderer.stats["estimated_error"]
    estimated = time.process_time()
    truth = raycast(warmed, SIZE)
    traced = time.process_time()
    errors = errors_of(np.asarray(picture).reshape(-1, 4), truth.reshape(-1, 4)).reshape(SIZE[::-1])
    columns, rows = chosen_pixels(SIZE, PIXELS, seed=number).T
    largest = float(errors[rows, columns].max())
    return {
        "number": number,
        "kind": kind,
        "rate": rate,
        "scale": max(1.0, float(np.abs(truth[np.isfinite(truth)]).max(initial=0.0))),
        "error": float(errors.max()),
        "estimate": estimate,
        "largest": largest,
        "beyond": float((errors > largest).mean()),
        "at_most": min(fraction_at_most(0, PIXELS), 1.0),
        "seconds": [drawn - start, estimated - drawn, (traced - estimated) * PIXELS / errors.size, traced - estimated],
    }


def row(name: str, found: Sequence[dict[str, Any]]) -> str:
    """Return a line of the table: how often the truth was said, how tight, at what cost."""
    known = [each for each in found if each["estimate"] is not None]
    kept = [each for each in known if each["error"] <= each["estimate"] + EXACT * each["scale"]]
    tight = [each["estimate"] / each["error"] for each in known if each["error"] > EXACT * each["scale"]]
    checked = [each["beyond"] <= each["at_most"] for each in found]
    part = [each["largest"] / each["error"] for each in found if each["error"] > EXACT * each["scale"]]
    costs = np.array([each["seconds"] for each in found])
    ratio = np.median(costs[:, 1:] / np.maximum(costs[:, :1], 1e-3), axis=0)
    cells = [
        *(name, str(len(found)), f"{len(kept)}/{len(known)}", _median(tight), f"{ratio[0]:.1f}"),
        *(f"{sum(checked)}/{len(found)}", _median(part), f"{ratio[1]:.1f}", f"{ratio[2]:.0f}"),
    ]
    return f"| {' | '.join(cells)} |"


def _median(numbers: list[float]) -> str:
    return f"{np.median(numbers):.2f}" if numbers else "–"


def table(outcomes: Sequence[dict[str, Any]]) -> str:
    """Return the outcomes by kind as a table in Markdown."""
    lines = [
        "| kind | scenes | estimate true | estimate / error | cost | `--check 256` true | found / error | cost | "
        "`--check all`: cost |",
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for kind in KINDS:
        found = [each for each in outcomes if each["kind"] == kind]
        lines += [row(f"`{kind}`" if ", " not in kind else f"`{kind.split(', ')[0]}`, lit", found)] if found else []
    return "\n".join([*lines, row("all", outcomes)]) if outcomes else "\n".join(lines)


def main() -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1300, metavar="N", help="number of scenes (1300)")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="with real volumes, of which scenes have crops")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.jsonl", help="where outcomes are kept")
    arguments = parser.parse_args()
    paths = [arguments.data / file for file in FILES] if arguments.data else []
    volumes = [load(path) for path in paths if path.exists()]
    outcomes: dict[int, dict[str, Any]] = {}
    if arguments.output and arguments.output.exists():
        lines = arguments.output.read_text(encoding="utf-8").splitlines()
        outcomes = {found["number"]: found for found in map(json.loads, lines)}
    with Renderer() as renderer, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in range(arguments.count):
            if number in outcomes:
                continue
            outcomes[number] = found = outcome(number, volumes, renderer)
            if arguments.output:
                with arguments.output.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(found) + "\n")
    found_all = [outcomes[number] for number in sorted(outcomes)]
    print(f"{len(found_all)} scenes, {len(volumes)} real volumes\n\n{table(found_all)}")
    return 0
