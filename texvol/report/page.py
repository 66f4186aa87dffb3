"""The report as one HTML page: pictures and plots are inside it, nothing is asked of any network."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from string import Template

from texvol.report import words
from texvol.report.convergence import discretisation_max, total_max, total_rms
from texvol.report.error_pictures import error_section
from texvol.report.measurement_table import table_section
from texvol.report.measuring import Findings
from texvol.report.orders import order_section
from texvol.report.pictures import data_url, png
from texvol.scene.scene import Scene
from texvol.util.shown_text import escaped
from texvol.util.version import __version__

Plots = Mapping[str, Mapping[str, bytes]]  # metric → theme → PNG file


def html(findings: Findings, plots: Plots) -> str:
    """The page's text."""
    template = Template((files("texvol.report") / "page.html").read_text("utf-8"))
    sections = [
        _choice_section(findings),
        _asked_section(findings),
        _plot_section(plots),
        order_section(findings),
        error_section(findings),
        table_section(findings),
        _method_section(findings),
    ]
    scene = findings.scene
    return template.substitute(
        title=escaped(f"Speed against error: {', '.join(Path(volume.name).name for volume in scene.volumes)}"),
        version=__version__,
        date=f"{findings.started:%d %B %Y, %H:%M}",
        picture=data_url(png(findings.picture)),
        picture_caption=f"<code>{escaped(scene.classification)}</code> at rate 1, {_size(findings)} pixels, over the "
        "background",
        answer=_answer(findings),
        metadata="".join(f"<dt>{escaped(name)}</dt><dd>{escaped(fact)}</dd>" for name, fact in _metadata(findings)),
        notes=_notes(findings),
        sections="\n".join(filter(None, sections)),
    )


def _answer(findings: Findings) -> str:
    if not findings.has_errors:
        return "No error could be measured, so no setting can be recommended."
    what = "the error of every pixel, all causes together,"
    said = words.sentence(findings.ours, total_max, what, findings.asked)
    return escaped(f"{said} {words.of_discretisation(findings.ours, total_max, findings.asked)}".strip())


def _metadata(findings: Findings) -> list[tuple[str, str]]:
    volume, camera = findings.scene.volume, findings.scene.camera
    assert camera is not None
    unit = volume.unit or "world units"
    view = (
        f"{camera.fov:g}° from bottom to top"
        if camera.projection == "perspective"
        else f"{camera.height:.5g} {unit} high"
    )
    metadata = [
        *(fact for each in findings.scene.completed(findings.size).each_alone() for fact in _volume_metadata(each)),
        ("camera", f"{camera.projection}, {view}, eye {_triple(camera.eye)}, target {_triple(camera.target)}"),
        ("picture", f"{_size(findings)} pixels"),
    ]
    model = findings.truths.model_error
    if model is not None:
        error = f"maximum {words.max_of(model)}, rms {words.rms_of(model)}"
        metadata.append(("model error of slab and extinction", error))
    return metadata


def _volume_metadata(scene: Scene) -> list[tuple[str, str]]:
    """One of the scene's volumes."""
    volume, transfer_function = scene.volume, scene.transfer_function
    assert transfer_function is not None
    low, high = volume.finite_range or (float("nan"),) * 2
    kind = "labels" if volume.labels else "values" if volume.colors is None else "amounts of colour"
    metadata = [
        ("file", volume.name),
        ("volume", f"{' × '.join(map(str, volume.dimensions))} samples of {volume.values.dtype}"),
        ("spacing", f"{' × '.join(f'{each:.5g}' for each in volume.spacing)} {volume.unit or 'world units'}"),
        (kind, f"{low:.6g} to {high:.6g}"),
        ("transfer function", f"{transfer_function.name}, {len(transfer_function.values)} points"),
    ]
    return metadata + ([("mask", scene.mask.name)] if scene.mask is not None else [])


def _notes(findings: Findings) -> str:
    if not findings.notes:
        return ""
    return f'<div class="notes">{"".join(f"<p>{escaped(each)}</p>" for each in findings.notes)}</div>'


def _choice_section(findings: Findings) -> str:
    if not findings.has_errors:
        return ""
    columns = (total_max, total_rms, discretisation_max)
    rows = "".join(
        f'<tr><td class="first">{limit:g}</td>'
        + "".join(
            f"<td>{escaped(words.recommendation(findings.ours, each, limit, findings.asked))}</td>" for each in columns
        )
        + "</tr>"
        for limit in words.LIMITS
    )
    return f"""<h2>Which setting for which error</h2>
<p>The fastest setting of texvol that stays within each limit; where none of those measured does, what
<code>--max-error</code> reached. The rate is in slabs per smallest spacing; formats are
chosen automatically unless named.</p>
<div class="wide"><table class="choice"><thead><tr><th class="first">limit</th>
<th class="first">maximum error, total</th><th class="first">rms error, total</th>
<th class="first">maximum discretisation error, of any classification</th></tr></thead>
<tbody>{rows}</tbody></table></div>"""


def _asked_section(findings: Findings) -> str:
    if not findings.asked:
        return ""
    rows = "".join(
        f'<tr><td class="first">{escaped(each.classification)}</td><td>{each.wanted:g}</td>'
        f"<td>{each.slab_thickness / findings.scene.smallest_spacing:.3g}</td>"
        f"<td>{words.error(each.estimated_error)}</td><td>{words.error(each.true_error)}</td>"
        f"<td>{'–' if each.true_error is None else 'yes' if each.true_error <= each.wanted else 'no'}</td>"
        f"<td>{words.seconds(each.seconds)}</td></tr>"
        for each in findings.asked
    )
    return f"""<h2>Asking for an error</h2>
<p>With <code>--max-error</code> texvol chooses the thickness itself, by drawing the scene at several, and without an
oracle. The error is the maximum, against the integral of the classification; the time is that of it all.</p>
<div class="wide"><table class="asked"><thead><tr><th class="first">classification</th><th>wanted</th>
<th>slab thickness, spacings</th><th>estimated error</th><th>true error</th><th>kept</th><th>time</th></tr></thead>
<tbody>{rows}</tbody></table></div>"""


def _plot_section(plots: Plots) -> str:
    if not plots:
        return ""
    captions = {
        "max": "The largest error of any pixel and channel. Each mark is a setting, labelled with its rate and, if "
        "they are not automatic, its texel format and → target format.",
        "rms": "The same for the root mean square error.",
    }
    figures = "".join(
        f'<figure><div class="wide"><picture><source media="(prefers-color-scheme: dark)" '
        f'srcset="{data_url(themes["dark"])}"><img src="{data_url(themes["light"])}" '
        f'alt="Time of a frame against {metric} error, log-log"></picture></div>'
        f"<figcaption>{captions[metric]}</figcaption></figure>"
        for metric, themes in plots.items()
    )
    return f"""<h2>Time against error</h2>
<p>Above, the total error, which ends at the model error for what classifies before it interpolates; below, the
discretisation error alone, which thinner slabs remove. Farther left is faster, farther down is better.</p>{figures}"""


def _method_section(findings: Findings) -> str:
    truths, scene = findings.truths, findings.scene
    oracle = "" if truths.reason else f" Both integrals together took {words.seconds(truths.seconds)}."
    metadata = "".join(
        f"<dt>{escaped(name)}</dt><dd>{escaped(fact)}</dd>" for name, fact in findings.fingerprint.items()
    )
    command = f"<p>Made by <code>{escaped(findings.command)}</code>.</p>" if findings.command else ""
    return f"""<h2>How it was measured</h2>
<p>Everything on this page was measured in one run, which took {words.seconds(findings.seconds)}, one setting after the
other. Seconds of a frame are the median of the warm frames, from the request to the finished draw, and one read-back
of the picture as float32. Baking the texture and uploading it come once before them.</p>
<p>An error is an absolute difference of linear, premultiplied colour and opacity, over all pixels and channels. It is
taken from the exact integral along each ray, in float64: of the interpolated classified samples for <code>slab</code>
and <code>extinction</code>, of the classified interpolated samples for <code>post</code> and <code>integrated</code>
(discretisation error), and of the latter for all (total error). The distance of the two integrals is the model
error.{oracle}</p>
<p>A slab is {scene.smallest_spacing:.5g} {escaped(scene.volume.unit or "world units")} thick at rate 1. VTK's mappers
draw in a process of their own, with that as sample distance; theirs is the time of a render and its read-back in 8
bits.</p>
{command}<dl>{metadata}</dl>"""


def _size(findings: Findings) -> str:
    return f"{findings.size[0]} × {findings.size[1]}"


def _triple(numbers: tuple[float, float, float]) -> str:
    return ", ".join(f"{each:.4g}" for each in numbers)
