"""Writes texvol/docs/options.md from the parser of the command line.

    python scripts/doc_options.py [--check]

Groups of options that several commands share stand first, once. `--check` compares, and ends with status 1 where the page
is not what it would write.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from texvol.cli.command_line import _parser
from texvol.options.groups import SCENE_OPTIONS
from texvol.options.reading import READING

PAGE = Path(__file__).resolve().parents[1] / "texvol" / "docs" / "options.md"
_HEAD = """# Options

Every option of every command, as `texvol COMMAND --help` has them. This page is generated: `python scripts/doc_options.py`.

Exit status of all commands: 0 done; 1 a comparison is over its limits, or with `--strict` an error was not reached; 2 bad input or
usage, with one line on stderr; 130 interrupted.
"""
_KEYS = """## Keys of scene files

[Scene files](scene-files.md) have these keys, each with the meaning of the option of that name.
"""
Group = argparse._ArgumentGroup


def commands() -> dict[str, argparse.ArgumentParser]:
    """Parsers of the commands by name."""
    (found,) = (action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    return dict(found.choices)


def page() -> str:
    """The text of the page."""
    parsers = commands()
    users: dict[tuple[str, ...], list[str]] = {}
    groups: dict[tuple[str, ...], tuple[Group, argparse.ArgumentParser]] = {}
    for name, parser in parsers.items():
        for group in parser._action_groups[2:]:  # after positional arguments and --help
            users.setdefault(identity(group), []).append(name)
            groups.setdefault(identity(group), (group, parser))
    parts = [_HEAD]
    for key, names in users.items():
        if len(names) > 1:
            group, parser = groups[key]
            parts.append(f"## {str(group.title).capitalize()}\n\nOf {listed(names)}.\n\n{section(group, parser)}")
    for name, parser in parsers.items():
        parts.append(f"## texvol {name}\n\n{about(parser)}")
        plain, own = parser._action_groups[:2], parser._action_groups[2:]
        parts.append(table(each for group in plain for each in rows(group, parser)))
        for group in own:
            if users[identity(group)] == [name]:
                parts.append(f"### {str(group.title).capitalize()}\n\n{section(group, parser)}")
    parts.append(_KEYS + keys())
    return "\n".join(parts)


def identity(group: Group) -> tuple[str, ...]:
    """What makes a group the same in several commands."""
    return (str(group.title), *(each for action in group._group_actions for each in action.option_strings))


def listed(names: list[str]) -> str:
    """Names of commands as code."""
    return ", ".join(f"`{name}`" for name in names)


def about(parser: argparse.ArgumentParser) -> str:
    """What a command does, and how it is called."""
    text = escaped(parser.description or "")
    has_options = any(each.option_strings and each.dest != "help" for each in parser._actions)
    line = " ".join([parser.prog, *positional(parser), *["[options]"] * has_options])
    return f"```text\n{line}\n```\n" + (f"\n{text}\n" if text else "")


def positional(parser: argparse.ArgumentParser) -> Iterator[str]:
    """Names of the arguments without hyphens."""
    for action in parser._actions:
        if not action.option_strings:
            yield f"[{action.metavar}]" if action.nargs == "?" else str(action.metavar)


def section(group: Group, parser: argparse.ArgumentParser) -> str:
    """The table of a group."""
    text = f"{escaped(group.description)}\n\n" if group.description else ""
    return text + table(rows(group, parser))


def table(lines: Iterable[str]) -> str:
    """Rows under their heading."""
    return "| option | meaning |\n|---|---|\n" + "".join(f"{line}\n" for line in lines)


def rows(group: Group, parser: argparse.ArgumentParser) -> list[str]:
    """A row for each option but --help."""
    return [row(action, parser) for action in group._group_actions if not isinstance(action, argparse._HelpAction)]


def row(action: argparse.Action, parser: argparse.ArgumentParser) -> str:
    """Name, argument and meaning of an option."""
    expanded = parser._get_formatter()._expand_help(action) if action.help else ""
    shown = action.metavar or "|".join(action.choices or ())
    argument = f" {shown}" if action.nargs != 0 and action.option_strings and shown else ""
    names = ", ".join(action.option_strings) or str(action.metavar)
    return f"| `{(names + argument).replace('|', chr(92) + '|')}` | {escaped(expanded)} |"


def keys() -> str:
    """The keys of scene files, by where they stand."""
    scene = [name for name in SCENE_OPTIONS if name != "add"]
    added = sorted(
        option.removeprefix("--add-")
        for action in commands()["render"]._actions
        for option in action.option_strings
        if option.startswith("--add-")
    )
    lines = (
        ("of the scene", scene), ("how the volume is read", ["volume", *READING]), ("in a table `[[add]]`", ["file", *added])
    )  # fmt: skip
    listing = "".join(f"| {where} | {listed(names)} |\n" for where, names in lines)
    return f"\n| where | keys |\n|---|---|\n{listing}"


def escaped(text: str) -> str:
    """Help text as Markdown: bars, brackets and asterisks stay what they are."""
    for each in "|<*[":
        text = text.replace(each, "\\" + each)
    return text


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="compare, and write nothing")
    if not parser.parse_args().check:
        PAGE.write_text(page(), encoding="utf-8")
        return 0
    is_current = PAGE.exists() and PAGE.read_text(encoding="utf-8") == page()
    print("options.md is up to date" if is_current else "options.md is not up to date: python scripts/doc_options.py")
    return 0 if is_current else 1


if __name__ == "__main__":
    sys.exit(main())
