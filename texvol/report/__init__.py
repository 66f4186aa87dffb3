"""Report of a scene: the scene drawn with many settings, each timed and compared with both oracles.

report.html         all results on one page, which needs no other file and no network
report.csv          every measurement
report.md           the fronts as a table for a README
pareto-max.png      time against maximum error, log-log
pareto-rms.png      time against rms error
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

from texvol.rendering.renderer import Renderer, Size
from texvol.scene.scene import Scene
from texvol.util import writing
from texvol.util.errors import InputError, missing_extra


def check_folder(folder: str | os.PathLike[str]) -> None:
    """Raise InputError if the report can't be written to `folder`; called before the measurements."""
    path = Path(folder)
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: the report needs a folder, got a file")
    written = path if path.is_dir() else path.absolute().parent
    if not written.is_dir():
        raise InputError(f"{path}: its folder {written} does not exist")
    if not os.access(written, os.W_OK):
        raise InputError(f"{path}: no permission to write")


def check_libraries() -> None:
    """Raise MissingExtraError if a library that a report needs is not installed."""
    for library in ("matplotlib", "rich"):
        try:
            import_module(library)
        except ImportError as error:
            raise missing_extra(library, "report", "texvol report") from error


def report(
    scene: Scene,
    folder: str | os.PathLike[str],
    size: Size = (512, 512),
    *,
    backend: str = "auto",
    quick: bool = False,
    command: str = "",
) -> Path:
    """Measure, write the report, and return the path of its page.

    Parameters
    ----------
    scene : Scene
        Its classification is that of the picture on the page; all classifications are measured.
    folder : path
        Created if its parent exists.
    quick : bool
        True for few settings and few frames.
    command : str
        Command line of the report, printed on the page.

    Raises
    ------
    InputError
        If the folder can't be written, or no setting can be drawn.
    MissingExtraError
        If matplotlib or rich is not installed (`texvol[report]`).
    """
    check_folder(folder)
    check_libraries()
    from texvol.report import table
    from texvol.report.measuring import measure
    from texvol.report.page import html
    from texvol.report.plot import METRICS, THEMES, pareto_plot
    from texvol.report.progress import Progress

    with Renderer(backend) as renderer, Progress() as progress:
        findings = measure(renderer, scene, size, progress, quick=quick, command=command)
        progress.say("writing the report")
        plots = {
            metric: {theme: pareto_plot(findings, metric, theme) for theme in THEMES}
            for metric in METRICS
            if findings.has_errors
        }
        files = {f"pareto-{metric}.png": themes["light"] for metric, themes in plots.items()}
        files |= {
            "report.csv": table.csv_text(findings).encode(),
            "report.md": table.markdown_text(findings).encode(),
            "report.html": html(findings, plots).encode(),
        }
        _write(Path(folder), files)
    return Path(folder) / "report.html"


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files, or neither files nor folder."""
    is_new = not folder.exists()
    try:
        folder.mkdir(exist_ok=True)
        writing.write_files({folder / name: content for name, content in files.items()})
    except OSError as error:
        raise InputError(f"{folder}: cannot be created: {error.strerror or error}") from None
    finally:
        if is_new and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
