"""`texvol diff`: compare a candidate with its reference, in words, as JSON, as a page and as a difference picture.

Exit status: 0 the same within the limits; 1 different; 2 unreadable, or wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.cli.common import add_device
from texvol.options import texts
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line
from texvol.util.terminal import say

if TYPE_CHECKING:
    from texvol.comparison.limits import Limits
    from texvol.comparison.outcome import Outcome
    from texvol.comparison.regions import Region

SAME, DIFFERENT, UNREADABLE = 0, 1, 2
_PATIENCE = 10.0  # seconds for the oracle and the mistakes, unless --oracle is given
# With --detailed-exitcode.
NEW, WORSE, BETTER, BROKEN = 3, 4, 5, 6
_LIMITS = {
    "max-abs": ("V", "a pixel differs if a channel differs by more than V (0.001)"),
    "fail-percent": ("P", "percentage of the pixels that may differ (0)"),
    "hard-max": ("V", "no pixel differs by more than V"),
    "outlier": ("V", "no pixel is more than V outside of the range of its neighbours in the other picture"),
    "rms": ("V", "root mean square difference (0.0002)"),
    "flip": ("V", "mean FLIP, the perceived difference, from 0 to 1 (0.01)"),
}


def add_diff(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "diff",
        help="compare a picture with a reference, and explain the difference",
        description="Compares a candidate with a reference: EXR, PNG, TIFF, JPEG; in linear light, colour "
        "premultiplied. Rounding by the files' number formats does not count. Names the parts in which the scenes in "
        "the pictures' headers differ. Exit status 0: the same within the limits, 1: different, 2: unreadable.",
    )
    parser.add_argument("candidate", metavar="CANDIDATE", nargs="?", help="new picture")
    parser.add_argument("reference", metavar="REFERENCE", nargs="?", help="picture to compare with")
    limits = parser.add_argument_group(
        "limits",
        "If limits are given, only these apply, or they replace those of --limits. Otherwise the defaults in brackets "
        "apply, or looser ones (--limits two-drivers) if the pictures name two drivers.",
    )
    for name, (metavar, text) in _LIMITS.items():
        limits.add_argument(f"--{name}", type=_limit, metavar=metavar, help=text)
    limits.add_argument("--limits", metavar="NAME|FILE.toml", help="one-driver, two-drivers, or a file of limits")
    limits.add_argument(
        "--ignore", action="append", default=[], metavar="REGION:REASON",
        help="region that doesn't count, and why: X,Y,WIDTH,HEIGHT in pixels from the top left, or the file of a mask "
        "of the picture's size, where what is not black doesn't count; may be given several times",
    )  # fmt: skip
    oracle = parser.add_argument_group("the oracle")
    oracle.add_argument(
        "--oracle", action=argparse.BooleanOptionalAction,
        help="ray cast the scene in the headers, and tell whether the candidate is closer to this exact picture than "
        "the reference is; with two scenes, compare each picture with its own scene. Default: if the pictures differ, "
        "the scene's volume is found and that takes no longer than ten seconds",
    )  # fmt: skip
    oracle.add_argument("--volume", metavar="FILE", help="the scene's volume, if it has moved")
    oracle.add_argument(
        "--self-test", metavar="SCENE",
        help="plant mistakes in a scene (an EXR that texvol drew, a volume, a scene file with a volume) and show which "
        "of them the limits catch; status 1 if a mistake is missed",
    )  # fmt: skip
    add_device(oracle)
    _add_output(parser)
    parser.set_defaults(run=run)


def _add_output(parser: argparse.ArgumentParser) -> None:
    output = parser.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="print JSON")
    output.add_argument(
        "--html", type=texts.file_name, metavar="FILE", help="page that shows both pictures and their difference"
    )
    output.add_argument(
        "--output", type=texts.file_name, metavar="FILE", help="picture of the absolute difference: EXR, PNG or JPEG"
    )
    output.add_argument(
        "--gain", type=_limit, metavar="G", default=1.0, help="factor on the difference in --output (1)"
    )
    output.add_argument(
        "--detailed-exitcode", action="store_true",
        help=f"status {NEW}: no reference yet, {WORSE}: farther from the oracle, {BETTER}: closer to the oracle, "
        f"{BROKEN}: not finite, or another size or number of channels",
    )  # fmt: skip


def _limit(text: str) -> float:
    (number,) = texts.numbers(text, "a number of at least 0", 1, finite=False)
    if not number >= 0:
        raise argparse.ArgumentTypeError(f"must be a number of at least 0, got {text!r}")
    return number


def run(arguments: argparse.Namespace) -> int:
    """Compare the pictures and return the exit status."""
    from texvol.comparison import ci, limits

    base = None if arguments.limits is None else limits.named_limits(arguments.limits)
    given = {name: vars(arguments)[name.replace("-", "_")] for name in _LIMITS}
    chosen = limits.given_limits({name: value for name, value in given.items() if value is not None}, base)
    _check_outputs(arguments)
    if arguments.self_test is not None:
        return _self_test(arguments, chosen)
    if arguments.candidate is None or arguments.reference is None:
        raise InputError("CANDIDATE and REFERENCE are required: give two pictures (see texvol diff --help)")
    if arguments.detailed_exitcode and os.path.isfile(arguments.candidate) and not os.path.lexists(arguments.reference):
        return _new(arguments)
    outcome = _outcome(arguments, chosen)
    if arguments.output and outcome.measures is None:
        none = f"{arguments.output} was not written: pictures of different sizes have no difference"
        outcome = replace(outcome, notes=(*outcome.notes, none))
    _write(arguments, outcome)
    say(json.dumps(outcome.as_json(), indent=2, allow_nan=False) if arguments.json else in_words(outcome))
    for line in ci.tell([ci.Result.of(outcome)]):
        print(line, file=sys.stderr if arguments.json else sys.stdout)
    return _status(outcome, detailed=arguments.detailed_exitcode)


def _region(text: str) -> Region:
    """Return the region of REGION:REASON."""
    from texvol.comparison.regions import Region

    found = re.fullmatch(r"([-\d\s,]+):(.*)", text)
    if found is not None:
        numbers = [int(each) for each in re.findall(r"-?\d+", found[1])]
        return Region.of({"rectangle": numbers, "reason": found[2].strip()}, Path(), "--ignore")
    mask, _, reason = text.rpartition(":")
    if not mask:
        raise InputError(f"--ignore must be REGION:REASON, such as '8,8,120,16:the date of the run', got {text!r}")
    return Region.of({"mask": mask, "reason": reason.strip()}, Path(), "--ignore")


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Raise InputError if an output can't be written, or is also an input."""
    from texvol.formats.pictures import image

    sources = ("candidate", "reference", "self_test", "volume", "limits")
    for path in filter(None, (arguments.html, arguments.output)):
        writing.check_writable(path)
    outputs = {"--html": arguments.html, "--output": arguments.output}
    writing.check_apart(outputs, [vars(arguments)[name] for name in sources])
    if arguments.output:
        image.check_writable(arguments.output)


def _outcome(arguments: argparse.Namespace, chosen: Limits | None) -> Outcome:
    from texvol.comparison.outcome import examine
    from texvol.comparison.pictures import read_picture

    regions = [_region(each) for each in arguments.ignore]
    candidate, reference = read_picture(arguments.candidate), read_picture(arguments.reference)
    outcome = examine(candidate, reference, chosen, name=Path(arguments.candidate).name, regions=regions)
    wanted = arguments.oracle
    if outcome.measures is None or (wanted is None and outcome.status != "different") or wanted is False:
        return outcome
    from texvol.comparison.judged import judged

    how = {"volume": arguments.volume, "device": arguments.device}
    return judged(outcome, required=bool(wanted), limit=None if wanted else _PATIENCE, **how)


def _new(arguments: argparse.Namespace) -> int:
    """Report a candidate without a reference, after checking that the candidate is a picture."""
    from texvol.comparison.pictures import read_picture

    read_picture(arguments.candidate)
    words = f"new: there is no {arguments.reference} yet; look at {arguments.candidate}, and copy it there"
    say(json.dumps({"name": arguments.candidate, "status": "new"}) if arguments.json else words)
    return NEW


def _self_test(arguments: argparse.Namespace, chosen: Limits | None) -> int:
    from texvol.comparison import limits, self_test
    from texvol.comparison.scene_source import scene_of

    if arguments.candidate is not None:
        raise InputError("--self-test takes no CANDIDATE and REFERENCE: leave them out")
    if arguments.ignore:
        raise InputError("--ignore needs two pictures: with --self-test leave it out")
    if arguments.output:
        raise InputError("--output needs two pictures: with --self-test use --html")
    stored, size = scene_of(arguments.self_test, volume=arguments.volume)
    found = self_test.self_test(stored, size, chosen or limits.ONE_DRIVER, device=arguments.device)
    if arguments.html:
        from texvol.comparison import self_test_page

        writing.write_files({arguments.html: self_test_page.page(found).encode()})
    say(json.dumps(found.as_json(), indent=2, allow_nan=False) if arguments.json else found.as_text())
    return SAME if found.passed else DIFFERENT


def _write(arguments: argparse.Namespace, outcome: Outcome) -> None:
    """Write the page and the difference picture, all or none."""
    files = {}
    if arguments.html:
        from texvol.comparison.page import comparison_page

        files[arguments.html] = comparison_page(outcome, flip=True).encode()
    if arguments.output and outcome.measures is not None:
        files[arguments.output] = _difference_picture(arguments.output, outcome, arguments.gain)
    writing.write_files(files)


def _difference_picture(path: str, outcome: Outcome, gain: float) -> bytes:
    """Return the file of the absolute differences in linear light; EXR also has the difference of the opacity."""
    import numpy as np

    from texvol.formats.pictures import image

    ours, theirs = outcome.in_common_form()
    difference = np.abs(ours.pixels - theirs.pixels) * np.float32(gain)
    return image.encoded(path, difference, {"texvol:gain": f"{gain:g}"})


def _status(outcome: Outcome, *, detailed: bool) -> int:
    if outcome.passed:
        return SAME
    if not detailed:
        return DIFFERENT
    if outcome.status == "broken":
        return BROKEN
    verdict = outcome.three_way.verdict if outcome.three_way else ""
    return {"worse": WORSE, "better": BETTER}.get(verdict, DIFFERENT)


def in_words(outcome: Outcome) -> str:
    """Return the outcome as text for a terminal."""
    lines = [f"{outcome.status}: {outcome.candidate.name}, held against {outcome.reference.name}"]
    lines += [f"  {each}" for each in (*outcome.violations, *outcome.scene_words)]
    for each in outcome.kinds:
        fraction = f" ({100 * each.explained:.3g}% of the squared difference)" if each.explained > 0 else ""
        lines.append(f"  {each.words}{fraction}")
    lines += [f"  {outcome.three_way.words}"] if outcome.three_way and not outcome.is_equal else []
    lines += [f"  {each}" for each in outcome.notes]
    if outcome.measures is not None:
        lines += ["", *_table(outcome)]
    return "\n".join(map(shown_line, lines))


def _table(outcome: Outcome) -> list[str]:
    measures, limits = outcome.measures, outcome.limits
    assert measures is not None
    names = ("max_error", "rms_error", "mean_error", "percentile_99", "percentile_99_9", "psnr")
    lines = [f"{'':16}" + "".join(f"{part:>12}" for part in measures.parts)]
    for name in names:
        numbers = (getattr(part, name) for part in measures.parts.values())
        lines.append(f"{name:16}" + "".join(f"{number:>12.4g}" for number in numbers))
    (column, row), values = measures.worst_pixel, measures.worst_values
    lines += [
        f"{'ssim':16}{measures.ssim:>12.6g}",
        f"{'flip':16}{measures.flip:>12.4g}, weighted median {measures.flip_weighted_median:.4g}",
        f"{'pixels over':16}{measures.percent_over:>11.4g}% by more than {measures.limit:.3g}",
        f"{'not finite':16}{measures.non_finite:>12} pixels of {measures.pixels}",
    ]
    if measures.max_error > 0:
        both = f"{_rgba(values[0])}, the reference {_rgba(values[1])}"
        lines.append(f"{'worst pixel':16}column {column}, row {row}: {both}")
    shown = ", ".join(
        f"{name} {number:.3g}" for name, number in limits.as_json().items() if isinstance(number, int | float)
    )
    return [*lines, f"{'limits':16}{limits.source}: {shown}"]


def _rgba(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in values) + ")"
