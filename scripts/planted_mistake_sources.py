"""Finds where a mistake belongs in a source tree, and makes the texts of the files that have it."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from texvol.comparison.wrong_functions import with_wrong_function


@dataclass(frozen=True)
class Mistake:
    """A mistake in one function.

    Attributes
    ----------
    where : str
        Package of texvol, or "shaders".
    function : str
        In Python `name`, `Class.name`, or `module:name` where several modules of the package have such a function. In
        a shader the signature of the function; or the name of a file, for what is no function.
    old, new : str
        Text that stands in the function, or file, exactly once, and what replaces it. Without `old`, `new` is the
        body of a wrong function of a shader.
    words : str
        The mistake in words.
    tests : str
        Names of test files, and options of pytest; a variable of the environment, such as A=1, may stand before them.
    """

    where: str
    function: str
    old: str
    new: str
    words: str
    tests: str

    @property
    def place(self) -> str:
        """Package and function."""
        return f"{self.where}: {self.function}"

    def __str__(self) -> str:
        return f"{self.place}: {self.words}"


class DoesNotFitError(Exception):
    """The source has no such function, or the text is not in it exactly once."""


def changed_files(tree: Path, mistake: Mistake) -> dict[Path, str]:
    """Texts of the files of a source tree that a mistake changes.

    Raises
    ------
    DoesNotFitError, ShaderError
        If the function is not there, or its text is another one.
    """
    if mistake.where == "shaders":
        return _changed_shaders(tree / "shaders", mistake)
    path, first, last = _python_function(tree / "texvol" / mistake.where, mistake)
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    function = _replaced("".join(lines[first:last]), mistake)
    text = "".join(lines[:first]) + function + "".join(lines[last:])
    ast.parse(text)
    return {path: text}


def uncovered(tree: Path, mistakes: Iterable[Mistake]) -> list[str]:
    """Packages and shader files in which no mistake is planted."""
    changed = {path for mistake in mistakes for path in changed_files(tree, mistake)}
    packages = [each for each in (tree / "texvol").iterdir() if (each / "__init__.py").is_file()]
    left = [folder for folder in packages if not any(folder in path.parents for path in changed)]
    left += [path for path in (tree / "shaders").iterdir() if path not in changed]
    return sorted(str(each.relative_to(tree)) for each in left)


def _changed_shaders(folder: Path, mistake: Mistake) -> dict[Path, str]:
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.is_file()}
    if not mistake.old:
        changed = with_wrong_function(texts, mistake.function, mistake.new)
    elif mistake.function in texts:
        changed = {mistake.function: _replaced(texts[mistake.function], mistake)}
    else:
        raise DoesNotFitError(f"{mistake}: shaders/ has no file {mistake.function}")
    return {folder / name: text for name, text in changed.items()}


def _replaced(text: str, mistake: Mistake) -> str:
    count = text.count(mistake.old)
    if count != 1:
        raise DoesNotFitError(f"{mistake}: the function has {count} times, and not once: {mistake.old}")
    return text.replace(mistake.old, mistake.new)


def _python_function(package: Path, mistake: Mistake) -> tuple[Path, int, int]:
    """File of the function, its first line, from 0 on, and the line behind its last."""
    module, _, name = mistake.function.rpartition(":")
    found = [
        (path, first, last)
        for path in sorted(package.rglob(f"{module or '*'}.py"))
        for each, first, last in _functions(path.read_text(encoding="utf-8"))
        if each == name
    ]
    if len(found) != 1:
        places = ", ".join(str(path.relative_to(package)) for path, _, _ in found) or "none"
        raise DoesNotFitError(f"{mistake}: one function of that name must be in the package, found {places}")
    return found[0]


@lru_cache(None)  # many mistakes are in one package, and each is looked for in all its modules
def _functions(source: str) -> tuple[tuple[str, int, int], ...]:
    """Names of functions and classes, such as Class.method, each with its first line, from 0 on, and the one behind."""
    return tuple(_inside(ast.parse(source), ""))


def _inside(scope: ast.AST, prefix: str) -> Iterator[tuple[str, int, int]]:
    for each in ast.iter_child_nodes(scope):
        if isinstance(each, ast.FunctionDef | ast.ClassDef):
            yield prefix + each.name, each.lineno - 1, each.end_lineno or 0
            yield from _inside(each, f"{prefix}{each.name}.")
