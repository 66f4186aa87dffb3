"""`texvol completion`: scripts that complete commands, options, their words, presets and file names in a shell.

The scripts are made from the parser of the command line, so that a key costs no start of Python.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from typing import Any

from texvol.cli import completion_scripts
from texvol.cli.completion_scripts import Option
from texvol.util.terminal import say

SHELLS = ("bash", "zsh", "fish")
# Metavariables of what is a file or a folder; others with such a word in capitals are, too.
_FILES = re.compile(r"FILE|IMAGE|DIR|FOLDER|VOLUME|SCENE|^M$")


def add_completion(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "completion",
        help="completion of commands in bash, zsh and fish",
        description="Prints a script that completes commands, options, presets and file names. In ~/.bashrc: "
        'eval "$(texvol completion bash)"; in ~/.zshrc, after compinit: eval "$(texvol completion zsh)"; in '
        "~/.config/fish/config.fish: texvol completion fish | source",
    )
    parser.add_argument("shell", choices=SHELLS, help="shell that the script is for")
    parser.set_defaults(run=lambda arguments: say(script(arguments.shell, commands.choices)))


def script(shell: str, commands: dict[str, argparse.ArgumentParser]) -> str:
    """Return the script for a shell."""
    known = _known(commands)
    options = {name: list(_options(parser, known)) for name, parser in commands.items()}
    for first, _, second in (name.partition(" ") for name in commands if " " in name):
        options[first].append(Option([], [second], False, True, ""))
    makers = {"bash": completion_scripts.bash, "zsh": completion_scripts.zsh, "fish": completion_scripts.fish}
    return makers[shell](options)


def _known(commands: dict[str, argparse.ArgumentParser]) -> dict[str, list[str]]:
    """Return words of options and arguments whose converters take more than these."""
    from texvol.annotation import PARTS
    from texvol.cli.help import topics
    from texvol.comparison.limits import NAMED
    from texvol.options.light import WORDS
    from texvol.scene.gradient import ESTIMATOR_KINDS
    from texvol.scene.transfer import PRESETS

    return {
        "--tf": list(PRESETS),
        "--light": list(WORDS),
        "--gradient": list(ESTIMATOR_KINDS),
        "--annotate": list(PARTS),
        "--background": ["transparent", "black", "white"],
        "--limits": list(NAMED),
        "topic": [*topics(), *commands],
    }


def _options(parser: argparse.ArgumentParser, known: dict[str, list[str]]) -> Iterator[Option]:
    """Yield the options of a command; values of its first argument come without names."""
    for action in parser._actions:
        names = list(action.option_strings)
        key = next((each for each in names if each.startswith("--")), action.dest).replace("--add-", "--")
        shown = str(action.metavar or "")
        words = getattr(action.type, "words", ()) if action.choices is None else action.choices
        values = [str(each) for each in words] or known.get(key, [])
        if not values and "|" in shown:  # words in small letters stand for themselves, as in N|all
            values = [each for each in shown.split("|") if re.fullmatch(r"[a-z0-9]+", each)]
        about = re.sub(r"\s+", " ", action.help or "").replace("%%", "%")
        if names or values:
            yield Option(names, values, action.nargs != 0, bool(_FILES.search(shown)), about)
