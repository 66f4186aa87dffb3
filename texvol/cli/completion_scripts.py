"""Texts of the scripts that complete commands in bash, zsh and fish."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

_TOP = "--help --version"


class Option(NamedTuple):
    """Option or first argument (without names) of a command: the words it takes, and its help in one line."""

    names: list[str]
    values: list[str]
    takes_value: bool
    takes_file: bool
    about: str


# The word before a value is its option. Unless told otherwise, bash splits --option=value into three words.
_BASH = """_texvol() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command=${COMP_WORDS[1]}
  local options= first= values= takes= kept= at=2 IFS=$' \\t\\n'
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W 'COMMANDS TOP' -- "$word"))
    return
  fi
  if [ "$word" = = ]; then
    word=
  elif [ "$before" = = ]; then
    before=${COMP_WORDS[COMP_CWORD-2]}
  elif [[ $word == --*=* ]]; then
    before=${word%%=*} kept=${word%%=*}= word=${word#*=}
  fi
  case "$command ${COMP_WORDS[2]}" in
    PAIRS) [ "$COMP_CWORD" -gt 2 ] && command="$command ${COMP_WORDS[2]}" at=3;;
  esac
  case $command in
CASES
  esac
  if [ -z "$takes" ]; then
    if [ "${word:0:1}" = - ]; then
      COMPREPLY=($(compgen -W "$options" -- "$word"))
      return
    fi
    takes=files
    if [ "$COMP_CWORD" -eq "$at" ] && [ -n "$first" ]; then
      values=$first takes=$first_takes
    fi
  fi
  IFS=$'\\n'
  COMPREPLY=($(IFS=$' \\n'; compgen -W "$values" -P "$kept" -- "$word"))
  [ "$takes" = files ] && COMPREPLY+=($(compgen -f -P "$kept" -- "$word"))
}
complete -o filenames -F _texvol texvol"""

# zsh counts words from 1, and its own _files knows ~ and quotes.
_ZSH = """_texvol() {
  local command=$words[2] before=$words[CURRENT-1] at=3 found=1
  local options= first= first_takes= values= takes=
  if (( CURRENT == 2 )); then
    if [[ $PREFIX == -* ]]; then compadd -- TOP; else compadd -- COMMANDS; fi
    return
  fi
  if [[ $PREFIX == --*=* ]]; then
    before=${PREFIX%%=*}
    compset -P '*='
  fi
  case "$command $words[3]" in
    PAIRS) (( CURRENT > 3 )) && command="$command $words[3]" at=4;;
  esac
  case $command in
CASES
  esac
  if [[ -z $takes && $PREFIX == -* ]]; then
    compadd -- ${=options}
    return
  fi
  if [[ -z $takes ]]; then
    takes=files
    (( CURRENT == at )) && [[ -n $first ]] && values=$first takes=$first_takes
  fi
  [[ -n $values ]] && compadd -- ${=values} && found=0
  [[ $takes == files ]] && _files && found=0
  return found
}
compdef _texvol texvol"""

_FISH = """function __texvol_command
  set -l words (commandline -opc)[2..-1]
  test (count $words) -gt 0; or return 1
  set -l name $words[1]
  contains -- "$words[1] $words[2]" PAIRS; and set name "$words[1] $words[2]"
  test "$name" = "$argv"
end
function __texvol_first
  set -l count (count (string split ' ' -- $argv))
  __texvol_command $argv; and test (count (commandline -opc)) -eq (math $count + 1)
end"""


def bash(options: dict[str, list[Option]]) -> str:
    """Return the script for bash."""
    return _filled(_BASH, options)


def zsh(options: dict[str, list[Option]]) -> str:
    """Return the script for zsh."""
    return _filled(_ZSH, options)


def _filled(text: str, options: dict[str, list[Option]]) -> str:
    names = " ".join(name for name in options if " " not in name)
    pairs = "|".join(f"'{name}'" for name in options if " " in name)
    filled = text.replace("COMMANDS", names).replace("TOP", _TOP).replace("PAIRS", pairs)
    return filled.replace("CASES", "\n".join(_cases(options)))


def _cases(options: dict[str, list[Option]]) -> Iterator[str]:
    """Yield cases by the command and the word before."""
    for command, found in options.items():
        flags = " ".join(name for each in found for name in each.names if name.startswith("--"))
        arguments = [each for each in found if not each.names]
        first = " ".join(value for each in arguments for value in each.values)
        takes = "files" if all(each.takes_file for each in arguments) else "words"
        yield f"    '{command}') options='{flags}'; first='{first}'; first_takes={takes}; case $before in"
        for each in found:
            if each.names and each.takes_value:
                takes = "files" if each.takes_file else "words"
                yield f"        {'|'.join(each.names)}) values='{' '.join(each.values)}'; takes={takes};;"
        yield "      esac;;"


def fish(options: dict[str, list[Option]]) -> str:
    """Return the script for fish."""
    return "\n".join(_fish_lines(options))


def _fish_lines(options: dict[str, list[Option]]) -> Iterator[str]:
    yield _FISH.replace("PAIRS", " ".join(f"'{name}'" for name in options if " " in name))
    names = " ".join(name for name in options if " " not in name)
    yield f"complete -c texvol -f -n __fish_use_subcommand -a '{names}'"
    for name in _TOP.split():
        yield f"complete -c texvol -n __fish_use_subcommand -l {name.removeprefix('--')}"
    for command, found in options.items():
        for each in found:
            values = f" -a '{' '.join(each.values)}'" if each.values else ""
            if not each.names:
                files = "" if each.takes_file else " -f"
                yield f"complete -c texvol -n '__texvol_first {command}'{files}{values}"
                continue
            about = each.about.replace("\\", "\\\\").replace("'", "\\'")
            flags = " ".join(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in each.names)
            needs = "" if not each.takes_value else " -r" if each.takes_file else " -x"
            yield f"complete -c texvol -n '__texvol_command {command}' {flags}{needs}{values} -d '{about}'"
