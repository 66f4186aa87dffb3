"""`texvol diff`: a candidate held against its reference, in words, as JSON, as a page, as a picture of the difference.

Exit status: 0 the same within the limits; 1 different; 2 unreadable, or wrong usage.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.options import texts
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line
from texvol.util.terminal import say

if TYPE_CHECKING:
    from texvol.comparison.limits import Limits
    from texvol.comparison.outcome import Outcome

SAME, DIFFERENT, UNREADABLE = 0, 1, 2
# With --detailed-exitcode.
NEW, WORSE, BETTER, BROKEN = 3, 4, 5, 6
_LIMITS = {
    "max-abs": ("V", "a pixel differs if a channel does by more than V (0.001)"),
    "fail-percent": ("P", "so many percent of the pixels may (0)"),
    "hard-max": ("V", "no pixel differs by more than V"),
    "outlier": ("V", "no pixel is farther than V outside of what its neighbours hold in the other picture"),
    "rms": ("V", "root mean square difference (0.0002)"),
    "flip": ("V", "mean FLIP, what an eye sees, from 0 to 1 (0.01)"),
}


def add_diff(commands: Any) -> None:
    """The command's parser."""
    parser = commands.add_parser(
        "diff",
        help="whether a picture is the same as another, and if not, what changed",
        description="Holds a candidate against a reference: EXR, PNG, TIFF, JPEG; in linear light, colour "
        "premultiplied. What the files' number formats can't hold does not count. Says in which parts the scenes in "
        "their headers differ. Exit status 0: the same within the limits, 1: different, 2: unreadable.",
    )
    parser.add_argument("candidate", metavar="CANDIDATE", nargs="?", help="picture that came out now")
    parser.add_argument("reference", metavar="REFERENCE", nargs="?", help="picture that it is held against")
    limits = parser.add_argument_group(
        "limits",
        "Limits that are given are the only ones, or replace those of --limits. Without any the defaults hold, in "
        "brackets; where the pictures name two drivers, looser ones (--limits two-drivers).",
    )
    for name, (metavar, text) in _LIMITS.items():
        limits.add_argument(f"--{name}", type=_limit, metavar=metavar, help=text)
    limits.add_argument("--limits", metavar="NAME|FILE.toml", help="one-driver, two-drivers, or a file of limits")
    oracle = parser.add_argument_group("the oracle")
    oracle.add_argument(
        "--oracle", action=argparse.BooleanOptionalAction,
        help="say whether the candidate is nearer to the truth than the reference, by ray casting the scene that is in "
        "their headers, or of two scenes how far each is from the truth of its own; done of itself where pictures "
        "differ and the scene's volume is found",
    )  # fmt: skip
    oracle.add_argument("--volume", metavar="FILE", help="the scene's volume, where it is no longer where it was")
    oracle.add_argument(
        "--self-test", metavar="SCENE",
        help="plant mistakes in a scene (an EXR that texvol drew, a volume, a scene file with a volume) and show which "
        "of them the limits catch; status 1 if one is missed",
    )  # fmt: skip
    _add_output(parser)
    parser.set_defaults(run=run)


def _add_output(parser: argparse.ArgumentParser) -> None:
    output = parser.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="everything for machines")
    output.add_argument(
        "--html", type=texts.file_name, metavar="FILE", help="a page to look at both pictures and their difference"
    )
    output.add_argument(
        "--output", type=texts.file_name, metavar="FILE", help="picture of the absolute difference: EXR, PNG or JPEG"
    )
    output.add_argument("--gain", type=_limit, metavar="G", help="factor on the difference in --output (1)")
    output.add_argument(
        "--detailed-exitcode", action="store_true",
        help=f"status {NEW}: there is no reference yet, {WORSE}: farther from the oracle, {BETTER}: nearer to it, "
        f"{BROKEN}: not finite, or another size or number of channels",
    )  # fmt: skip


def _limit(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = float("nan")
    if not number >= 0:
        raise argparse.ArgumentTypeError(f"a number from 0 upwards is wanted, and not {text!r}")
    return number


def run(arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    from texvol.comparison import ci, limits

    base = None if arguments.limits is None else limits.named_limits(arguments.limits)
    given = {name: vars(arguments)[name.replace("-", "_")] for name in _LIMITS}
    chosen = limits.given_limits({name: value for name, value in given.items() if value is not None}, base)
    _check_outputs(arguments)
    if arguments.self_test is not None:
        return _self_test(arguments, chosen)
    if arguments.candidate is None or arguments.reference is None:
        raise InputError("CANDIDATE and REFERENCE are wanted: two pictures (see texvol diff --help)")
    if arguments.detailed_exitcode and os.path.isfile(arguments.candidate) and not os.path.lexists(arguments.reference):
        return _new(arguments)
    outcome = _outcome(arguments, chosen)
    if arguments.output and outcome.measures is None:
        none = f"{arguments.output} was not written: pictures of different sizes have no difference"
        outcome = replace(outcome, notes=(*outcome.notes, none))
    _write(arguments, outcome)
    say(json.dumps(outcome.as_json(), indent=2, allow_nan=False) if arguments.json else in_words(outcome))
    for line in ci.told([outcome]):
        print(line, file=sys.stderr if arguments.json else sys.stdout)
    return _status(outcome, detailed=arguments.detailed_exitcode)


def _check_outputs(arguments: argparse.Namespace) -> None:
    """Raise InputError where an output can't be written, or would take the place of what is read."""
    from texvol.formats.pictures import image

    sources = ("candidate", "reference", "self_test", "volume", "limits")
    for path in filter(None, (arguments.html, arguments.output)):
        writing.check_writable(path)
    outputs = {"--html": arguments.html, "--output": arguments.output}
    writing.check_apart(outputs, [vars(arguments)[name] for name in sources], "is what is compared")
    if arguments.output:
        image.check_writable(arguments.output)


def _outcome(arguments: argparse.Namespace, chosen: Limits | None) -> Outcome:
    from texvol.comparison.outcome import examine
    from texvol.comparison.pictures import read_picture

    candidate, reference = read_picture(arguments.candidate), read_picture(arguments.reference)
    outcome = examine(candidate, reference, chosen, name=Path(arguments.candidate).name)
    wanted = arguments.oracle
    if outcome.measures is None or (wanted is None and outcome.status != "different") or wanted is False:
        return outcome
    from texvol.comparison.judged import judged

    return judged(outcome, volume=arguments.volume, required=bool(wanted))


def _new(arguments: argparse.Namespace) -> int:
    """There is nothing to compare with; the candidate has to be a picture all the same."""
    from texvol.comparison.pictures import read_picture

    read_picture(arguments.candidate)
    words = f"new: there is no {arguments.reference} yet; look at {arguments.candidate}, and copy it there"
    say(json.dumps({"name": arguments.candidate, "status": "new"}) if arguments.json else words)
    return NEW


def _self_test(arguments: argparse.Namespace, chosen: Limits | None) -> int:
    from texvol.comparison import limits, self_test

    if arguments.candidate is not None:
        raise InputError("--self-test SCENE takes no pictures to compare")
    if arguments.output:
        raise InputError("--output is of two pictures, and --self-test has many: use --html")
    found = self_test.self_test_of(arguments.self_test, chosen or limits.ONE_DRIVER, volume=arguments.volume)
    if arguments.html:
        writing.write_files({arguments.html: found.page().encode()})
    say(json.dumps(found.as_json(), indent=2, allow_nan=False) if arguments.json else found.as_text())
    return SAME if found.passed else DIFFERENT


def _write(arguments: argparse.Namespace, outcome: Outcome) -> None:
    """The page and the picture, all or none; and what a CI system is told."""
    files = {}
    if arguments.html:
        from texvol.comparison.page import comparison_page

        files[arguments.html] = comparison_page(outcome, flip=True).encode()
    if arguments.output and outcome.measures is not None:
        files[arguments.output] = _difference_picture(arguments.output, outcome, arguments.gain)
    writing.write_files(files)


def _difference_picture(path: str, outcome: Outcome, gain: float | None) -> bytes:
    """Absolute differences in linear light; EXR holds that of the opacity too, the others show colours alone."""
    import numpy as np

    from texvol.comparison.compared import compared_pixels
    from texvol.formats.pictures import image

    ours, theirs = compared_pixels(outcome)
    difference = np.abs(ours - theirs) * np.float32(1 if gain is None else gain)
    return image.encoded(path, difference, {"texvol:gain": f"{1 if gain is None else gain:g}"})


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
    """What a terminal shows of an outcome."""
    lines = [f"{outcome.status}: {outcome.candidate.name}, held against {outcome.reference.name}"]
    lines += [f"  {each}" for each in (*outcome.violations, *outcome.scene_words)]
    lines += [f"  {each.words}{_fraction(each.explained)}" for each in outcome.kinds]
    lines += [f"  {outcome.three_way.words}"] if outcome.three_way and not outcome.is_equal else []
    lines += [f"  {each}" for each in outcome.notes]
    if outcome.measures is not None:
        lines += ["", *_table(outcome)]
    return "\n".join(map(shown_line, lines))


def _fraction(explained: float) -> str:
    return f" ({100 * explained:.3g}% of the squared difference)" if explained > 0 else ""


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
        f"{'flip':16}{measures.flip:>12.4g}",
        f"{'pixels over':16}{measures.percent_over:>11.4g}% by more than {measures.limit:.3g}",
        f"{'not finite':16}{measures.non_finite:>12} pixels of {measures.pixels}",
    ]
    if measures.max_error > 0:
        both = f"{_rgba(values[0])}, the reference {_rgba(values[1])}"
        lines.append(f"{'worst pixel':16}column {column}, row {row}: {both}")
    shown = ", ".join(f"{name} {number:.3g}" for name, number in limits.as_json().items() if _is_number(number))
    return [*lines, f"{'limits':16}{limits.source}: {shown}"]


def _is_number(number: object) -> bool:
    return isinstance(number, int | float)


def _rgba(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in values) + ")"
