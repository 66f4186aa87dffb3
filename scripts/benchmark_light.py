"""What light, shadows, matter by gradient and the projection modes cost beside a plain picture of the same volume."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from functools import partial

from benchmark_scenes import SIZE
from benchmark_skipping import real_scenes
from benchmark_timing import Run, columns, frame_seconds, heading, in_turns, milliseconds, row

from texvol import DepthCue, Light, Lighting, Renderer, Scene
from texvol.scene.transfer import preset

_RATE = 1.0
_SUN = Light("directional", (-1.0, -2.0, 2.0))
_LIGHTS = (Light(), _SUN, Light("point", (300.0, -300.0, 300.0)))
# Of each kind what it is held against comes first.
_LIT: dict[str, dict[str, object]] = {
    "no light": {},
    "depth cue": {"depth_cue": DepthCue()},
    "head light": {"lighting": Lighting()},
    "three lights": {"lighting": Lighting(_LIGHTS)},
    "directional light": {"lighting": Lighting((_SUN,))},
    "the same with shadows": {"lighting": Lighting((_SUN,), shadows=True)},
}
_MODES = ("xray", "average", "mip", "minip", "isosurface")


def light(run: Run) -> None:
    """Print the section on light."""
    heading(
        "Light, matter by gradient, modes",
        "512×512, one slab per voxel: ms of a warm frame, beside that of the plain picture (no light, composite); "
        "seconds that the first frame takes before it is drawn (gradients, texels, shadows); the estimated maximum "
        "error, in the picture's own units.",
    )
    columns("scene", "classification", "what", "ms", "÷ plain", "first, s", "estimated error")
    for name, scene in real_scenes(run.data, None):
        for classification in ("post", "slab"):
            _rows(run, name, replace(scene, classification=classification))  # type: ignore[arg-type]


def _rows(run: Run, name: str, scene: Scene) -> None:
    scenes = {what: replace(scene, **changes) for what, changes in _LIT.items()}  # type: ignore[arg-type]
    if scene.classification == "post":
        for medium in ("contours", "boundaries"):
            scenes[medium] = replace(scene, transfer_function=preset(medium, scene.volume))
        low, high = scene.volume.finite_range or (0.0, 1.0)
        for mode in _MODES:
            isovalue = low + 0.6 * (high - low) if mode == "isosurface" else None
            scenes[mode] = replace(scene, mode=mode, isovalue=isovalue)  # type: ignore[arg-type]
    with ExitStack() as stack:
        renderers = {what: stack.enter_context(Renderer()) for what in scenes}
        first, estimates = {}, {}
        for what, each in scenes.items():
            renderers[what].render(each, SIZE, sampling_rate=_RATE)
            seconds = renderers[what].seconds
            first[what] = seconds["bake"] + seconds.get("upload", 0.0)
            estimates[what] = renderers[what].stats["estimated_error"]
        frames = {
            what: partial(frame_seconds, renderers[what], each, SIZE, sampling_rate=_RATE)
            for what, each in scenes.items()
        }
        times = in_turns(frames, run.rounds)
    for what, taken in times.items():
        beside = f"{taken / times['no light']:.2f}"
        estimate = "–" if estimates[what] is None else f"{estimates[what]:.1e}"
        row(name, scene.classification, what, milliseconds(taken), beside, f"{first[what]:.2f}", estimate)
