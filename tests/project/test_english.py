"""English that a machine can check."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
SOURCES = sorted((REPOSITORY / "texvol").rglob("*.py"))
DIALECT = re.compile(r"\b(is|are|was) wanted\b| came\b")
DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def docstrings(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Lines and texts of all docstrings of a module."""
    for node in ast.walk(tree):
        if isinstance(node, DOCUMENTED) and (text := ast.get_docstring(node)):
            yield node.body[0].lineno, text


def errors(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Lines and texts of all that is raised or warned of."""
    for node in ast.walk(tree):
        called = getattr(node, "func", None)
        name = getattr(called, "attr", "") or getattr(called, "id", "")
        if re.search(r"(Error|Warning|Exit|^warn)$", name):
            parts = (part for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str))
            yield called.lineno, " ".join(str(part.value) for part in parts)


def found(tree: ast.AST) -> list[int]:
    """Lines of docstrings that begin with a relative clause, and of errors in dialect."""
    of_docstrings = (line for line, text in docstrings(tree) if re.match(r"(What|Whether)\b", text))
    return [*of_docstrings, *(line for line, text in errors(tree) if DIALECT.search(text))]


def test_docstrings_name_things_and_errors_are_plain() -> None:
    trees = ((path, ast.parse(path.read_text(encoding="utf-8"))) for path in SOURCES)
    assert not [f"{path.relative_to(REPOSITORY)}:{line}" for path, tree in trees for line in found(tree)]


def test_dialect_is_found() -> None:
    code = 'def f():\n  """Whether it is so."""\n  raise InputError(f"a Volume is wanted, and {x} came")'
    assert found(ast.parse(code)) == [2, 3]
    assert not found(ast.parse('"""Widths."""\nraise InputError("size must be 2, got 3")'))
