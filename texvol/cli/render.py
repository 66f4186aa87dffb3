"""`texvol render`: a picture, an orbit, a tour or a time series of a volume, drawn by slicing."""

from __future__ import annotations

import argparse
import json
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from texvol.cli import courses
from texvol.cli.coarse_pictures import planned, show_coarse_pictures
from texvol.cli.common import add_backend, add_depth, check_outputs
from texvol.cli.summary import reasons, summary
from texvol.cli.workers import add_workers, workers_of
from texvol.formats.films import containers as film_formats
from texvol.formats.films import film
from texvol.formats.pictures import depth as depth_picture
from texvol.formats.pictures import image
from texvol.options import first_choice, texts
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.output import sequences
from texvol.output.export import PictureExport, is_exact
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import Scene
from texvol.slicing.slabs import SLICINGS
from texvol.util import progress, writing
from texvol.util.errors import InputError, TexvolError
from texvol.util.terminal import done, say, shows_progress, stage, status_line

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from texvol.formats.readers import TimeSeries
    from texvol.rendering.renderer import Renderer
    from texvol.scene.volume import Volume

_FORMATS = ("auto", "rgba8", "rgba16f", "rgba32f")
_ACCURACY = (
    *("slab_thickness", "sampling_rate", "max_error"),
    *("texture_format", "target_format", "early_termination", "skip_empty", "slicing", "texture_refinement", "of"),
    *("level_error", "shadow_nodes", "interpolation", "adaptive"),
)


def add_render(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("render", help="a picture of a volume")
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    films = " or ".join(f"film{each}" for each in film_formats.FORMATS)
    names = f"picture: {', '.join(image.FORMATS)}; with --orbit or --tour such as frame_%%04d.png, or {films}"
    names += ", or a page that is dragged to turn, turn.html"
    parser.add_argument("-o", "--output", metavar="IMAGE", help=names)
    add_depth(parser)
    _add_accuracy(parser)
    courses.add_courses(parser)
    add_workers(parser)
    parser.set_defaults(run=run)


def _add_accuracy(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("accuracy and device")
    thickness = group.add_mutually_exclusive_group()
    thickness.add_argument("--slab-thickness", type=texts.number, metavar="L", help="world units")
    thickness.add_argument(
        "--sampling-rate", type=texts.number, metavar="R",
        help="slabs per smallest spacing (1; of looks and lit scenes by --classification auto as many as an error of "
        "1/64 needs, if half a second is enough)",
    )  # fmt: skip
    thickness.add_argument(
        "--max-error",
        type=texts.error_limit,
        metavar="E",
        help="maximum absolute error of the linear picture, such as 0.01 or 1/255",
    )
    group.add_argument(
        "--of", choices=("own", "post"), default="own",
        help="--max-error is of the integral of the picture's own classification, or of post",
    )  # fmt: skip
    group.add_argument(
        "--level-error", type=texts.number, metavar="E",
        help="error that coarser levels of a store may have, by prediction (three quarters of --max-error)",
    )  # fmt: skip
    group.add_argument("--strict", action="store_true", help="exit with status 1 if --max-error is not reached")
    group.add_argument(
        "--check", type=texts.pixels, metavar="N|all",
        help="compare N random pixels, or all, with the oracle and print the error; also in --stats and the header",
    )  # fmt: skip
    _add_textures(group)
    _add_device(group)


def _add_textures(group: Any) -> None:
    """Add options of textures and of the target."""
    group.add_argument("--texture-format", choices=_FORMATS, default="auto", help="format of the 3D texture")
    group.add_argument(
        "--texture-refinement", type=texts.refinement, metavar="1|2|4|auto",
        help="texels of slab and extinction along an axis for a sample (1; auto for --classification auto); auto: as "
        "many as show, and fit",
    )  # fmt: skip
    group.add_argument(
        "--interpolation", choices=("auto", "driver", "shader"), default="auto",
        help="what interpolates texels: the driver, whose weights often have 8 bits, or the shader; auto: the driver, "
        "but for a --max-error that such weights do not keep",
    )  # fmt: skip
    group.add_argument(
        "--adaptive", choices=("auto", "on", "off"), default="auto",
        help="on: slabs of post are divided in three where they are not nearly transparent; auto: where that takes "
        "less time for the same error, if neither thickness nor rate is given",
    )  # fmt: skip
    group.add_argument(
        "--shadow-nodes", type=texts.shadow_nodes, metavar="N|auto",
        help="nodes along the longest edge of the box, between which shadows are interpolated (64; auto with "
        "--max-error); auto: as many as their error needs, at most 256",
    )  # fmt: skip
    group.add_argument("--target-format", choices=_FORMATS, default="auto", help="format of the framebuffer")
    group.add_argument(
        "--early-termination", type=texts.transmittance, metavar="T",
        help="end a ray where its transmittance is below T (2^-22, or less than --max-error); 0: never",
    )  # fmt: skip
    group.add_argument(
        "--skip-empty", action=argparse.BooleanOptionalAction, default=True,
        help="skip cells in which nothing shows (default); the picture is the same",
    )  # fmt: skip


def _add_device(group: Any) -> None:
    """Add options of what draws, in which memory, and of its report."""
    add_slicing(group)
    group.add_argument(
        "--pipeline", choices=("auto", "fragment", "compute"), default="auto",
        help="what walks the slabs: fragments of polygons, or a compute shader (OpenGL 4.3), the same picture; auto: "
        "the faster, by a probe",
    )  # fmt: skip
    group.add_argument("--plan", action="store_true", help="print what a volume in a store would take, and stop")
    group.add_argument(
        "--progressive", action="store_true",
        help="of a volume in a store, write a coarse picture first, and finer ones in its place; an interruption keeps "
        "the last of them",
    )  # fmt: skip
    group.add_argument(
        "--texture-memory", type=texts.megabytes, metavar="MB",
        help="megabytes (10^6 bytes) for textures (half of the free memory); larger volumes are drawn in bricks",
    )  # fmt: skip
    add_backend(group)
    group.add_argument(
        "--stats", type=texts.file_name, metavar="FILE.json", help="write settings, seconds and estimated error"
    )
    group.add_argument("--repeat", type=int, metavar="N", default=1, help="draw N times; --stats has the median")


def add_slicing(group: Any) -> None:
    """Add --slicing."""
    group.add_argument(
        "--slicing", choices=SLICINGS, default="stacks",
        help="stacks: one polygon for a run of slabs, composited in its fragments (default); polygons: one polygon for "
        "each slab, the same picture; wilson: the same polygons, and slabs that the box cuts short drawn whole",
    )  # fmt: skip


def run(arguments: argparse.Namespace) -> None:
    """Draw the scene, write the picture or the frames, and what was asked for beside them."""
    start = time.perf_counter()
    _check(arguments, options.SceneOptions(arguments))
    arguments, scene_options, volume, series = first_choice.opened_with(_opened, arguments, tells_step=True)
    volume.expect_picture()
    if isinstance(volume, LargeVolume) and not arguments.plan:
        threading.Thread(target=_load_what_draws, args=(arguments,)).start()
    load_seconds = time.perf_counter() - start
    export = PictureExport(scene_options, scene_options.annotation)
    scene = _scene(arguments, scene_options, volume, series, export)
    if arguments.plan:
        say(planned(scene, scene_options.size, _accuracy(arguments)))
        return
    is_single, picture, depth, sequence_stats = series is None and courses.is_single(arguments), None, None, {}
    with _renderer(arguments, is_single) as renderer:
        if is_single:
            picture = _draw_picture(renderer, scene, export, scene_options, arguments)
            depth = renderer.depth() if arguments.depth else None
        else:
            sequence_stats = _draw_frames(renderer, scene, series, export, scene_options, arguments)
        stats = renderer.stats if arguments.stats else {}
        check, settings, chosen = renderer.check, renderer.settings, renderer.chosen
        error = stats.get("estimated_error") if stats else None if sequence_stats else renderer.quick_estimate()
        scene = renderer.drawn_scene or scene
        metadata = renderer.attributes | (check.attributes if check else {})
    files = {arguments.depth: depth_picture.encoded(arguments.depth, depth)} if depth is not None else {}
    if picture is not None:  # encoded after the textures are released: both need much memory
        shown, transparent = export.of(picture, scene, arguments.output), scene_options.transparent
        metadata |= export.metadata(scene_options.volume, scene, arguments.output, settings)
        files[arguments.output] = image.encoded(arguments.output, shown, metadata, transparent=transparent)
    if arguments.stats:
        stats["seconds"] = {"load": load_seconds, "upload": 0.0} | stats["seconds"]
        files[arguments.stats] = (json.dumps(stats | sequence_stats, indent=2, allow_nan=False) + "\n").encode()
    writing.write_files(files)
    said = [check.sentence] if check is not None and arguments.check else []
    said += [f"classification {chosen.sentence}"] if chosen else []
    error, of, page = courses.said_of_frames(sequence_stats) if sequence_stats else (error, "", "")
    by_default = not any(vars(arguments)[each] for each in _ACCURACY[:3])
    last = summary(scene_options, scene, arguments.output, error, start, of=of, by_default=by_default)
    say("\n".join([*said, *reasons(scene_options, scene), last + page]))


def _opened(
    arguments: argparse.Namespace,
) -> tuple[argparse.Namespace, options.SceneOptions, Volume, TimeSeries | None]:
    """Return the arguments, their scene options, and the volume, of all time steps the first."""
    scene_options = options.SceneOptions(arguments)
    if not scene_options.all_times:
        return arguments, scene_options, scene_options.load(), None
    series = scene_options.series()
    return arguments, scene_options, scene_options.placed(series[0]), series


def _load_what_draws(arguments: argparse.Namespace) -> None:
    """Load what draws and writes pictures, while the samples that the view depends on are on their way."""
    import OpenImageIO  # noqa: F401

    import texvol.rendering.renderer  # noqa: F401
    from texvol.opengl.contexts import open_context

    if arguments.backend in ("auto", "egl") and arguments.workers is None and arguments.dask is None:
        with suppress(TexvolError):  # the next context takes an eighth of the time of the first
            open_context("egl", arguments.device).release()


@contextmanager
def _renderer(arguments: argparse.Namespace, is_single: bool) -> Iterator[Renderer]:
    """Open a renderer of this process, or of workers, whose progress is shown on a terminal."""
    from texvol.rendering.renderer import Renderer

    stage("drawing and checking" if arguments.check else "drawing")
    workers = workers_of(arguments)
    if workers is None:
        how = {name: vars(arguments)[name] for name in ("device", "texture_memory", "pipeline")}
        with Renderer(arguments.backend, **how) as renderer:
            yield renderer
        return
    from texvol.distributed.renderer import DistributedRenderer

    with workers, DistributedRenderer(workers, backend=arguments.backend) as drawing, status_line() as show:
        if is_single:  # otherwise frames are counted
            drawing.tell = lambda fraction: show(f"texvol: {100 * fraction:.0f} % of the blocks")
        yield drawing


def _draw_picture(
    renderer: Renderer,
    scene: Scene,
    export: PictureExport,
    scene_options: options.SceneOptions,
    arguments: argparse.Namespace,
) -> NDArray[np.float32]:
    """Return the picture; write coarser ones before it if they are asked for."""
    from texvol.rendering import forecast

    accuracy = {"repeat": arguments.repeat, "check": arguments.check} | _accuracy(arguments)
    if arguments.progressive:
        show_coarse_pictures(renderer, scene, arguments, export, scene_options, accuracy)
    size = scene_options.size
    if arguments.repeat > 1 or not shows_progress():  # what is timed is drawn in one piece
        return renderer.render(scene, size, **accuracy)
    with progress.heard(done, forecast.of_picture(scene, size, accuracy)):
        return renderer.render(scene, size, **accuracy)


def _scene(
    arguments: argparse.Namespace,
    scene_options: options.SceneOptions,
    volume: Volume,
    series: TimeSeries | None,
    export: PictureExport,
) -> Scene:
    """Return the scene of a picture, or the first scene of an orbit or a time series."""
    size, turn, adapting_to = scene_options.size, courses.turn_of(arguments), None
    if series is not None:
        film.check_output(arguments.output, len(series), size)
        adapting_to = scene_options.placed(sequences.representative_volume(series))
    in_8_bits = arguments.output is None or not is_exact(arguments.output)
    scene = scene_options.scene(volume, orbit=turn or False, adapting_to=adapting_to, in_8_bits=in_8_bits)
    if arguments.tour is not None:
        scene = replace(scene, camera=scene_options.tour.views[0].camera)
    chose_view = scene_options.chose_view or not courses.is_single(arguments)
    return export.prepared(scene, size, chose_view=chose_view)


def _accuracy(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of `Renderer.render` that set its accuracy."""
    # A level that was asked for is the finest of the volume that was loaded.
    level = {"level": 0} if isinstance(vars(arguments).get("level"), int) else {}
    return {name: vars(arguments)[name] for name in _ACCURACY} | level


def _check_plan(arguments: argparse.Namespace) -> None:
    """Raise InputError if there is no output, and it is not a plan that is asked for."""
    if not arguments.plan:
        raise InputError("the following arguments are required: -o/--output, or --plan")


def _draw_frames(
    renderer: Renderer,
    scene: Scene,
    series: TimeSeries | None,
    export: PictureExport,
    scene_options: options.SceneOptions,
    arguments: argparse.Namespace,
) -> dict[str, Any]:
    """Draw and write a time series, an orbit or a tour, and return its part of `--stats`."""
    if series is not None:
        kind, frames = "time", sequences.steps(scene, series, scene_options.placed)
    else:
        kind, frames = courses.frames(arguments, scene, scene_options)
    target = (scene_options.size, _accuracy(arguments), export, arguments.output)
    how: dict[str, Any] = {"page": courses.page_writer(arguments, scene, scene_options.annotation.title)}
    how |= {"transparent": scene_options.transparent, "fps": courses.rate(arguments, scene_options)}
    return {kind: sequences.draw_frames(frames, renderer, *target, **how)}


def _check(arguments: argparse.Namespace, scene_options: options.SceneOptions) -> None:
    """Raise InputError, before the volume is loaded, if options conflict or an output can't be written."""
    if arguments.output is None:
        _check_plan(arguments)
    elif courses.page(arguments) and not scene_options.all_times:
        courses.check_page(arguments, scene_options.size)
    elif not scene_options.all_times:
        film.check_output(arguments.output, courses.count(arguments, scene_options), scene_options.size)
    elif not courses.is_single(arguments) or arguments.depth or arguments.repeat > 1:
        raise InputError("--time all draws every step once: leave --orbit, --tour, --depth and --repeat out")
    if arguments.stats:
        writing.check_writable(arguments.stats)
    check_outputs(arguments, scene_options)
    if arguments.workers is not None or arguments.dask is not None:
        for name, usual in (("device", None), ("pipeline", "auto")):
            if vars(arguments)[name] != usual:
                raise InputError(f"--{name} does not go with --workers and --dask, which choose their own")
    if arguments.repeat < 1:
        raise InputError(f"--repeat must be at least 1, got {arguments.repeat}")
    courses.check(arguments, scene_options)
    film_formats.check_rate(arguments.output, arguments.fps)
