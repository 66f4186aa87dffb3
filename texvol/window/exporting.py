"""Writing of scenes, pictures and films on behalf of the user, who is asked before files of others are overwritten."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from texvol.formats.pictures import image
from texvol.scene.orbit import Turn
from texvol.scene.tour import Tour
from texvol.window import film_accuracy, own_files, recent, saving
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.questions import Question


def scene(
    desk: Desk, document: Document, path: str = "", *, asks: bool = True, then: Callable[[], Any] = lambda: None
) -> None:
    """Save a scene, by default in its own file, and call `then` if it is saved."""
    path = path or saving.scene_name(document)

    def write(chosen: str) -> None:
        if desk.attempt(lambda: saving.save_scene(chosen, document, desk.layout.alone(desk.pixels))):
            wrote_scene(desk, document, chosen)
            document.origin = replace(document.origin, scene_file=chosen)
            desk.panel_state.pop("recent", None)
            if asks:  # else a script has saved it
                recent.remember(chosen, None)
            lost = saving.lost_files(document)
            warning = f", but it can't be opened: {', '.join(lost)} no longer exists" if lost else ""
            desk.say(f"saved {Path(chosen).resolve()}{warning}")
            then()

    if not desk.attempt(lambda: saving.check_writable(path)):
        return
    if asks:
        guarded(desk, path, partial(saving.files_of, document=document), write, partial(_why, desk, document))
    else:
        write(path)


def wrote_scene(desk: Desk, document: Document, path: str) -> None:
    """Remember that a scene was written to a path."""
    for own in (desk.own, document.own):
        own.wrote(saving.files_of(path, document))


def _why(desk: Desk, document: Document, path: str) -> str:
    """Return why a scene must not overwrite a file unasked, as part of a sentence; "" if it may."""
    why = document.own.foreign(path)
    return "holds another scene of this window" if why and not desk.own.foreign(path) else why


def picture(desk: Desk, document: Document, path: str = "", size: tuple[int, int] | None = None) -> None:
    """Have a picture written, by default of the size that the 3D view has alone."""
    path, wanted = path or proposed(desk, document, ".png"), size or desk.layout.alone(desk.pixels)
    accuracy = desk.accuracy if wanted == desk.pixels else desk.director.accuracy

    def write(chosen: str) -> None:
        desk.write(document, kind="file", size=wanted, accuracy=accuracy, path=chosen)

    if desk.attempt(lambda: image.check_writable(path)):
        guarded(desk, path, lambda each: [each], write)


def film(
    desk: Desk, document: Document, path: str, size: tuple[int, int], views: int, rate: float,
    course: Turn | Tour | None = None,
) -> None:  # fmt: skip
    """Have a film or numbered pictures of a turn, or of a tour through the saved views, written."""
    from texvol.formats.films import containers as film_formats
    from texvol.formats.films import film as films

    course = course or Turn()
    fps = rate if film_formats.is_film(path) else None

    def check() -> None:
        films.check_output(path, views, size)
        film_formats.check_rate(path, fps)
        if isinstance(course, Turn):
            course.direction(document.view.camera, document.scene.volume)
        else:
            course.cameras(1)

    def write(chosen: str) -> None:
        accuracy = film_accuracy.accuracy(desk)
        seconds = film_accuracy.seconds(desk, document, size, views)
        if seconds is not None:
            desk.moving.forecasts[chosen] = seconds
        job = {"size": size, "accuracy": accuracy, "path": chosen, "views": views, "course": course, "fps": fps}
        desk.write(document, kind="film", **job)

    if desk.attempt(check):
        guarded(desk, path, lambda each: own_files.written(each, views), write)


def proposed(desk: Desk, document: Document, suffix: str) -> str:
    """Return a file name that no file has, nor one that is still to be written."""
    return saving.default_name(document, suffix, _to_write(desk))


def _to_write(desk: Desk) -> set[str]:
    """Return the real paths of the files that are being written, or wait for it."""
    jobs = [*([] if desk.writing is None else [desk.job]), *desk.orders]
    return {own_files.real(each) for job in jobs for each in own_files.written(job["path"], job.get("views"))}


def guarded(
    desk: Desk,
    path: str,
    files: Callable[[str], Iterable[str]],
    write: Callable[[str], Any],
    foreign: Callable[[str], str] | None = None,
) -> None:
    """Call `write` with the path; if it would overwrite files of others, ask whether to write beside them instead.

    The same holds for files that are still to be written. `foreign` is used in place of `OwnFiles.foreign` of the desk.
    """
    foreign = foreign or desk.own.foreign
    taken, wanted = _to_write(desk), list(files(path))
    waiting = {each: "is still to be written" for each in wanted if own_files.real(each) in taken}
    reasons = waiting or {each: why for each in wanted if (why := foreign(each))}
    if not reasons:
        write(path)
        return
    (first, why), further = next(iter(reasons.items())), len(reasons) - 1
    verb = "are" if waiting else "have" if why.startswith("has ") else "do"
    several = f", and {further} more {verb}" if further else ""
    other = own_files.unused(path, files, taken=taken)
    desk.ask(
        Question(
            f"{os.path.basename(first)} {why}{several}. Replace {'it' if len(reasons) == 1 else 'them'}?",
            {
                f"write {os.path.basename(other)}": lambda: write(other),
                "replace " + ("it" if len(reasons) == 1 else "them"): lambda: write(path),
            },
            (os.path.dirname(os.path.abspath(first)), "This window has not written it." if why == "exists" else ""),
        )
    )
