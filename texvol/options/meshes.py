"""The option --mesh: files of meshes, with colour and opacity."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from texvol.geometry import load_mesh
from texvol.options import texts
from texvol.scene.shapes import Mesh

_LOOK = rf"(?::(?P<color>{texts.NUMBER},{texts.NUMBER},{texts.NUMBER}))?(?::(?P<opacity>{texts.NUMBER}))?"


class MeshChoice(NamedTuple):
    """File of a mesh, with a colour (linear RGB) and an opacity that replace those of the file."""

    path: str
    color: tuple[float, float, float] | None = None
    opacity: float = 1.0


def mesh(text: str) -> MeshChoice:
    """Return the choice of "FILE", "FILE:R,G,B", "FILE:OPACITY" or "FILE:R,G,B:OPACITY"."""
    path, look = texts.file_and_look(text, _LOOK, "FILE[:R,G,B][:OPACITY]")
    color = tuple(map(float, look["color"].split(","))) if "color" in look else None
    return _checked(MeshChoice(path, color, float(look.get("opacity", 1))))  # type: ignore[arg-type]


def mesh_table(table: Mapping[str, Any]) -> MeshChoice:
    """Return the choice of a scene file's {file = …, color = [R, G, B], opacity = A}."""
    color, opacity = table.get("color"), table.get("opacity", 1.0)
    is_color = color is None or texts.are_numbers(color, 3)
    is_mesh = isinstance(table.get("file"), str) and is_color and texts.is_number(opacity)
    if not is_mesh or set(table) - {"file", "color", "opacity"}:
        raise argparse.ArgumentTypeError(
            f"must be {{file = FILE, color = [R, G, B], opacity = A}}, got {dict(table)!r}"
        )
    return _checked(MeshChoice(table["file"], None if color is None else tuple(map(float, color)), float(opacity)))  # type: ignore[arg-type]


def meshes(choices: Iterable[MeshChoice]) -> tuple[Mesh, ...]:
    """Return the meshes of the files."""
    return tuple(load_mesh(each.path, color=each.color, opacity=each.opacity) for each in choices)


def _checked(choice: MeshChoice) -> MeshChoice:
    if not 0 < choice.opacity <= 1:
        raise argparse.ArgumentTypeError(f"opacity must be over 0 and at most 1, got {choice.opacity:g}")
    if choice.color is not None and not all(0 <= each <= 1 for each in choice.color):
        raise argparse.ArgumentTypeError(f"colour must be three numbers in [0, 1], got {choice.color}")
    return choice
