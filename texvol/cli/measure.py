"""`texvol measure`: values of rulers, angles, boxes and profiles, and volumes of labels, as CSV."""

from __future__ import annotations

import argparse
from typing import Any

from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.terminal import say


def add_measure(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "measure",
        help="lengths, angles, statistics of boxes, profiles and volumes of labels, as CSV",
        description="Prints the values of each --measure, and of those in the scene file: lengths and angles; volume "
        "of a box, and mean, standard deviation, least and greatest value of each volume's samples inside; values "
        "along a profile. Then the number of samples and the volume of each label, for volumes of labels. Numbers are "
        "in world units and units of the data; masks and cuts hide nothing from them.",
    )
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    parser.add_argument(
        "-o", "--output", type=texts.file_name, metavar="FILE.csv", help="write the table to a file (standard output)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Measure, and print or write the table."""
    scene_options = options.SceneOptions(arguments)
    if arguments.output is not None:
        writing.check_writable(arguments.output)
        writing.check_apart({"--output": arguments.output}, (scene_options.volume, arguments.scene))
    measures = scene_options.annotation.measures
    volumes = scene_options.volumes()
    if not measures and not any(volume.labels for volume in volumes):
        raise InputError(
            "nothing to measure: give --measure, such as --measure 'ruler 0,0,0 10,0,0', or a scene file with "
            "measures, or a volume of labels"
        )
    from texvol.scene.measures.table import csv_of
    from texvol.scene.measures.values import measure, measured_labels

    table = csv_of([*measure(volumes, measures), *measured_labels(volumes)], volumes[0].unit)
    if arguments.output is None:
        say(table.rstrip("\n"))
    else:
        writing.write_files({arguments.output: table.encode()})
        say(f"{arguments.output}: {len(table.splitlines()) - 1} values")
