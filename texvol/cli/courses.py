"""Options of `texvol render` for several views: an orbit, or a tour through the saved views of a scene."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from texvol.formats.films import film
from texvol.options import texts
from texvol.output import sequences
from texvol.output.turn_page import page as turn_page
from texvol.output.turn_page.writer import PageWriter
from texvol.scene.orbit import AXES, Turn
from texvol.scene.scene import Scene
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.options.scene_options import SceneOptions

AUTO = "auto"


def add_courses(parser: argparse.ArgumentParser) -> None:
    """Add the options to the command's parser."""
    group = parser.add_argument_group(
        "orbit and tour",
        "The camera turns around the target, or goes through the views that the window has saved in the scene file. "
        "Without --eye and --height all views of an orbit have the same framing, and the whole box is visible in each. "
        "--max-error applies to the first view.",
    )
    group.add_argument(
        "--orbit", type=texts.orbit, metavar="N[xROWS]",
        help="N views of an orbit, at equal angles; 72x9: 72 around at each of 9 elevations",
    )  # fmt: skip
    group.add_argument(
        "--slices", action="store_true", help="axial, coronal and sagittal slices of the volume in a page, in 8 bits"
    )
    group.add_argument(
        "--orbit-axis", choices=AXES, metavar="AXIS",
        help=f"axis of the orbit: {', '.join(AXES)}: --up (default), what points up in the first picture, to the head "
        "of the body, or along an axis of the world",
    )  # fmt: skip
    group.add_argument(
        "--orbit-turns", type=texts.number, metavar="T",
        help="turns of the orbit (1), counterclockwise seen from the tip of the axis; clockwise if negative",
    )  # fmt: skip
    group.add_argument(
        "--tour", type=_count, metavar="N|auto",
        help="N views along the path through the [[saved-view]] of --scene; auto: as many as its seconds have at --fps",
    )  # fmt: skip
    group.add_argument(
        "--fps", type=texts.frames_per_second, metavar="F",
        help="frames per second of a film (30; fewer so that an orbit lasts 2 seconds, and a tour its own)",
    )  # fmt: skip


def is_single(arguments: argparse.Namespace) -> bool:
    """True if neither an orbit nor a tour is asked for."""
    return arguments.orbit is None and arguments.tour is None


def turn_of(arguments: argparse.Namespace) -> Turn | None:
    """Return the turn of an orbit, or None.

    Raises
    ------
    InputError
        If there can be no such turn.
    """
    if arguments.orbit is None:
        return None
    turns = 1.0 if arguments.orbit_turns is None else arguments.orbit_turns
    return Turn(arguments.orbit_axis or "up", turns, rows=arguments.orbit[1])


def count(arguments: argparse.Namespace, scene_options: SceneOptions) -> int | None:
    """Return the number of views; None for a single picture."""
    if arguments.tour == AUTO:
        return scene_options.tour.pictures(arguments.fps or film.DEFAULT_FPS)
    if arguments.orbit is not None:
        columns, rows = arguments.orbit
        return int(columns * rows)
    number: int | None = arguments.tour
    return number


def page(arguments: argparse.Namespace) -> bool:
    """True if the output is a page that is dragged to turn."""
    return arguments.output is not None and turn_page.is_page(arguments.output)


def check_page(arguments: argparse.Namespace, size: tuple[int, int]) -> None:
    """Raise InputError if no page can be made of the options, or written."""
    if arguments.orbit is None:
        raise InputError(f"{arguments.output}: a page to turn needs --orbit, such as --orbit 72x9")
    if arguments.orbit_turns is not None:
        raise InputError("--orbit-turns is of films and pictures: a page goes once around, leave it out")
    if arguments.fps is not None:
        raise InputError("--fps is of films: a page turns by hand, leave it out")
    columns, rows = arguments.orbit
    turn_page.check(arguments.output, columns * rows, size)


def page_writer(arguments: argparse.Namespace, scene: Scene, title: str | None) -> PageWriter | None:
    """Return the writer of the page that the output is; None of pictures and films."""
    if not page(arguments):
        return None
    return PageWriter(arguments.output, scene, title=title or "", rows=arguments.orbit[1], with_slices=arguments.slices)


def said_of_frames(stats: Mapping[str, Mapping[str, Any]]) -> tuple[float | None, str, str]:
    """Return of the entries of a sequence in `--stats` the estimated error, of which picture it is, and the page.

    The page is the end of the last line, on its quality.
    """
    ((kind, found),) = stats.items()
    of = "first time step" if kind == "time" else "first view"
    return found["estimated_error_of_first_view"], of, f", {found['page']}" if "page" in found else ""


def rate(arguments: argparse.Namespace, scene_options: SceneOptions) -> float | None:
    """Return the pictures per second of a film; a tour lasts its own seconds, if 30 a second are enough for that."""
    if arguments.fps is not None or arguments.tour is None:
        fps: float | None = arguments.fps
        return fps
    number = film.DEFAULT_FPS if arguments.tour == AUTO else arguments.tour / scene_options.tour.seconds
    return float(min(number, film.DEFAULT_FPS))


def frames(arguments: argparse.Namespace, scene: Scene, scene_options: SceneOptions) -> tuple[str, sequences.Frames]:
    """Return the kind of a sequence, and its scenes."""
    number, name = count(arguments, scene_options), scene_options.volume
    assert number is not None
    if arguments.tour is not None:
        return "tour", sequences.tour(scene, scene_options.tour, number, name)
    return "orbit", sequences.views(scene, number, name, turn_of(arguments))


def check(arguments: argparse.Namespace, scene_options: SceneOptions) -> None:
    """Raise InputError if options conflict."""
    several = {"--orbit": arguments.orbit, "--tour": arguments.tour}
    given = [name for name, value in several.items() if value is not None]
    if len(given) > 1:
        raise InputError("--orbit and --tour both move the camera: give one of them")
    if arguments.orbit is None and (arguments.orbit_axis or arguments.orbit_turns is not None):
        raise InputError("--orbit-axis and --orbit-turns need --orbit N, the number of views")
    turn_of(arguments)
    if arguments.slices and not page(arguments):
        raise InputError("--slices needs a page: --orbit 72x9 -o turn.html")
    if arguments.tour is not None and len(scene_options.tour.views) < 2:
        found = len(scene_options.tour.views)
        raise InputError(f"--tour needs at least 2 saved views in --scene ([[saved-view]]), got {found}")
    if not given and not scene_options.all_times:
        return
    named = (given or ["--time all"])[0]
    if arguments.check:
        raise InputError(f"--check needs a single picture: leave {named} out")
    if given and scene_options.has_depth_in:
        raise InputError(f"--depth-in is of a single view: leave {named} out")
    if given and arguments.repeat > 1:
        raise InputError(f"--repeat draws one view several times and {named} draws several views: give one of them")
    if given and arguments.depth:
        raise InputError(f"--depth needs a single picture: leave {named} out")
    if arguments.progressive:
        raise InputError(f"--progressive needs a single picture: leave {named} out")


def _count(text: str) -> int | str:
    return AUTO if text == AUTO else texts.count(text, what="views")
