"""`texvol completion`: scripts that complete commands, options, choices, presets and file names in a shell.

The scripts are made from the parser of the command line, so that a key costs no start of Python.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

from texvol.util.terminal import say

SHELLS = ("bash", "zsh", "fish")


class Option(NamedTuple):
    """Option of a command: its names, its values if they are known, and its help in one line."""

    names: list[str]
    values: list[str]
    takes_value: bool
    about: str


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
    options = {name: list(_options(parser, commands)) for name, parser in commands.items()}
    for first, _, second in (name.partition(" ") for name in commands if " " in name):
        options[first].append(Option([], [second], False, ""))
    if shell == "fish":
        return "\n".join(_fish(commands, options))
    body = _cases(options)
    names = " ".join(name for name in commands if " " not in name)
    pairs = "|".join(f"'{name}'" for name in commands if " " in name)
    lines = [_BASH.replace("COMMANDS", names).replace("PAIRS", pairs).replace("CASES", body)]
    if shell == "zsh":
        lines.insert(0, "autoload -Uz bashcompinit && bashcompinit")
    return "\n".join(lines)


def _options(parser: argparse.ArgumentParser, commands: dict[str, argparse.ArgumentParser]) -> Iterator[Option]:
    """Yield the options of a command; values of its first argument come without names."""
    from texvol.cli.help import topics
    from texvol.scene.transfer import PRESETS

    known = {"--tf": list(PRESETS), "topic": [*topics(), *commands]}
    for action in parser._actions:
        names = [each for each in action.option_strings if each.startswith("--")]
        values = [str(each) for each in action.choices or ()]
        key = names[0] if names else action.dest
        about = re.sub(r"\s+", " ", action.help or "").replace("%%", "%")
        if names or values or key in known:
            yield Option(names, values or known.get(key, []), action.nargs != 0, about)


def _cases(options: dict[str, list[Option]]) -> str:
    """Return the cases of the scripts: by command and the word before."""
    lines = []
    for command, found in options.items():
        flags = " ".join(name for each in found for name in each.names)
        first = " ".join(value for each in found if not each.names for value in each.values)
        lines.append(f"    '{command}') options='{flags}'; first='{first}'; case $before in")
        for each in found:
            if each.names and each.takes_value:
                words = " ".join(each.values)
                lines.append(f"        {'|'.join(each.names)}) values='{words}'; is_value=1;;")
        lines.append("      esac;;")
    return "\n".join(lines)


# Names of files are completed after an option that takes a value, and where no option begins.
_BASH = """_texvol() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  local options= first= values= is_value= IFS=$' \\t\\n'
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W 'COMMANDS --help --version' -- "$word"))
    return
  fi
  case "$command ${COMP_WORDS[2]}" in
    PAIRS) [ "$COMP_CWORD" -gt 2 ] && command="$command ${COMP_WORDS[2]}";;
  esac
  case $command in
CASES
  esac
  if [ -z "$is_value" ] && [ "${word:0:1}" = - ]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
    return
  fi
  [ -n "$is_value" ] || { [ "$COMP_CWORD" -eq 2 ] && values=$first; }
  IFS=$'\\n'
  COMPREPLY=($(IFS=$' \\n'; compgen -W "$values" -- "$word") $(compgen -f -- "$word"))
}
complete -o filenames -F _texvol texvol"""


def _fish(commands: dict[str, argparse.ArgumentParser], options: dict[str, list[Option]]) -> Iterator[str]:
    """Yield the lines of fish's script."""
    names = " ".join(name for name in commands if " " not in name)
    yield f"complete -c texvol -f -n __fish_use_subcommand -a '{names}'"
    for command, found in options.items():
        words = "; and ".join(f"__fish_seen_subcommand_from {word}" for word in command.split())
        seen = f"complete -c texvol -n '{words}'"
        for each in found:
            values = f" -a '{' '.join(each.values)}'" if each.values else ""
            about = each.about.replace("\\", "\\\\").replace("'", "\\'")
            if not each.names:
                yield seen + values
            for name in each.names:
                needs = " -r" if each.takes_value else ""
                yield f"{seen} -l {name.removeprefix('--')}{needs}{values} -d '{about}'"
