"""Time to reach an error, beside more programs: texvol, VTK's mappers, a numba marcher and those of `benchmark_beside`.

All draw the same scenes in one run. Each tries its settings; then the best of each (no other is faster and nearer) are
timed again, all programs in turns. Mitsuba's tracking has no bias: the mean of many of its pictures is held against the
oracle, and its own scatter says how far they may be apart. With `--page`, table and chart go to the documentation.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from benchmark_beside import OTHERS, Beside
from benchmark_chart import Curve, draw_chart
from benchmark_competitors import WANTED, Competitor, Marcher, Texvol, Trial, Vtk
from benchmark_errors import all_finalists, best, final_times, say
from benchmark_scenes import FILES, Truths, built_in, real
from benchmark_timing import Run, milliseconds
from numpy.typing import NDArray

from texvol import Renderer, Scene
from texvol.report import vtk_mappers

REPOSITORY = Path(__file__).resolve().parents[1]
PAGE = REPOSITORY / "texvol" / "docs" / "benchmarks.md"
CHART = REPOSITORY / "texvol" / "docs" / "pictures" / "time-against-error.png"
BEGIN, END = "<!-- measured: others -->", "<!-- end of measured -->"
_SWEEP_SECONDS, _QUICK_SWEEP_SECONDS = 30.0, 10.0
_MOST_TIMED = 6  # settings of a program that are timed again
_OF_INTEREST = (WANTED[-1] / 4, 1e-1)  # errors that the chart shows
_REFEREE, _REFEREE_PICTURES, _MOST_WALKS = "Mitsuba 3", 16, 64
_CHANCE = 3.9  # standard errors


def others(run: Run) -> None:
    """Print the section; with `--page`, put it into the page and draw the chart."""
    lines, curves = [explanation(run)], {}
    print(f"\n## Beside more programs\n\n{lines[0]}\n", flush=True)
    truths = Truths(run.folder)
    found = list(scenes(run))  # all are read first: a reader that is not installed is told at once
    for name, scene in found:
        if run.scenes and not any(part in name for part in run.scenes):
            continue
        with Renderer() as renderer:
            measured = measured_scene(run, renderer, name, scene, truths.of(scene))
        curves[name] = measured.curves
        print(measured.text, flush=True)
        lines.append(measured.text)
        if run.page:  # after each scene: what is there stays if the run is ended
            put_between("\n\n".join(lines), PAGE)
            draw_chart(curves, CHART)


def explanation(run: Run) -> str:
    """Return how figures are to be read, how they were taken, and what else the machine did."""
    busy, limit = os.getloadavg()[0], sweep_seconds(run)
    return (
        "In each cell: milliseconds of a warm frame, drawn and read back; after the stroke those of the processor, all "
        "threads together; in brackets the setting, a distance of samples in smallest spacings unless it has a word. "
        f"*Not in time* is what {limit:g} seconds of each kind of settings did not reach, *not reached* what finer "
        f"ones do not improve; medians of {run.rounds} turn{'s' * (run.rounds > 1)}. "
        f"{os.cpu_count()} cores, on which {max(busy - 1, 0):.0f} other processes ran when it began: "
        + ("wall time is too long by those, processor time hardly." if busy > 3 else "they were quiet.")
    )


def sweep_seconds(run: Run) -> float:
    """Return the seconds that each kind of settings of each program has in each scene."""
    return _QUICK_SWEEP_SECONDS if run.quick else _SWEEP_SECONDS


def scenes(run: Run) -> Iterator[tuple[str, Scene]]:
    """Names and scenes: fog and bone of the built-in volume, a CT with opaque edges, and one with uneven spacings."""
    samples = 64 if run.quick else 128
    yield f"{samples}³ fog, orthographic", built_in("fog", samples)
    yield f"{samples}³ bone, perspective", built_in("bone", samples, projection="perspective")
    for file in FILES[:2]:
        scene = real(file, run.data)
        if scene is not None:
            yield f"{file.name}, {file.preset or 'proposed look'}, {scene.camera.projection}", scene  # type: ignore[union-attr]


@dataclass(frozen=True)
class Measured:
    """Table of one scene with the verdict below, and the curves of the chart."""

    text: str
    curves: list[Curve]


def measured_scene(run: Run, renderer: Renderer, name: str, scene: Scene, truth: NDArray[np.float64]) -> Measured:
    """Let all programs draw a scene."""
    limit = sweep_seconds(run)
    with contextlib.ExitStack() as closing:
        competitors: list[Competitor] = [Texvol(renderer, scene, truth, limit), Marcher(scene, truth, limit)]
        competitors += [Vtk(renderer, scene, mapper, truth, 2 * limit) for mapper in vtk_mappers.MAPPERS]
        for other in OTHERS:
            competitors.append(closing.enter_context(contextlib.closing(Beside(other, renderer, scene, truth, limit))))
        for competitor in competitors:
            start = time.perf_counter()
            competitor.search()
            say(name, competitor, time.perf_counter() - start)
        times = final_times(competitors, run.rounds, choice)
        rows = [cells(competitor, times) for competitor in competitors]
        curves = [curve(competitor, times) for competitor in competitors]
        judge = next(each for each in competitors if each.name == _REFEREE)
        said = verdict_of(judge, truth, 2 * limit) if isinstance(judge, Beside) and not judge.problem else ""
    wanted = " | ".join(f"rms {each:g}" for each in WANTED)
    head = [f"{name}:", "", f"| program | {wanted} | least error |", f"|{'---|' * (len(WANTED) + 2)}"]
    return Measured("\n".join([*head, *rows, *(["", said] if said else [])]), [each for each in curves if each.errors])


def choice(trials: Sequence[Trial]) -> list[Trial]:
    """Return the best settings of a program, evenly thinned where they are many, and finalists for each error."""
    low, high = _OF_INTEREST
    shown = [trial for trial in front(trials) if trial.rms <= high]
    shown = [trial for trial, before in zip(shown, [None, *shown], strict=False) if before is None or before.rms > low]
    places = np.unique(np.rint(np.linspace(0, len(shown) - 1, _MOST_TIMED)).astype(int)) if shown else []
    return sorted({*(shown[place] for place in places), *all_finalists(trials)}, key=lambda trial: -trial.rms)


def front(trials: Iterable[Trial]) -> list[Trial]:
    """Return the trials than which none is both faster and nearer, from the fastest to the nearest."""
    found: list[Trial] = []
    for trial in sorted(trials, key=lambda trial: (trial.seconds, trial.rms)):
        if not found or trial.rms < found[-1].rms:
            found.append(trial)
    return found


def cells(competitor: Competitor, times: dict[Trial, tuple[float, float]]) -> str:
    """Return a program's row of the table."""
    note = f": {competitor.note}" if isinstance(competitor, Beside) and not competitor.problem else ""
    if competitor.problem and not competitor.trials:
        return f"| {competitor.name} | {competitor.problem} |{' |' * len(WANTED)}"
    found = []
    for wanted in WANTED:
        trial = best(competitor.trials, wanted, times)
        words = trial.words.removeprefix(f"{competitor.name}, ") if trial else ""
        missed = "not in time" if competitor.out_of_time else "not reached"
        found.append(f"{both_times(trial)} ({words})" if trial else missed)
    least = min(trial.rms for trial in competitor.trials)
    return f"| {competitor.name}{note} | {' | '.join(found)} | {least:.1e} |"


def both_times(trial: Trial) -> str:
    """Return milliseconds, wall and processor."""
    return f"{milliseconds(trial.seconds)} / {milliseconds(trial.processor_seconds)}"


def curve(competitor: Competitor, times: dict[Trial, tuple[float, float]]) -> Curve:
    """Return a program's curve: errors and processor seconds of what was timed again."""
    chosen = [trial for trial in choice(competitor.trials) if trial in times]
    timed = front(replace(trial, seconds=times[trial][1]) for trial in chosen)
    return Curve(competitor.name, [each.rms for each in timed], [each.seconds for each in timed])


@dataclass(frozen=True)
class Verdict:
    """How far the mean of noisy pictures is from the truth, and how far their own scatter lets it be."""

    rms: float
    expected: float
    excess: float  # of the squared distance over what is expected, in standard errors
    offset: float  # of the mean over all pixels, in standard errors; the channel that is farthest off

    @property
    def agrees(self) -> bool:
        """True if neither is larger than chance makes it once in ten thousand times."""
        return max(self.excess, self.offset) < _CHANCE


def referee(pictures: NDArray[np.floating], truth: NDArray[np.float64]) -> Verdict:
    """Return the verdict of independent noisy pictures (count, height, width, 4)."""
    variance = pictures.var(axis=0, ddof=1, dtype=np.float64) / len(pictures)
    apart = pictures.mean(axis=0, dtype=np.float64) - truth
    beyond = (apart**2 - variance).mean(axis=2)  # of a pixel; its expectation is the squared bias
    excess = beyond.mean() / (beyond.std() / np.sqrt(beyond.size))
    errors = np.sqrt(variance.sum(axis=(0, 1))) / beyond.size
    offsets = np.abs(apart.mean(axis=(0, 1))) / errors
    return Verdict(
        float(np.sqrt((apart**2).mean())), float(np.sqrt(variance.mean())), float(excess), float(offsets.max())
    )


def verdict_of(program: Beside, truth: NDArray[np.float64], seconds: float) -> str:
    """Return what the referee says of the oracle after about so many seconds, in a sentence."""
    of_a_walk = min(program.frame(("", 1.0)).seconds for _ in range(2))
    walks = int(np.clip(seconds / _REFEREE_PICTURES / of_a_walk, 1, _MOST_WALKS))
    found = referee(np.stack([program.frame(("", float(walks))).picture for _ in range(_REFEREE_PICTURES)]), truth)
    return (
        f"The mean of {_REFEREE_PICTURES * walks} of Mitsuba's walks a pixel is an rms of {found.rms:.4f} from the "
        f"oracle, where its own noise makes {found.expected:.4f} ({found.excess:+.1f} standard errors); the mean over "
        f"all pixels is {found.offset:.1f} standard errors off in the worst channel: they "
        f"{'agree' if found.agrees else '**disagree**'}."
    )


def put_between(text: str, page: Path) -> None:
    """Replace what is between the marks of a page."""
    before, begin, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"{page} must have the lines {BEGIN} and {END}")
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")
