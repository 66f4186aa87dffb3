"""The command line: `texvol info|render|raycast|report|demo`.

Exit status: 0 done; 1 a wanted error was not reached, with --strict; 2 bad input or usage, with one line on stderr.
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
from typing import Any, NoReturn

import numpy as np

from texvol import __version__, image, options, writing
from texvol.errors import AccuracyWarning, InputError, TexvolError
from texvol.scene import Scene

FORMATS = ("auto", "rgba8", "rgba16f", "rgba32f")


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
        with warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
            warnings.simplefilter("always", AccuracyWarning)
            arguments.run(arguments)
        for warning in caught:
            print(f"texvol: warning: {_one_line(warning.message)}", file=sys.stderr)
        missed = any(issubclass(warning.category, AccuracyWarning) for warning in caught)
        return int(missed and arguments.strict)
    except (TexvolError, MemoryError) as error:
        print(f"texvol: error: {_one_line(error)}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("texvol: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output went away; nothing is left to say, and Python must not try at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="texvol", description="Volume rendering by 3D-texture slicing, with a known error.")
    parser.add_argument("--version", action="version", version=f"texvol {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    info = commands.add_parser("info", help="what is in a volume file")
    options.add_volume_options(info)
    info.add_argument("--spacing", type=options.triple, metavar="X,Y,Z", help="overrides the file's")
    info.add_argument("--json", action="store_true", help="the same for machines")
    info.set_defaults(run=_info)

    render = commands.add_parser("render", help="a picture of a volume")
    options.add_volume_options(render)
    options.add_scene_options(render)
    _add_output(render)
    _add_rendering(render)
    render.set_defaults(run=_render)

    raycast = commands.add_parser("raycast", help="the same picture by the oracle: exact, slow, float64")
    options.add_volume_options(raycast)
    options.add_scene_options(raycast)
    _add_output(raycast)
    raycast.set_defaults(run=_raycast)

    report = commands.add_parser("report", help="speed against error of a scene: a page, a table and plots")
    options.add_volume_options(report)
    options.add_scene_options(report)
    report.add_argument("-o", "--output", metavar="DIR", required=True, help="folder for the report, made if missing")
    report.add_argument("--quick", action="store_true", help="few settings, few frames")
    report.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    report.set_defaults(run=_report)

    demo = commands.add_parser("demo", help="a picture of a built-in volume, no file needed")
    demo.add_argument("-o", "--output", metavar="IMAGE", default="texvol-demo.png", help="texvol-demo.png")
    demo.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    demo.set_defaults(run=_demo)
    return parser


def _add_output(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("-o", "--output", metavar="IMAGE", required=True, help=f"picture: {', '.join(image.FORMATS)}")


def _add_rendering(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("accuracy and device")
    thickness = group.add_mutually_exclusive_group()
    thickness.add_argument("--slab-thickness", type=options.number, metavar="L", help="world units")
    thickness.add_argument("--sampling-rate", type=options.number, metavar="R", help="slabs per smallest spacing (1)")
    thickness.add_argument(
        "--max-error", type=options.number, metavar="E", help="maximum absolute error wanted of the linear picture"
    )
    group.add_argument("--strict", action="store_true", help="status 1 if --max-error is not reached")
    group.add_argument("--texture-format", choices=FORMATS, default="auto", help="texels of the 3D texture")
    group.add_argument("--target-format", choices=FORMATS, default="auto", help="pixels composited into")
    group.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    group.add_argument("--stats", metavar="FILE.json", help="write what was done, seconds and estimated error")
    group.add_argument("--repeat", type=int, metavar="N", default=1, help="draw N times, --stats has the median")


def _info(arguments: argparse.Namespace) -> None:
    from texvol import information

    facts = information.facts(options.load_volume(arguments, arguments.spacing))
    _say(json.dumps(facts, indent=2, allow_nan=False) if arguments.json else information.text(facts))


def _render(arguments: argparse.Namespace) -> None:
    scene_options = options.SceneOptions(arguments)
    image.check_writable(arguments.output)
    if arguments.stats:
        writing.check_writable(arguments.stats)
    if arguments.repeat < 1:
        raise InputError(f"--repeat draws at least once, and not {arguments.repeat} times")
    start = time.perf_counter()
    volume = options.load_volume(arguments, scene_options.spacing)
    seconds = time.perf_counter() - start
    scene = scene_options.scene(volume)

    from texvol.renderer import Renderer

    with Renderer(arguments.backend) as renderer:
        picture = renderer.render(
            scene,
            scene_options.size,
            slab_thickness=arguments.slab_thickness,
            sampling_rate=arguments.sampling_rate,
            max_error=arguments.max_error,
            texture_format=arguments.texture_format,
            target_format=arguments.target_format,
            repeat=arguments.repeat,
        )
        facts = {"texvol:renderer": renderer.renderer_name} | _scene_facts(arguments.volume, scene)
        files = {
            arguments.output: image.encoded(arguments.output, picture, facts, transparent=scene_options.transparent)
        }
        if arguments.stats:
            stats = renderer.stats | {"seconds": {"load": seconds} | renderer.stats["seconds"]}
            files[arguments.stats] = (json.dumps(stats, indent=2, allow_nan=False) + "\n").encode()
        writing.write_files(files)


def _raycast(arguments: argparse.Namespace) -> None:
    scene_options = options.SceneOptions(arguments)
    image.check_writable(arguments.output)
    scene = scene_options.scene(options.load_volume(arguments, scene_options.spacing))

    from texvol.ray_casting import raycast

    picture = raycast(scene, scene_options.size)
    facts = {"texvol:renderer": "ray casting, float64"} | _scene_facts(arguments.volume, scene)
    image.write(arguments.output, picture, facts, transparent=scene_options.transparent)


def _report(arguments: argparse.Namespace) -> None:
    from texvol import report

    scene_options = options.SceneOptions(arguments)
    report.check_folder(arguments.output)
    report.check_libraries()
    scene = scene_options.scene(options.load_volume(arguments, scene_options.spacing))
    page = report.report(
        scene,
        arguments.output,
        scene_options.size,
        backend=arguments.backend,
        quick=arguments.quick,
        command=shlex.join(["texvol", *arguments.line]),
    )
    _say(str(page.resolve()))


def _demo(arguments: argparse.Namespace) -> None:
    from texvol.demo import demo_scene
    from texvol.renderer import Renderer

    image.check_writable(arguments.output)
    with Renderer(arguments.backend) as renderer:
        picture = renderer.render(demo_scene(), (512, 512), sampling_rate=2)
        image.write(arguments.output, picture, {"texvol:renderer": renderer.renderer_name})
        _say(f"{Path(arguments.output).resolve()} drawn by {renderer.renderer_name} ({renderer.backend})")


def _scene_facts(name: str, scene: Scene) -> dict[str, str]:
    """Attributes for the picture's header: what was drawn, so that it can be drawn again."""
    from dataclasses import asdict

    facts: dict[str, Any] = {
        "volume": name,
        "dimensions": scene.volume.dimensions,
        "spacing": scene.volume.spacing.tolist(),
        "classification": scene.classification,
        "background": scene.background,
    }
    if scene.camera is not None:
        facts["camera"] = asdict(scene.camera)
    if scene.transfer_function is not None:
        facts["transfer_function"] = scene.transfer_function.as_json()
    return {"Software": f"texvol {__version__}", "texvol:scene": json.dumps(facts)}


def _say(text: str) -> None:
    """Print what was asked for; what the terminal cannot show becomes a question mark."""
    if sys.stdout is None:
        raise InputError("there is no standard output to write to")
    try:
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
        print(text, flush=True)
    except BrokenPipeError:
        raise
    except OSError as error:
        sys.stdout = None  # what it still holds can't be written at exit either
        raise InputError(f"standard output cannot be written to: {error.strerror}") from None


def _one_line(error: BaseException | str) -> str:
    text = " ".join(str(error).split())
    return text or ("not enough memory" if isinstance(error, MemoryError) else type(error).__name__)


if __name__ == "__main__":
    sys.exit(main())
