"""`texvol surface`: the isosurface of a volume as a mesh file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from texvol.cli.common import add_spacing
from texvol.options import reading as reading_options
from texvol.options import texts
from texvol.util.terminal import say


def add_surface(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("surface", help="the isosurface of a volume as a mesh")
    reading_options.add_volume_options(parser)
    add_spacing(parser)
    parser.add_argument("--value", type=texts.number, metavar="V", required=True, help="isovalue, data units")
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="mesh: .ply, .stl, .obj or .vtp")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Extract the isosurface, write the mesh and print its size."""
    from texvol import geometry
    from texvol.geometry import saving

    saving.check_writable(arguments.output)
    volume = reading_options.load_volume(arguments, arguments.spacing)
    mesh = geometry.surface_of(volume, arguments.value)
    geometry.save_mesh(mesh, arguments.output)
    say(f"{Path(arguments.output).resolve()}: {len(mesh.triangles)} triangles, {len(mesh.vertices)} vertices")
