"""Measurement of everything that a report shows, in one run."""

from __future__ import annotations

import datetime
import os
import time
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.contexts import open_context
from texvol.rendering.renderer import Renderer, Size
from texvol.report import vtk_mappers
from texvol.report.convergence import (
    OURS,
    SAMPLING_RATES,
    Asked,
    Limits,
    Measurement,
    Outcome,
    Setting,
    Truths,
    ask,
    settings,
    sweep,
    total_rms,
)
from texvol.report.orders import smooth_order, trilinear_change
from texvol.report.progress import Progress
from texvol.report.survey.measuring import Survey, first_refusal, survey
from texvol.report.words import LIMITS
from texvol.scene.scene import Classification, Scene
from texvol.util.errors import InputError
from texvol.util.fingerprint import machine, versions

_LIBRARIES = ("moderngl", "numpy", "numba", "OpenImageIO", "vtk", "matplotlib")
QUICK_RATES = (0.5, 1.0, 2.0)
ASKED: tuple[Classification, ...] = ("extinction", "post")  # for `--max-error`, besides the scene's own
_BUSY = 0.5  # processes, averaged over a minute
_LONGEST_ASK = 15.0  # seconds; the next smaller error may take four times as long
_METHODS_SECONDS = 60.0  # the survey's methods that have not begun by then are left out
_LARGEST_MAP = 512  # pixels along a side of an error map; larger maps are reduced to the worst pixel of each block


@dataclass
class Findings:
    """Results of measuring a scene, and `notes` on what could not be measured."""

    scene: Scene
    size: Size
    truths: Truths
    fingerprint: dict[str, str]
    command: str
    picture: NDArray[np.float32]
    started: datetime.datetime
    seconds: float = 0.0
    measurements: list[Measurement] = field(default_factory=list)
    asked: list[Asked] = field(default_factory=list)
    error_maps: dict[Setting, NDArray[np.float64]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    grid_change: float | None = None  # largest change of a picture on a finer grid of the same trilinear field
    grid_order: float | None = None  # order of a smooth field's pictures in the grid's spacing
    survey: Survey | None = None  # the survey's methods on the scene; None if quick, or if none can draw it

    @property
    def has_errors(self) -> bool:
        """True if any error was measured."""
        return any(total_rms(each) is not None for each in self.measurements)

    @property
    def ours(self) -> list[Measurement]:
        """The measurements of texvol itself."""
        return [each for each in self.measurements if each.setting.renderer == OURS]

    @property
    def model_error_map(self) -> NDArray[np.float64] | None:
        """Difference of the two oracles' pictures; None without an oracle."""
        if self.truths.preclassified is None or self.truths.postclassified is None:
            return None
        return _error_map(self.truths.preclassified, self.truths.postclassified)


def measure(
    renderer: Renderer, scene: Scene, size: Size, progress: Progress, *, quick: bool = False, command: str = ""
) -> Findings:
    """Return the scene's findings; takes minutes, or seconds if `quick`.

    Raises
    ------
    InputError
        If no setting can be drawn.
    """
    start, date = time.perf_counter(), datetime.datetime.now().astimezone()
    scene = scene.completed(size)
    busy = os.getloadavg()[0]
    progress.say("integrating both media exactly")
    refinement = _refinement(renderer, scene, size)
    truths = Truths.of(scene, size, [refinement] if refinement > 1 else [], partial(_tell, progress))
    picture = renderer.render(scene, size)
    findings = Findings(scene, size, truths, fingerprint(renderer), command, picture, date)
    if busy > _BUSY:
        findings.notes.append(f"{busy:.1f} other processes were running at the start: times may be too long.")
    if truths.reason:
        findings.notes.append(f"No error could be measured: {truths.reason}.")
    rates = QUICK_RATES if quick else SAMPLING_RATES
    chosen = settings(rates, refinement)
    progress.expect(len(chosen) + len(vtk_mappers.MAPPERS) * len(rates))
    for outcome in sweep(renderer, scene, size, chosen, truths, _limits(quick)):
        _add(findings, outcome, progress)
    progress.expect(len(findings.measurements) - len(chosen))  # formats that auto had chosen already are left out
    if all(each.skipped for each in findings.measurements):
        raise InputError(findings.measurements[0].skipped)
    _ask(findings, renderer, progress, () if quick else ASKED)
    progress.say("refining grids")
    findings.grid_change, findings.grid_order = trilinear_change(renderer), smooth_order(renderer)
    for mapper in vtk_mappers.MAPPERS:
        try:
            for outcome in vtk_mappers.sweep(renderer, scene, size, mapper, rates, truths, _limits(quick)):
                _add(findings, outcome, progress)
        except vtk_mappers.VtkError as error:
            findings.notes.append(f"{mapper} was not measured: {error}.")
    if not quick:
        _measure_methods(findings, renderer, progress)
    findings.seconds = time.perf_counter() - start
    return findings


def _measure_methods(findings: Findings, renderer: Renderer, progress: Progress) -> None:
    """Draw the scene by the survey's methods, if any can."""
    scene, size = findings.scene.completed(findings.size), findings.size
    if findings.truths.reason:
        return
    reason = first_refusal(scene)
    if reason:
        findings.notes.append(f"The survey's other methods were not measured: {reason}.")
        return
    findings.survey = survey(
        renderer, scene, size, truths=findings.truths, most_seconds=_METHODS_SECONDS, tell=progress.say
    )


def fingerprint(renderer: Renderer) -> dict[str, str]:
    """Return driver, versions of libraries, processor and load, in words."""
    context = open_context(renderer.backend, renderer.device)
    try:
        with context:
            info = context.gl.info
            vendor, version = info["GL_VENDOR"], info["GL_VERSION"]
    finally:
        context.release()
    return {
        "GL_RENDERER": renderer.renderer_name,
        "GL_VERSION": version,
        "GL_VENDOR": vendor,
        "context": renderer.backend,
        **versions(_LIBRARIES),
        **machine(),
        "load before": f"{os.getloadavg()[0]:.1f} processes running, on average over a minute",
    }


def _tell(progress: Progress, fraction: float) -> None:
    progress.now(f"integrating exactly: {100 * fraction:.0f} % of the pixels")


def _ask(findings: Findings, renderer: Renderer, progress: Progress, also: tuple[Classification, ...]) -> None:
    """Ask for each error limit, by the scene's classification and those in `also`; stop at limits that take long."""
    for classification in dict.fromkeys((findings.scene.classification, *also)):
        scene = replace(findings.scene, classification=classification)
        for wanted in LIMITS:
            progress.say(f"asking {classification} for an error of {wanted:g}")
            findings.asked.append(ask(renderer, scene, findings.size, wanted, findings.truths))
            if findings.asked[-1].seconds > _LONGEST_ASK:
                break


def _refinement(renderer: Renderer, scene: Scene, size: Size) -> int:
    """Return the refinement of the slab texture that shows and fits at one slab per voxel."""
    renderer.render(replace(scene, classification="slab"), size, texture_refinement="auto")
    return int(renderer.settings["texture_refinement"])


def _limits(quick: bool) -> Limits:
    return Limits(setting_seconds=5, sweep_seconds=40, least_frames=2, frames_seconds=0.1) if quick else Limits()


def _add(findings: Findings, outcome: Outcome, progress: Progress) -> None:
    measurement, picture = outcome
    findings.measurements.append(measurement)
    truth = findings.truths.of_setting(measurement.setting)
    if picture is not None and truth is not None:
        findings.error_maps[measurement.setting] = _error_map(picture, truth)
    progress.step(_outcome_in_words(measurement))


def _error_map(picture: NDArray, truth: NDArray) -> NDArray[np.float64]:
    """Return the largest channel's absolute difference; for a large picture, the worst pixel of each block."""
    difference = np.abs(np.asarray(picture, np.float64) - truth).max(axis=2)
    block = -(-max(difference.shape) // _LARGEST_MAP)
    if block == 1:
        return difference
    height, width = difference.shape
    padded = np.pad(difference, ((0, -height % block), (0, -width % block)), mode="edge")
    return padded.reshape(padded.shape[0] // block, block, -1, block).max(axis=(1, 3))


def _outcome_in_words(measurement: Measurement) -> str:
    if measurement.skipped:
        return f"{measurement.setting.words}: left out, {measurement.skipped}"
    rms = total_rms(measurement)
    error = "" if rms is None else f", rms error {rms:.1e}"
    return f"{measurement.setting.words}: {1e3 * (measurement.seconds or 0):.0f} ms{error}"
