"""`texvol surface`: the isosurface of a volume as a mesh file, or as points."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from texvol.cli.common import add_spacing
from texvol.options import reading as reading_options
from texvol.options import texts
from texvol.util.errors import InputError
from texvol.util.terminal import say

_METHODS = ("marching-cubes", "marching-tetrahedra", "cuberille", "dividing-cubes", "contours")


def add_surface(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("surface", help="the isosurface of a volume as a mesh")
    reading_options.add_volume_options(parser)
    add_spacing(parser)
    parser.add_argument("--value", type=texts.number, metavar="V", required=True, help="isovalue, data units")
    parser.add_argument(
        "--method", choices=_METHODS, default=_METHODS[0], help="how it is extracted (marching-cubes); see `surfaces`"
    )
    parser.add_argument(
        "--cell-size", type=texts.number, metavar="L", help="dividing-cubes: longest side of a part (spacing / 2)"
    )
    parser.add_argument("-o", "--output", metavar="FILE", required=True, help="mesh: .ply, .stl, .obj or .vtp")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Extract the isosurface, write it and print its size and topology."""
    from texvol import geometry
    from texvol.geometry import saving
    from texvol.geometry.extraction import ambiguous_cell_count
    from texvol.geometry.measures import topology_of

    _check_cell_size(arguments)
    saving.check_writable(arguments.output, points=arguments.method == "dividing-cubes")
    volume = reading_options.load_volume(arguments, arguments.spacing)
    surface = geometry.surface_of(volume, arguments.value, arguments.method, cell_size=arguments.cell_size)
    geometry.save_mesh(surface, arguments.output)
    name = Path(arguments.output).resolve()
    ambiguous = ambiguous_cell_count(volume, arguments.value)
    cells = f"{ambiguous} ambiguous cell{'' if ambiguous == 1 else 's'}"
    if isinstance(surface, geometry.Points):
        say(f"{name}: {len(surface.points)} points")
        say(f"{arguments.method}: {cells}")
    else:
        say(f"{name}: {len(surface.triangles)} triangles, {len(surface.vertices)} vertices")
        found = topology_of(surface)
        say(
            f"{arguments.method}: Euler number {found.euler_number}, {'closed' if found.is_closed else 'open'}, {cells}"
        )


def _check_cell_size(arguments: argparse.Namespace) -> None:
    size = arguments.cell_size
    if size is None:
        return
    if arguments.method != "dividing-cubes":
        raise InputError(f"--cell-size is for --method dividing-cubes only, got {arguments.method}")
    if not 0 < size < float("inf"):
        raise InputError(f"--cell-size must be a finite number above 0, got {size:g}")
