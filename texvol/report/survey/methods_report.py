"""Report of the survey's methods: one scene drawn by each, timed, and compared with both oracles.

methods.html        table, plot, pictures and error pictures on one page, which needs no other file and no network
methods.csv         every measurement
methods.png         time of a picture against its rms error, log-log
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from texvol.methods import METHODS
from texvol.rendering.renderer import Renderer, Size
from texvol.report.folder import check_folder, check_libraries, write_folder
from texvol.report.measuring import fingerprint
from texvol.report.progress import Progress
from texvol.report.survey.measuring import checked_names, survey
from texvol.scene.scene import Scene


def methods_report(
    scene: Scene,
    folder: str | os.PathLike[str],
    size: Size = (512, 512),
    names: Sequence[str] = tuple(METHODS),
    *,
    backend: str = "auto",
    device: int | str | None = None,
    command: str = "",
) -> Path:
    """Measure methods on a scene, write the page, table and plot, and return the path of the page.

    Parameters
    ----------
    scene : Scene
        Mode composite; methods that project draw it in mode xray.
    folder : path
        Created if its parent exists.
    device : int or str, optional
        As for `Renderer`.
    names : sequence of str
        Of `texvol.methods.METHODS`.
    command : str
        Command line, printed on the page.

    Raises
    ------
    InputError
        If a name is not a method's, or the folder can't be written.
    MissingExtraError
        If a library is not installed (`texvol[report,methods]`).
    """
    names = checked_names(names)
    check_folder(folder)
    check_libraries("texvol methods")
    from texvol.report.plot import THEMES
    from texvol.report.survey.page import html
    from texvol.report.survey.plot import methods_plot
    from texvol.report.survey.table import csv_text

    with Renderer(backend, device=device) as renderer, Progress() as progress:
        progress.expect(len(names))
        found = survey(renderer, scene, size, names, tell=progress.say)
        metadata = fingerprint(renderer)
        progress.say("writing the page")
    plots = {theme: methods_plot(found, theme) for theme in THEMES}
    files = {
        "methods.png": plots["light"],
        "methods.csv": csv_text(found).encode(),
        "methods.html": html(found, plots, metadata, command).encode(),
    }
    write_folder(Path(folder), files)
    return Path(folder) / "methods.html"
