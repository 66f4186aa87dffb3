"""`texvol view`: a window in which a volume is turned and its transfer function edited."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from texvol.cli.common import add_device, take_scene_file
from texvol.formats.pictures import image
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.slicing.slabs import SLICINGS
from texvol.util import writing

if TYPE_CHECKING:
    from texvol.window.application import Application

DEFAULT_SIZE = (960, 720)
_FILES = "folder whose files it may read and write, / for all; repeatable (the current one); those of VOLUME always"
_ERROR = "maximum absolute error of the picture at rest (1/255)"


def add_view(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "view",
        help="a window on a volume",
        description="Opens a window in which the volume is turned, its transfer function edited, pictures and scenes "
        "saved. --size is the size of the picture in the window. F1 shows the keys.",
    )
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    window = parser.add_argument_group("window")
    window.add_argument("--max-error", type=texts.error_limit, metavar="E", help=_ERROR)
    window.add_argument(
        "--slicing", choices=SLICINGS, default="stacks", help="how slabs of the picture at rest are drawn, see render"
    )
    window.add_argument("--frame-rate", type=texts.frames_per_second, metavar="F", help="target while moving (30)")
    add_device(window)
    window.add_argument("--panels", action=argparse.BooleanOptionalAction, default=True, help="panels in the window")
    served = parser.add_argument_group("window in a browser")
    served.add_argument(
        "--serve", nargs="?", const="", metavar="HOST:PORT", help="show the window in a browser (127.0.0.1:8765)"
    )
    served.add_argument("--token", metavar="TEXT", help="token of its address, instead of a random one")
    viewers = partial(texts.count, what="viewers")
    served.add_argument("--viewers", type=viewers, metavar="N", help="browsers that may look at it at once (1)")
    served.add_argument("--backend", choices=("auto", "egl", "osmesa"), help="OpenGL library that draws it (auto)")
    served.add_argument("--files", action="append", metavar="FOLDER", help=_FILES)
    played = parser.add_argument_group("recorded input")
    played.add_argument("--script", metavar="FILE", help="play this input back")
    played.add_argument("--record", type=texts.file_name, metavar="FILE", help="write the input as a script")
    frames = partial(texts.count, what="frames")
    played.add_argument("--frames", type=frames, metavar="N", help="close the window after N frames")
    played.add_argument(
        "--screenshot", type=texts.file_name, metavar="FILE", help="picture of the window before it closes"
    )
    played.add_argument("--timings", type=texts.file_name, metavar="FILE.csv", help="seconds of each frame")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Open the window and return when it is closed."""
    for path in (arguments.timings, arguments.record):
        if path:
            writing.check_writable(path)
    if arguments.screenshot:
        image.check_writable(arguments.screenshot)
    from texvol.window.interruption import Interruption

    served = _served(arguments)
    with Interruption() as interruption, contextlib.ExitStack() as closers:
        plan = _plan(arguments, interruption.check)
        application_of = _application("view" if served is None else "serve")
        if served is not None:
            plan = _at(served, plan, arguments, closers)
        interruption.check()
        with application_of(plan) as application:
            application.run()


def _application(extra: str) -> type[Application]:
    """Return the class of the window; MissingExtraError if a library is missing that `extra` brings."""
    from texvol.util.errors import missing_extra

    try:
        from texvol.window.application import Application
    except ModuleNotFoundError as error:
        if (error.name or "texvol").startswith("texvol"):
            raise
        raise missing_extra(error.name or "", extra, "texvol view" + " --serve" * (extra == "serve")) from error
    return Application


def _served(arguments: argparse.Namespace) -> Any:
    """Return the address at which the window is to be served, None if it is a window of this machine's display."""
    from texvol.util.errors import InputError
    from texvol.util.locations import is_remote
    from texvol.window.remote.address import address, is_address, token

    if arguments.serve is None:
        for name in ("token", "viewers", "backend", "files"):
            if getattr(arguments, name) is not None:
                raise InputError(f"--{name} is of a window in a browser: give --serve with it")
        return None
    if not is_address(arguments.serve) and arguments.volume is None:
        arguments.volume, arguments.serve = arguments.serve, ""  # texvol view --serve VOLUME
        take_scene_file(arguments)
    for folder in arguments.files or ():
        if not is_remote(folder) and not os.path.isdir(folder):
            raise InputError(f"--files must be a folder, got {folder!r}")
    found = address(arguments.serve)
    arguments.token = token(arguments.token)
    return found


def _at(address: Any, plan: Any, arguments: argparse.Namespace, closers: contextlib.ExitStack) -> Any:
    """Return a plan whose window is served at an address."""
    from texvol.util import reach
    from texvol.window import recent
    from texvol.window.remote.exchange import Exchange
    from texvol.window.remote.off_screen import OffScreen
    from texvol.window.remote.server import Server

    viewers = arguments.viewers or 1
    exchange = Exchange(viewers)
    server = closers.enter_context(Server(exchange, address, arguments.token, viewers))
    closers.callback(reach.limit, None)

    def begin(document: Any) -> None:
        folders = *(arguments.files or ["."]), *_folders(arguments, document)
        reach.limit(folders, [str(recent.state_file().parent)])
        server.start()
        print(f"the window is at {server.url} until it is closed (ctrl-C)", flush=True)

    home = partial(OffScreen, exchange, arguments.backend or "auto", device=arguments.device)
    return replace(plan, home=home, begun=begin)


def _folders(arguments: argparse.Namespace, document: Any) -> Iterator[str]:
    """Yield the folders of the files that the window was started with."""
    from texvol.util.locations import is_remote

    volumes = document.scene.volumes if document is not None else ()
    files = [each.source.get("absolute") for each in volumes]
    for path in filter(None, [arguments.volume, arguments.scene, *files]):
        path = path.partition("::")[0]
        yield path if is_remote(path) or os.path.isdir(path) else os.path.dirname(os.path.abspath(path))


def _plan(arguments: argparse.Namespace, check: Callable[[], None]) -> Any:
    from texvol.util.errors import InputError
    from texvol.window import kept, script
    from texvol.window.document import opened
    from texvol.window.plan import Plan

    given: dict[str, Any] = {"slicing": arguments.slicing, "device": arguments.device}
    if arguments.max_error is not None:
        if not 0 < arguments.max_error < 1:
            raise InputError(f"--max-error must be over 0 and under 1, got {arguments.max_error:g}")
        given["max_error"] = arguments.max_error
    if arguments.frame_rate is not None:
        given["frames_per_second"] = arguments.frame_rate
    name = arguments.volume or arguments.scene
    size = vars(arguments).get("size")
    if name is not None:
        scene_options = options.SceneOptions(arguments)  # reports wrong options before the window opens
        size = scene_options.size if size or arguments.scene else None
        given |= {"open": lambda pixels: opened(arguments, pixels), "name": name}
    if size is None and not arguments.script:  # what is played back must not depend on what was done before
        size = kept.picture_size()
    player = script.Player(script.read(arguments.script)) if arguments.script else None
    return Plan(
        size or DEFAULT_SIZE, is_usual_size=size is None, panels=arguments.panels, frames=arguments.frames,
        screenshot=arguments.screenshot, timings=arguments.timings, record=arguments.record, player=player, check=check,
        **given,
    )  # fmt: skip
