"""The table of all measurements, as HTML."""

from __future__ import annotations

from texvol.report import words
from texvol.report.convergence import Measurement
from texvol.report.measuring import Findings
from texvol.report.table import fronts
from texvol.util.shown_text import escaped

_HEAD = """<thead>
<tr><th class="first" colspan="4"></th><th class="group" colspan="4">time</th>
<th class="group" colspan="3">discretisation error</th><th class="group" colspan="2">total error</th></tr>
<tr><th class="first">who</th><th>rate</th><th>texels</th><th>target</th>
<th class="left">frame</th><th>frames</th><th>bake</th><th>upload</th>
<th class="left">maximum</th><th>rms</th><th>estimated</th><th class="left">maximum</th><th>rms</th></tr>
</thead>"""


def table_section(findings: Findings) -> str:
    """The section's HTML."""
    on_max, on_rms = fronts(findings)
    order = list(dict.fromkeys(each.setting.name for each in findings.measurements))
    rows = sorted(findings.measurements, key=lambda each: order.index(each.setting.name))  # stable: coarse to fine
    body = "".join(_row(each, each.setting in on_max | on_rms) for each in rows)
    return f"""<h2>Every measurement</h2>
<p>Coloured rows stand on a Pareto front: nothing was both faster and better, in maximum or in rms total error.
<em>Estimated</em> is the maximum discretisation error that texvol itself expects, without an oracle. Slabs of
rate 2 are half as thick as the smallest spacing.</p>
<div class="wide"><table>{_HEAD}<tbody>{body}</tbody></table></div>"""


def _row(each: Measurement, on_front: bool) -> str:
    setting = each.setting
    texels = each.texture_format or (setting.texture_format if setting.formats else "–")
    target = each.target_format or (setting.target_format if setting.formats else "–")
    first = [setting.name, setting.rate, texels, target]
    cells = f'<td class="first">{escaped(first[0])}</td>' + "".join(f"<td>{escaped(text)}</td>" for text in first[1:])
    if each.skipped:
        return f'<tr>{cells}<td class="left words" colspan="9">left out: {escaped(each.skipped)}</td></tr>'
    times = [words.seconds(each.seconds), str(each.frames)]
    times += [words.seconds(each.bake_seconds), words.seconds(each.upload_seconds)]
    own = [words.max_of(each.discretisation), words.rms_of(each.discretisation), words.error(each.estimated_error)]
    total = [words.max_of(each.total), words.rms_of(each.total)]
    for group in (times, own, total):
        cells += f'<td class="left">{group[0]}</td>' + "".join(f"<td>{text}</td>" for text in group[1:])
    mark = ' class="front"' if on_front else ""
    return f"<tr{mark}>{cells}</tr>"
