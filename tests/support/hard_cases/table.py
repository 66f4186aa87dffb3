"""Draws every hard case and holds it against the oracle and its bound: a Markdown table, hard_cases.csv and .html.

    python scripts/hard_cases.py [-o DIR]

Exit status 1 if any picture is over its bound.
"""

from __future__ import annotations

import argparse
import csv
import html
import io
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from support.hard_cases.bounds import Drawing
from support.hard_cases.cases import HardCase, hard_cases
from texvol.comparison import compare
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.scene import Scene
from texvol.slicing.slabs import SLICINGS, Slicing, slab_stacks
from texvol.util.errors import InputError

TIGHT = 10  # a bound more than this above what is measured says little, unless it says why
COLUMNS = ("case", "seconds", "max_error", "rms_error", "bound", "bound / max", "verdict", "bound from")


@dataclass(frozen=True)
class Outcome:
    """Result of a case."""

    case: HardCase
    seconds: float  # of a warm draw and its reading back
    max_error: float
    rms_error: float
    bound: float

    @property
    def over(self) -> bool:
        """Whether the error is over the bound; not a number is."""
        return not self.max_error <= self.bound

    @property
    def loose(self) -> bool:
        """Whether the bound is far above the error, and nobody says why."""
        return not self.case.slack and self.bound > TIGHT * self.max_error and self.bound > 0

    @property
    def verdict(self) -> str:
        if self.over:
            return "over"
        return "loose" if self.loose else "within"

    @property
    def row(self) -> tuple[str, ...]:
        ratio = f"{self.bound / self.max_error:.1f}" if self.max_error > 0 else "-"
        why = "; but ".join(filter(None, (self.case.why, self.case.slack)))
        errors = (f"{number:.2e}" for number in (self.max_error, self.rms_error, self.bound))
        return (self.case.name, f"{self.seconds:.4f}", *errors, ratio, self.verdict, why)


def run(case: HardCase, renderer: Renderer, times: int = 2, slicing: Slicing = "stacks") -> Outcome:
    """The case drawn so many times, the last time timed, and compared."""
    case = replace(case, options=case.options | {"slicing": slicing})
    picture, truth, seconds = _pair(case, case.scene, renderer, times)
    slabs = slab_stacks(
        case.scene.volume, case.scene.completed(case.size).camera, case.slab_thickness, case.size
    ).slab_count
    bound = case.bound(Drawing(case.scene, case.size, case.slab_thickness, slabs, truth, slicing))
    if case.turned:
        turned, turned_truth, _ = _pair(case, case.turned, renderer, times)
        picture, truth = turned - picture, turned_truth - truth
    difference = compare(picture, truth)
    return Outcome(case, seconds, difference.max_error, difference.rms_error, bound)


def _pair(case: HardCase, scene: Scene, renderer: Renderer, times: int) -> tuple[np.ndarray, np.ndarray, float]:
    for _ in range(times):
        start = time.perf_counter()
        picture = renderer.render(scene, case.size, slab_thickness=case.slab_thickness, **case.options)
        seconds = time.perf_counter() - start
    return picture.astype(np.float64), raycast(scene, case.size), seconds


def worst_first(outcomes: list[Outcome]) -> list[Outcome]:
    """By how much of its bound each error takes."""
    return sorted(
        outcomes, key=lambda o: -o.max_error / o.bound if o.bound else -o.max_error * np.inf if o.max_error else 0
    )


def as_markdown(outcomes: list[Outcome]) -> str:
    lines = [f"| {' | '.join(COLUMNS)} |", "|" + "---|" * len(COLUMNS)]
    return "\n".join(lines + [f"| {' | '.join(outcome.row)} |" for outcome in outcomes])


def as_csv(outcomes: list[Outcome]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows([COLUMNS, *(outcome.row for outcome in outcomes)])
    return text.getvalue()


def as_html(outcomes: list[Outcome], renderer_name: str) -> str:
    """One page that needs nothing else."""
    over = sum(outcome.over for outcome in outcomes)
    heads = "".join(f"<th>{html.escape(name)}</th>" for name in COLUMNS)
    rows = "\n".join(
        f'<tr class="{outcome.verdict}">' + "".join(f"<td>{html.escape(cell)}</td>" for cell in outcome.row) + "</tr>"
        for outcome in outcomes
    )
    return f"""<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>texvol: hard cases</title>
<style>
body {{ font: 15px/1.4 sans-serif; margin: 2em; color: #222; background: #fff }}
table {{ border-collapse: collapse }}
th, td {{ padding: 0.25em 0.7em; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top }}
th {{ position: sticky; top: 0; background: #eee }}
td:nth-child(n+2):nth-child(-n+6) {{ text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap }}
.over td {{ background: #fbd5d0 }} .loose td {{ background: #fff3cd }}
</style>
<h1>Hard cases</h1>
<p>{len(outcomes)} pictures against the ray-cast integral of their classification, {over} over their bounds; drawn by
{html.escape(renderer_name)}. Errors are absolute, of linear premultiplied colour and opacity; seconds are of a warm
draw. The case nearest to its bound comes first.</p>
<table><thead><tr>{heads}</tr></thead><tbody>
{rows}
</tbody></table></html>
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slicing", choices=SLICINGS, default="stacks", help="how slabs are drawn (stacks)")
    parser.add_argument("-o", "--output", type=Path, default=Path("."), metavar="DIR", help="where the tables go")
    arguments = parser.parse_args()
    outcomes = []
    with Renderer() as renderer:
        cases = hard_cases()
        for number, case in enumerate(cases, start=1):
            if sys.stderr.isatty():
                print(f"\r{number} of {len(cases)}", end="", file=sys.stderr, flush=True)
            try:
                outcomes.append(run(case, renderer, slicing=arguments.slicing))
            except InputError as error:
                print(f"{case.name}: {error}", file=sys.stderr)
        outcomes = worst_first(outcomes)
        arguments.output.mkdir(parents=True, exist_ok=True)
        (arguments.output / "hard_cases.csv").write_text(as_csv(outcomes), encoding="utf-8")
        page = as_html(outcomes, renderer.renderer_name)
        (arguments.output / "hard_cases.html").write_text(page, encoding="utf-8")
    print(as_markdown(outcomes))
    return int(any(outcome.over for outcome in outcomes))
