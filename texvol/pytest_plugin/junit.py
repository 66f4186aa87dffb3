"""Attachments in a JUnit file: properties of a test case, which pytest writes, become lines of its output.

A pytest plugin cannot write `system-out`, so the file is changed after pytest has written it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from texvol.comparison.ci import attachment

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

PROPERTY = "texvol_attachment"


def add_attachments(path: Path) -> None:
    """Move the attachments of each test case from its properties to its output.

    Raises
    ------
    InputError
        If the file can't be written.
    """
    from xml.etree import ElementTree

    from texvol.util import writing

    try:
        tree = ElementTree.parse(path)
    except (OSError, ElementTree.ParseError):
        return  # pytest wrote none
    changed = False
    for case in tree.iter("testcase"):
        lines = [attachment(file) for file in _taken(case)]
        if lines:
            output = case.find("system-out")
            output = ElementTree.SubElement(case, "system-out") if output is None else output
            output.text = "\n".join([*([output.text] if output.text else []), *lines, ""])
            changed = True
    if changed:
        content = ElementTree.tostring(tree.getroot(), encoding="utf-8", xml_declaration=True)
        writing.write_files({path: content})


def _taken(case: Element) -> Iterator[str]:
    """Remove the attachments from the properties of a test case, and yield them."""
    for properties in case.findall("properties"):
        for each in [each for each in properties if each.get("name") == PROPERTY]:
            properties.remove(each)
            yield each.get("value", "")
