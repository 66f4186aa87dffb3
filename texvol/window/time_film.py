"""Films over time, written on behalf of the user: one picture for each time step, from where the camera is."""

from __future__ import annotations

from texvol.window import exporting, film_accuracy, own_files
from texvol.window.desk import Desk
from texvol.window.document import Document


def film(desk: Desk, document: Document, path: str, size: tuple[int, int], rate: float) -> None:
    """Have a film or numbered pictures of all time steps written."""
    from texvol.formats.films import containers as film_formats
    from texvol.formats.films import film as films

    count = desk.times.count
    fps = rate if film_formats.is_film(path) else None

    def check() -> None:
        films.check_output(path, count, size)
        film_formats.check_rate(path, fps)

    def write(chosen: str) -> None:
        accuracy = film_accuracy.accuracy(desk)
        desk.write(document, kind="steps", size=size, accuracy=accuracy, path=chosen, views=count, fps=fps)

    if desk.attempt(check):
        exporting.guarded(desk, path, lambda each: own_files.written(each, count), write)
