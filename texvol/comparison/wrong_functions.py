"""Shaders in which functions are wrong: each is found by its signature, so that a mistake outlives other changes.

A wrong function is a signature and a body. Every function of the shader files that has the same name, type and types of
parameters is renamed from `name` to `name_right`, and the wrong function follows it, whose body may call `name_right`:

    ("vec4 over(vec4 front, vec4 back)", "return over_right(back, front);")

It is an error if the shader files have no such function, or if several of them have one.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from texvol.opengl.shaders import FOLDER, ShaderError

WrongFunction = tuple[str, str]  # signature and body
# Functions begin and end at the first column.
_FUNCTION = re.compile(r"^(\w+) (\w+)\(([^()]*)\) \{\n(.*?)^\}\n", re.MULTILINE | re.DOTALL)
_SIGNATURE = re.compile(r"(\w+) (\w+)\(([^()]*)\)")


@contextmanager
def wrong_shaders(*functions: WrongFunction) -> Iterator[Path]:
    """Folder of the shader files in which these functions are wrong; it is removed afterwards.

    Raises
    ------
    ShaderError
        If a signature cannot be read, or is not that of a function in exactly one file.
    """
    if not functions:
        yield FOLDER
        return
    texts = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.iterdir() if path.is_file()}
    for function in functions:
        texts |= with_wrong_function(texts, *function)
    with tempfile.TemporaryDirectory(prefix="texvol-") as name:
        for file, text in texts.items():
            (Path(name) / file).write_text(text, encoding="utf-8")
        yield Path(name)


def with_wrong_function(texts: dict[str, str], signature: str, body: str) -> dict[str, str]:
    """The file that has the function, with the wrong one behind it."""
    wanted = _SIGNATURE.fullmatch(signature)
    if wanted is None:
        raise ShaderError(f"signature must be such as 'float unit(vec3 vector, out float length)', got {signature!r}")
    key = _key(wanted)
    wrong = f"\n{signature} {{\n    {body}\n}}\n"

    def both(found: re.Match[str]) -> str:
        kind, name, parameters, statements = found.groups()
        return f"{kind} {name}_right({parameters}) {{\n{statements}}}\n{wrong}" if _key(found) == key else found[0]

    changed = {file: other for file, text in texts.items() if (other := _FUNCTION.sub(both, text)) != text}
    if len(changed) != 1:
        where = f"in {', '.join(sorted(changed))}" if changed else f"in none; there are {_namesakes(texts, wanted[2])}"
        raise ShaderError(f"one shader file must have the function {signature!r}, found {where}")
    return changed


def _key(function: re.Match[str]) -> tuple[str, ...]:
    """Type, name, and the types of the parameters."""
    parameters = [" ".join(parameter.split()[:-1]) for parameter in function[3].split(",")]
    return (function[1], function[2], *parameters)


def _namesakes(texts: dict[str, str], name: str) -> str:
    """Return the signatures of the functions of a name."""
    found = [each for text in texts.values() for each in _FUNCTION.finditer(text) if each[2] == name]
    signatures = sorted({f"'{each[1]} {each[2]}({each[3]})'" for each in found})
    return " and ".join(signatures) or f"no functions named {name!r}"
