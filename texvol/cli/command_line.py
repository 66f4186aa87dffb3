"""The command line: `texvol info|render|raycast|view|diff|report|surface|demo|help`.

Exit status: 0 done; 1 pictures differ, or with --strict a wanted error was not reached; 2 bad input or usage, with one
line on stderr.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from texvol.cli.diff import add_diff
from texvol.cli.help import add_help_command
from texvol.cli.view import add_view
from texvol.formats.films import containers as film_formats
from texvol.formats.films import film
from texvol.formats.pictures import depth as depth_picture
from texvol.formats.pictures import image
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.output import sequences
from texvol.output.shown_pictures import Display, is_exact
from texvol.provenance.scene_metadata import scene_metadata
from texvol.scene.scene import Scene
from texvol.util import termination, writing
from texvol.util.errors import AccuracyWarning, InputError, TexvolError
from texvol.util.terminal import complain, say
from texvol.util.version import __version__

if TYPE_CHECKING:
    from texvol.formats.readers import TimeSeries
    from texvol.rendering.renderer import Renderer
    from texvol.scene.volume import Volume

FORMATS = ("auto", "rgba8", "rgba16f", "rgba32f")
_ACCURACY = (
    *("slab_thickness", "sampling_rate", "max_error"),
    *("texture_format", "target_format", "early_termination", "skip_empty"),
)


class _Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        # "argument --size: …" names the option twice as long as needed; the rest is as argparse says it.
        raise InputError(message.removeprefix("argument ") + f" (see {self.prog} --help)")


def main(line: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    try:
        line = sys.argv[1:] if line is None else line
        arguments = _parser().parse_args(options.with_negative_values(line), argparse.Namespace(line=line))
        # Numbers out of range show in the picture or are refused by name: numpy has nothing to add.
        with termination.heard(), warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
            warnings.simplefilter("always", AccuracyWarning)
            status = arguments.run(arguments)
        for warning in caught:
            complain(f"warning: {warning.message}")
        missed = any(issubclass(warning.category, AccuracyWarning) for warning in caught)
        return status or int(missed and arguments.strict)
    except (TexvolError, MemoryError) as error:
        complain(f"error: {_reason(error)}")
        return 2
    except termination.Terminated as ended:
        complain(ended)
        return ended.status
    except BrokenPipeError:
        # The reader of our output went away; nothing is left to say, and Python must not try at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="texvol", description="Volume rendering by 3D-texture slicing, with a known error.")
    parser.add_argument("--version", action="version", version=f"texvol {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    info = commands.add_parser("info", help="what is in a volume file")
    reading_options.add_volume_options(info)
    info.add_argument("--spacing", type=texts.triple, metavar="X,Y,Z", help="overrides the file's")
    info.add_argument("--json", action="store_true", help="the same for machines")
    info.set_defaults(run=_info)

    render = commands.add_parser("render", help="a picture of a volume")
    reading_options.add_volume_options(render, in_scene_file=True)
    options.add_scene_options(render)
    films = " or ".join(f"film{each}" for each in film_formats.FORMATS)
    names = f"picture: {', '.join(image.FORMATS)}; with --orbit such as frame_%%04d.png, or {films}"
    render.add_argument("-o", "--output", metavar="IMAGE", required=True, help=names)
    _add_depth(render)
    _add_rendering(render)
    _add_orbit(render)
    render.set_defaults(run=_render)

    raycast = commands.add_parser("raycast", help="the same picture by the oracle: exact, slow, float64")
    reading_options.add_volume_options(raycast, in_scene_file=True)
    options.add_scene_options(raycast)
    raycast.add_argument("-o", "--output", metavar="IMAGE", required=True, help=f"picture: {', '.join(image.FORMATS)}")
    _add_depth(raycast)
    raycast.set_defaults(run=_raycast)

    add_diff(commands)
    add_view(commands)
    _add_report_and_demo(commands)
    add_help_command(commands)
    return parser


def _add_report_and_demo(commands: Any) -> None:
    report = commands.add_parser("report", help="speed against error of a scene: a page, a table and plots")
    reading_options.add_volume_options(report, in_scene_file=True)
    options.add_scene_options(report)
    report.add_argument(
        "-o", "--output", type=texts.file_name, metavar="DIR", required=True,
        help="folder for the report, made if missing",
    )  # fmt: skip
    report.add_argument("--quick", action="store_true", help="few settings, few frames")
    report.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    report.set_defaults(run=_report)

    surface = commands.add_parser("surface", help="the isosurface of a volume as a mesh")
    reading_options.add_volume_options(surface)
    surface.add_argument("--spacing", type=texts.triple, metavar="X,Y,Z", help="overrides the file's")
    surface.add_argument("--value", type=texts.number, metavar="V", required=True, help="data units")
    surface.add_argument("-o", "--output", metavar="FILE", required=True, help="mesh: .ply, .stl, .obj or .vtp")
    surface.set_defaults(run=_surface)

    demo = commands.add_parser("demo", help="a picture of a built-in volume, no file needed")
    demo.add_argument("-o", "--output", metavar="IMAGE", default="texvol-demo.png", help="texvol-demo.png")
    demo.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    demo.set_defaults(run=_demo)


def _add_depth(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--depth", type=texts.file_name, metavar="FILE.exr",
        help="depth of the isosurface along the view from the eye, world units, channel Z, infinite where none is met",
    )  # fmt: skip


def _add_rendering(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("accuracy and device")
    thickness = group.add_mutually_exclusive_group()
    thickness.add_argument("--slab-thickness", type=texts.number, metavar="L", help="world units")
    thickness.add_argument("--sampling-rate", type=texts.number, metavar="R", help="slabs per smallest spacing (1)")
    thickness.add_argument(
        "--max-error", type=texts.number, metavar="E", help="maximum absolute error wanted of the linear picture"
    )
    group.add_argument("--strict", action="store_true", help="status 1 if --max-error is not reached")
    group.add_argument(
        "--check", type=texts.pixels, metavar="N|all",
        help="hold N random pixels, or all, against the oracle, and say what follows; also in --stats and the header",
    )  # fmt: skip
    group.add_argument("--texture-format", choices=FORMATS, default="auto", help="texels of the 3D texture")
    group.add_argument("--target-format", choices=FORMATS, default="auto", help="pixels composited into")
    group.add_argument(
        "--early-termination", type=texts.transmittance, metavar="T",
        help="a ray ends where it lets no more light through than T (2^-22, or less than --max-error); 0: never",
    )  # fmt: skip
    group.add_argument(
        "--skip-empty", action=argparse.BooleanOptionalAction, default=True,
        help="leap over cells in which nothing shows (default); the picture is the same",
    )  # fmt: skip
    group.add_argument(
        "--texture-memory", type=texts.megabytes, metavar="MB",
        help="megabytes (10^6 bytes) for textures (half of what is free); larger volumes are drawn in bricks",
    )  # fmt: skip
    group.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    group.add_argument(
        "--stats", type=texts.file_name, metavar="FILE.json", help="write what was done, seconds and estimated error"
    )
    group.add_argument("--repeat", type=int, metavar="N", default=1, help="draw N times, --stats has the median")


def _add_orbit(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(
        "orbit",
        "The camera turns once around the target, about --up. Where --eye and --height leave it open, every view is "
        "framed alike, with the whole box in each. --max-error chooses for the first view, and estimates it there.",
    )
    group.add_argument("--orbit", type=texts.views, metavar="N", help="N views, 360/N degrees apart")
    group.add_argument("--fps", type=texts.frames_per_second, metavar="F", help="frames per second of a film (30)")


def _info(arguments: argparse.Namespace) -> None:
    from texvol.cli import information

    metadata = information.metadata(reading_options.load_volume(arguments, arguments.spacing))
    say(json.dumps(metadata, indent=2, allow_nan=False) if arguments.json else information.text(metadata))


def _render(arguments: argparse.Namespace) -> None:
    scene_options = options.SceneOptions(arguments)
    _check_rendering(arguments, scene_options)
    start = time.perf_counter()
    series = scene_options.series() if scene_options.all_times else None
    volume = scene_options.load() if series is None else scene_options.placed(series[0])
    seconds = {"load": time.perf_counter() - start}
    display = Display(scene_options, scene_options.annotation)
    scene = _scene(arguments, scene_options, volume, series, display)
    accuracy = {name: vars(arguments)[name] for name in _ACCURACY}

    from texvol.rendering.renderer import Renderer

    with Renderer(arguments.backend, texture_memory=arguments.texture_memory) as renderer:
        picture, depth, more = None, None, {}
        if series is None and arguments.orbit is None:
            once = {"repeat": arguments.repeat, "check": arguments.check}
            picture = renderer.render(scene, scene_options.size, **once, **accuracy)
            depth = renderer.depth() if arguments.depth else None
        else:
            frames = _frames(scene, arguments.orbit, series, scene_options)
            more = _draw_frames(*frames, renderer, accuracy, display, scene_options, arguments)
        stats = renderer.stats if arguments.stats else {}
        found, settings = renderer.check, renderer.settings
        metadata = {"texvol:renderer": renderer.renderer_name} | (found.attributes if found else {})
    # With the textures gone there is room for what writes pictures.
    files = {}
    if picture is not None:
        shown = display.of(picture, scene, arguments.output)
        metadata |= display.metadata(scene_options.volume, scene, arguments.output, settings)
        files[arguments.output] = image.encoded(
            arguments.output, shown, metadata, transparent=scene_options.transparent
        )
    if depth is not None:
        files[arguments.depth] = depth_picture.encoded(arguments.depth, depth)
    if arguments.stats:
        stats = stats | {"seconds": seconds | {"upload": 0.0} | stats["seconds"]} | more
        files[arguments.stats] = (json.dumps(stats, indent=2, allow_nan=False) + "\n").encode()
    writing.write_files(files)
    if found is not None and arguments.check:
        say(found.sentence)


def _draw_frames(
    what: str,
    frames: sequences.Frames,
    renderer: Renderer,
    accuracy: dict[str, Any],
    display: Display,
    scene_options: options.SceneOptions,
    arguments: argparse.Namespace,
) -> dict[str, Any]:
    """Draw and write a sequence; what `--stats` says of it."""
    how = {"transparent": scene_options.transparent, "fps": arguments.fps}
    size, output = scene_options.size, arguments.output
    return {what: sequences.draw_frames(frames, renderer, size, accuracy, display, output, **how)}


def _scene(
    arguments: argparse.Namespace,
    scene_options: options.SceneOptions,
    volume: Volume,
    series: TimeSeries | None,
    display: Display,
) -> Scene:
    """The scene to be drawn: of a picture, or the first of an orbit or a series."""
    size, orbit = scene_options.size, arguments.orbit is not None
    adapting_to = None
    if series is not None:
        film.check_output(arguments.output, len(series), size)
        adapting_to = scene_options.placed(sequences.standing_for(series))
    in_8_bits = not is_exact(arguments.output)
    scene = scene_options.scene(volume, orbit=orbit, adapting_to=adapting_to, in_8_bits=in_8_bits)
    return display.prepared(scene, size, chose_view=scene_options.chose_view or orbit)


def _frames(
    scene: Scene, views: int | None, series: TimeSeries | None, scene_options: options.SceneOptions
) -> tuple[str, sequences.Frames]:
    """What the pictures are, in a word of `--stats`, and their scenes."""
    if series is not None:
        return "time", sequences.steps(scene, series, scene_options.placed)
    assert views is not None
    return "orbit", sequences.views(scene, views, scene_options.volume)


def _check_rendering(arguments: argparse.Namespace, scene_options: options.SceneOptions) -> None:
    """Raise InputError before anything is loaded where the options don't go together or a file can't be written."""
    if not scene_options.all_times:
        film.check_output(arguments.output, arguments.orbit, scene_options.size)
    elif arguments.orbit is not None or arguments.depth or arguments.repeat > 1:
        raise InputError("--time all draws every step once: leave --orbit, --depth and --repeat out")
    if arguments.stats:
        writing.check_writable(arguments.stats)
    _check_depth(arguments, scene_options)
    _check_apart(arguments, scene_options)
    if arguments.repeat < 1:
        raise InputError(f"--repeat draws at least once, and not {arguments.repeat} times")
    if arguments.check and (arguments.orbit is not None or scene_options.all_times):
        raise InputError("--check is of one picture: leave --orbit and --time all out")
    if arguments.orbit is not None and arguments.repeat > 1:
        raise InputError("--repeat draws one view again and again, and --orbit others: give one of them")
    film_formats.check_rate(arguments.output, arguments.fps)


def _raycast(arguments: argparse.Namespace) -> None:
    scene_options = options.SceneOptions(arguments)
    image.check_writable(arguments.output)
    _check_depth(arguments, scene_options)
    _check_apart(arguments, scene_options)
    scene = scene_options.scene(scene_options.load(), in_8_bits=not is_exact(arguments.output))

    from texvol.ray_casting import raycast
    from texvol.ray_casting.projection import isosurface_depth

    display = Display(scene_options, scene_options.annotation)
    scene = display.prepared(scene, scene_options.size, chose_view=scene_options.chose_view)
    picture = display.of(raycast(scene, scene_options.size), scene, arguments.output)
    metadata = {"texvol:renderer": "ray casting, float64"} | display.metadata(
        scene_options.volume, scene, arguments.output
    )
    transparent = scene_options.transparent
    files = {arguments.output: image.encoded(arguments.output, picture, metadata, transparent=transparent)}
    if arguments.depth:
        files[arguments.depth] = depth_picture.encoded(arguments.depth, isosurface_depth(scene, scene_options.size))
    writing.write_files(files)


def _check_depth(arguments: argparse.Namespace, scene_options: options.SceneOptions) -> None:
    if not arguments.depth:
        return
    if scene_options.mode != "isosurface":
        raise InputError(f"--depth is that of an isosurface, and the mode is {scene_options.mode}")
    if vars(arguments).get("orbit") is not None:
        raise InputError("--depth is that of one picture: leave --orbit out")
    depth_picture.check_writable(arguments.depth)


def _check_apart(arguments: argparse.Namespace, scene_options: options.SceneOptions) -> None:
    outputs = {"--output": arguments.output, "--depth": arguments.depth, "--stats": vars(arguments).get("stats")}
    writing.check_apart(outputs, (scene_options.volume, arguments.scene, scene_options.transfer_function))


def _report(arguments: argparse.Namespace) -> None:
    from texvol import report

    scene_options = options.SceneOptions(arguments)
    if scene_options.mode != "composite":
        raise InputError(f"a report is on pictures of mode composite, and the mode is {scene_options.mode}")
    report.check_folder(arguments.output)
    report.check_libraries()
    scene = scene_options.scene(scene_options.load())
    page = report.report(
        scene,
        arguments.output,
        scene_options.size,
        backend=arguments.backend,
        quick=arguments.quick,
        command=shlex.join(["texvol", *arguments.line]),
    )
    say(str(page.resolve()))


def _surface(arguments: argparse.Namespace) -> None:
    from texvol import geometry
    from texvol.geometry import saving

    saving.check_writable(arguments.output)
    volume = reading_options.load_volume(arguments, arguments.spacing)
    mesh = geometry.surface_of(volume, arguments.value)
    geometry.save_mesh(mesh, arguments.output)
    say(f"{Path(arguments.output).resolve()}: {len(mesh.triangles)} triangles, {len(mesh.vertices)} vertices")


def _demo(arguments: argparse.Namespace) -> None:
    from texvol.rendering.renderer import Renderer
    from texvol.scene.demo import demo_scene

    image.check_writable(arguments.output)
    with Renderer(arguments.backend) as renderer:
        scene = demo_scene()
        picture = renderer.render(scene, (512, 512), sampling_rate=2)
        metadata = scene_metadata("demo", scene, settings=renderer.settings, checksum=is_exact(arguments.output))
        image.write(arguments.output, picture, {"texvol:renderer": renderer.renderer_name} | metadata)
        say(f"{Path(arguments.output).resolve()} drawn by {renderer.renderer_name} ({renderer.backend})")


def _reason(error: BaseException) -> str:
    return str(error).strip() or ("not enough memory" if isinstance(error, MemoryError) else type(error).__name__)
