"""Time to reach an error: texvol, VTK's mappers and a plain marcher, each with the best of its settings.

What was fastest within the error when settings were tried is timed again, all in turns; the median decides.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np
from benchmark_competitors import NEARLY_AS_FAST, WANTED, Competitor, Marcher, Seconds, Texvol, Trial, Vtk
from benchmark_scenes import FILES, Truths, built_in, real
from benchmark_timing import Run, columns, heading, milliseconds, row
from numpy.typing import NDArray

from texvol import Renderer, Scene
from texvol.report import vtk_mappers

_FINALISTS = 2
_SWEEP_SECONDS, _QUICK_SWEEP_SECONDS = 60.0, 20.0  # of each classification, and of the marcher, in each scene
_VTK_FRACTION = 2  # its process starts, and tries all distances at once
_BUILT_IN = ("fog", "bone", "spike")
_NOTHING = "–"


def finalists(trials: Iterable[Trial], wanted: float) -> list[Trial]:
    """The fastest, and what is nearly as fast: a second look may change the order."""
    within = sorted((trial for trial in trials if trial.rms <= wanted), key=lambda trial: trial.seconds)
    return [trial for trial in within[:_FINALISTS] if trial.seconds <= NEARLY_AS_FAST * within[0].seconds]


def all_finalists(trials: Sequence[Trial]) -> list[Trial]:
    """The finalists for each error that is wanted, each once."""
    return list(dict.fromkeys(trial for wanted in WANTED for trial in finalists(trials, wanted)))


def final_times(
    competitors: Sequence[Competitor],
    rounds: int,
    choice: Callable[[Sequence[Trial]], list[Trial]] = all_finalists,
) -> dict[Trial, Seconds]:
    """Median seconds, wall and processor, of every trial that is chosen, the competitors taking turns."""
    times: dict[Trial, list[Seconds]] = {}
    chosen = [choice(each.trials) for each in competitors]
    for _ in range(rounds):
        for competitor, trials in zip(competitors, chosen, strict=True):
            if trials:
                for trial, seconds in competitor.again(trials).items():
                    times.setdefault(trial, []).append(seconds)
    return {trial: _median(each) for trial, each in times.items()}


def best(trials: Iterable[Trial], wanted: float, times: dict[Trial, Seconds]) -> Trial | None:
    """The finalist that was fastest in the end, with its final seconds."""
    timed = [timed_anew(trial, times[trial]) for trial in finalists(trials, wanted) if trial in times]
    return min(timed, key=lambda trial: trial.seconds, default=None)


def timed_anew(trial: Trial, seconds: Seconds) -> Trial:
    """Return the trial with other seconds, wall and processor."""
    return replace(trial, seconds=seconds[0], processor_seconds=seconds[1])


def _median(found: Sequence[Seconds]) -> Seconds:
    walls, of_processor = zip(*found, strict=True)
    return statistics.median(walls), statistics.median(of_processor)


def compare_scene(run: Run, renderer: Renderer, name: str, scene: Scene, truth: NDArray[np.float64]) -> None:
    """The scene's rows of the table."""
    limit = _QUICK_SWEEP_SECONDS if run.quick else _SWEEP_SECONDS
    ours, marcher = Texvol(renderer, scene, truth, limit), Marcher(scene, truth, limit)
    mappers = [Vtk(renderer, scene, mapper, truth, _VTK_FRACTION * limit) for mapper in vtk_mappers.MAPPERS]
    competitors: list[Competitor] = [ours, marcher, *mappers]
    for competitor in competitors:
        start = time.perf_counter()
        competitor.search()
        say(name, competitor, time.perf_counter() - start)
    times = final_times(competitors, run.rounds)
    for wanted in WANTED:
        winner = best(ours.trials, wanted, times)
        of_vtk = [trial for mapper in mappers if (trial := best(mapper.trials, wanted, times))]
        their_best = min(of_vtk, key=lambda trial: trial.seconds, default=None)
        marched = best(marcher.trials, wanted, times)
        row(
            name,
            f"{wanted:g}",
            time_and_setting(winner, [ours]),
            time_and_setting(their_best, mappers),
            times_as_fast(winner, their_best),
            time_and_setting(marched, [marcher]),
            times_as_fast(winner, marched),
        )


def time_and_setting(found: Trial | None, competitors: Sequence[Competitor]) -> str:
    """A cell of the table: the time, or how near the best setting came."""
    if found:
        return f"{milliseconds(found.seconds)} ({found.words})"
    errors_reached = [trial.rms for competitor in competitors for trial in competitor.trials]
    if not errors_reached:
        return "; ".join(competitor.problem for competitor in competitors)
    stopped = any(competitor.out_of_time for competitor in competitors)
    return f"not reached ({'stopped at' if stopped else 'floor'} {min(errors_reached):.1e})"


def times_as_fast(ours: Trial | None, theirs: Trial | None) -> str:
    """How many of our frames fit into one of theirs."""
    return f"{theirs.seconds / ours.seconds:.2g}" if ours and theirs else _NOTHING


def scenes(run: Run) -> Iterator[tuple[str, Scene]]:
    """Names and scenes, small ones first."""
    for samples in (64, 128, 256) if run.quick else (64, 128, 256, 512):
        for name in _BUILT_IN:
            yield f"{samples}³ {name}", built_in(name, samples)
    for file in FILES:
        scene = real(file, run.data)
        if scene is not None:
            yield f"{file.name}, {file.preset or '(proposed)'}", scene


def errors(run: Run) -> None:
    """Print the section."""
    heading(
        "Time to reach an error",
        "Milliseconds of a warm frame, 512×512 pixels, drawn and read back, with the fastest setting whose rms error "
        "against the exact post-classified integral is within what is wanted. In brackets what the setting is, and the "
        "distance of samples in voxels (smallest spacings). texvol and the marcher end rays at a quarter of the error. "
        "A ratio of 2 means that texvol takes half the time.",
    )
    columns("scene", "error", "texvol ms", "VTK ms", "ratio", "plain marcher ms", "ratio")
    truths = Truths(run.folder)
    for name, scene in scenes(run):
        if run.scenes and not any(part in name for part in run.scenes):
            continue
        # A renderer each: no scene pays for the memory of the one before.
        with Renderer() as renderer:
            compare_scene(run, renderer, name, scene, truths.of(scene))


def say(name: str, competitor: Competitor, seconds: float) -> None:
    """Tell on stderr what was tried."""
    tried = ", ".join(f"{each.words}: {milliseconds(each.seconds)} ms {each.rms:.1e}" for each in competitor.trials)
    print(f"{name}: {competitor.name}, {seconds:.0f} s; {tried or competitor.problem}", file=sys.stderr, flush=True)
