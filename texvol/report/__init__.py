"""Report of a scene: the scene drawn with many settings, each timed and compared with both oracles.

report.html         all results on one page, which needs no other file and no network
report.csv          every measurement
report.md           the fronts as a table for a README
pareto-max.png      time against maximum error, log-log
pareto-rms.png      time against rms error
"""

from __future__ import annotations

import os
from pathlib import Path

from texvol.rendering.renderer import Renderer, Size
from texvol.report.folder import check_folder, check_libraries, write_folder
from texvol.scene.scene import Scene

__all__ = ["check_folder", "check_libraries", "report"]


def report(
    scene: Scene,
    folder: str | os.PathLike[str],
    size: Size = (512, 512),
    *,
    backend: str = "auto",
    device: int | str | None = None,
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
    device : int or str, optional
        As for `Renderer`.
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

    with Renderer(backend, device=device) as renderer, Progress() as progress:
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
        write_folder(Path(folder), files)
    return Path(folder) / "report.html"
