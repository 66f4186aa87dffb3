"""Command line of texvol: the parser of all commands, and errors as one line with an exit status.

Exit status: 0 done; 1 pictures differ, or with --strict the requested error was not reached; 2 bad input or usage, with
one line on stderr.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import Any, NoReturn

import numpy as np

from texvol.cli.accept import add_accept
from texvol.cli.common import take_scene_file
from texvol.cli.completion import add_completion
from texvol.cli.convert import add_convert
from texvol.cli.convert_tf import add_convert_tf
from texvol.cli.demo import add_demo
from texvol.cli.devices import add_devices
from texvol.cli.diff import add_diff
from texvol.cli.help import add_help_command
from texvol.cli.info import add_info
from texvol.cli.measure import add_measure
from texvol.cli.methods import add_methods
from texvol.cli.presets import add_presets
from texvol.cli.raycast import add_raycast
from texvol.cli.render import add_render
from texvol.cli.report import add_report
from texvol.cli.report_history import NAME as REPORT_HISTORY
from texvol.cli.report_history import add_report_history
from texvol.cli.report_merge import NAME as REPORT_MERGE
from texvol.cli.report_merge import add_report_merge
from texvol.cli.surface import add_surface
from texvol.cli.view import add_view
from texvol.options import texts
from texvol.util import remarks, termination
from texvol.util.errors import AccuracyWarning, InputError, TexvolError
from texvol.util.suggestions import did_you_mean
from texvol.util.terminal import complain, showing_progress
from texvol.util.version import __version__

# In the order of `texvol --help`.
_COMMANDS: dict[str, Callable[[Any], None]] = {
    "info": add_info,
    "render": add_render,
    "raycast": add_raycast,
    "diff": add_diff,
    "view": add_view,
    "report": add_report,
    REPORT_MERGE: add_report_merge,
    REPORT_HISTORY: add_report_history,
    "accept": add_accept,
    "methods": add_methods,
    "measure": add_measure,
    "surface": add_surface,
    "convert": add_convert,
    "convert-tf": add_convert_tf,
    "demo": add_demo,
    "presets": add_presets,
    "devices": add_devices,
    "completion": add_completion,
    "help": add_help_command,
}
_OF_ALL = ("completion", "help")  # what they print is of the parsers of all commands


_UNKNOWN = r"unrecognized arguments: (--[\w-]+).*|.*invalid choice: '([^']*)' \(choose from (.*)\)"


class _Parser(argparse.ArgumentParser):
    """Argument parser whose errors are one line."""

    command = ""  # as the line names it

    def error(self, message: str) -> NoReturn:
        # argparse begins with "argument --size: …"; the option's name alone is enough.
        found = re.fullmatch(_UNKNOWN, message)
        near = ""
        if found and found[1]:
            options = _options(self, self.command)
            elsewhere = found[1] not in options and found[1] in _options(_parser())
            near = f"; {self.command} has no such option" if elsewhere else did_you_mean(found[1], options)
        elif found:
            near = did_you_mean(found[2], re.findall(r"[\w-]+", found[3]))
        # Of a command's words too many, the parser of all commands complains.
        commands = next((each.choices for each in self._actions if isinstance(each, argparse._SubParsersAction)), {})
        of_command = message.startswith("unrecognized") and self.command in commands
        where = f"{self.prog} {self.command}" if of_command else self.prog
        raise InputError(message.removeprefix("argument ") + near + f" (see {where} --help)")


def main(line: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    try:
        line = sys.argv[1:] if line is None else line
        remarks.begin()
        words = texts.with_negative_values(_joined(line))
        arguments = _parser(words[0] if words else "").parse_args(words, argparse.Namespace(line=line))
        take_scene_file(arguments)
        # Numbers out of range are checked by name or visible in the picture, so numpy's warnings add nothing.
        with termination.heard(), warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
            warnings.simplefilter("always", AccuracyWarning)
            with nullcontext() if line[:1] == ["view"] else showing_progress():
                status = arguments.run(arguments)
        for warning in caught:
            complain(f"warning: {warning.message}")
        for remark in remarks.taken():
            complain(f"note: {remark}")
        missed = any(issubclass(warning.category, AccuracyWarning) for warning in caught)
        return status or int(missed and arguments.strict)
    except (TexvolError, MemoryError) as error:
        complain(f"error: {_reason(error)}")
        return 2
    except termination.Terminated as ended:
        complain(ended)
        return ended.status
    except BrokenPipeError:
        # The reader of stdout has closed it; without this, Python would try to flush stdout again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


def _parser(command: str = "") -> argparse.ArgumentParser:
    """Return the parser of a line that begins with this word: of the command alone, which takes a tenth of the time."""
    parser = _Parser(prog="texvol", description="Volume rendering by 3D-texture slicing, with a known error.")
    parser.command = command
    parser.add_argument("--version", action="version", version=f"texvol {__version__}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    alone = command in _COMMANDS and command not in _OF_ALL
    for add in [_COMMANDS[command]] if alone else _COMMANDS.values():
        add(commands)
    return parser


def _joined(line: Sequence[str]) -> list[str]:
    """Return the line with the two words of a command as one; a volume of that name is written ./merge."""
    words = " ".join(line[:2])
    return [words, *line[2:]] if words in (REPORT_MERGE, REPORT_HISTORY) and len(line) > 1 else list(line)


def _options(parser: argparse.ArgumentParser, command: str = "") -> list[str]:
    """Return the names of all options of a parser and its commands, or of the one command of that name."""
    found: list[str] = []
    for action in parser._actions:
        found += [name for name in action.option_strings if name.startswith("--")]
        if isinstance(action, argparse._SubParsersAction):
            chosen = [action.choices[command]] if command in action.choices else action.choices.values()
            found += [name for each in chosen for name in _options(each)]
    return found


def _reason(error: BaseException) -> str:
    return str(error).strip() or ("not enough memory" if isinstance(error, MemoryError) else type(error).__name__)
