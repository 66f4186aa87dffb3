"""Writing of scenes, pictures and films on behalf of the user, who is asked before files of others are overwritten."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from texvol.window import overwriting, saving
from texvol.window.desk import Desk
from texvol.window.document import Document


def scene(
    desk: Desk, document: Document, path: str = "", *, asks: bool = True, then: Callable[[], Any] = lambda: None
) -> None:
    """Save a scene, by default in its own file, and call `then` if it is saved."""
    path = path or saving.scene_name(document)

    def write(chosen: str) -> None:
        if desk.attempt(lambda: saving.save_scene(chosen, document, desk.pixels)):
            desk.own.wrote(saving.files_of(chosen, document))
            document.origin = replace(document.origin, scene_file=chosen)
            desk.say(f"saved {Path(chosen).resolve()}")
            then()

    if asks:
        overwriting.guarded(desk, path, lambda each: saving.files_of(each, document), write)
    else:
        write(path)


def picture(desk: Desk, document: Document, path: str = "", size: tuple[int, int] | None = None) -> None:
    """Have a picture written, by default of the size in the window."""
    path, wanted = path or saving.default_name(document, ".png"), size or desk.pixels
    accuracy = desk.accuracy if wanted == desk.pixels else desk.director.accuracy

    def write(chosen: str) -> None:
        desk.write(document, kind="file", size=wanted, accuracy=accuracy, path=chosen)

    overwriting.guarded(desk, path, lambda each: [each], write)


def film(desk: Desk, document: Document, path: str, size: tuple[int, int], views: int, rate: float) -> None:
    """Have a film or numbered pictures of one turn written."""
    from texvol.formats.films import containers as film_formats
    from texvol.formats.films import film as films

    fps = rate if film_formats.is_film(path) else None

    def check() -> None:
        films.check_output(path, views, size)
        film_formats.check_rate(path, fps)

    def write(chosen: str) -> None:
        accuracy = desk.director.accuracy
        desk.write(document, kind="film", size=size, accuracy=accuracy, path=chosen, views=views, fps=fps)

    if desk.attempt(check):
        overwriting.guarded(desk, path, lambda each: overwriting.written(each, views), write)
