"""Candidates of a report that become references: chosen, checked, and written all or none.

The report may come from another machine. References are written below one folder, the project's, and nowhere else;
candidates are files in the report's folder.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from texvol.comparison.ci import FAILING
from texvol.comparison.pictures import read_picture
from texvol.comparison.runs.stored import Run
from texvol.pytest_plugin import names, references
from texvol.pytest_plugin.references import Reference
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.shown_text import shown_line
from texvol.util.suggestions import did_you_mean


@dataclass(frozen=True)
class Offer:
    """A failed picture of a report whose candidate may become the reference.

    `id` is its name, or the candidate's path in the report if several pictures of the report have that name.
    `not_accepted` says why it may not; empty if it may.
    """

    id: str
    name: str
    status: str
    reference: str
    candidate: Path
    not_accepted: str = ""


def ids_of(pictures: Sequence[Any]) -> dict[int, str]:
    """Return the id of each record that failed and has a candidate, by its number in the report."""
    with_candidate = {
        number: each for number, each in enumerate(pictures) if each["status"] in FAILING and each.get("candidate")
    }
    known = [each["name"] for each in with_candidate.values()]
    return {
        number: each["name"] if known.count(each["name"]) == 1 else each["candidate"]
        for number, each in with_candidate.items()
    }


def offers_of(run: Run) -> dict[str, Offer]:
    """Return what can be accepted, by id, in the report's order; candidates that are not in the folder are left out."""
    found = {}
    for number, key in ids_of(run.pictures).items():
        record = run.pictures[number]
        if (candidate := run.path(record["candidate"])) is not None:
            status, reason = record["status"], str(record.get("not_accepted") or "")
            found[key] = Offer(key, record["name"], status, record["reference"], candidate, reason)
    return found


def chosen(offers: dict[str, Offer], wanted: Iterable[str]) -> list[Offer]:
    """Return the offers of these ids, each once.

    Raises
    ------
    InputError
        If an id is not on offer, or its picture may not become a reference.
    """
    found = {}
    for key in wanted:
        if key not in offers:
            several = [offer.id for offer in offers.values() if offer.name == key]
            if several:
                raise InputError(f"picture {key!r} is in the report several times; choose one of {', '.join(several)}")
            near = did_you_mean(key, list(offers))
            raise InputError(f"picture {key!r} not found among the failed pictures of the report{near}")
        if offers[key].not_accepted:
            raise InputError(f"picture {key!r} cannot be accepted: {shown_line(offers[key].not_accepted)}")
        found[key] = offers[key]
    return list(found.values())


def accept(offers: Sequence[Offer], root: str | os.PathLike[str]) -> list[str]:
    """Make the candidates the references, all or none, and return a line for each.

    Parameters
    ----------
    root : path
        Folder of the project, where the tests were started: references are below it.

    Raises
    ------
    InputError
        If a reference would be outside of `root`, two candidates have one reference, a candidate is not finite, or a
        file can't be read or written. Then no reference is changed.
    """
    contents: dict[str | os.PathLike[str], bytes] = {}
    replaced: list[Path] = []
    lines = []
    for offer in offers:
        old = _reference(offer, Path(root))
        picture = _candidate(offer)
        target = references.position_of(old, picture)
        if target in contents:
            raise InputError(f"{target}: must have one candidate, got {offer.id} and another; accept one of them")
        same_format = target.suffix.lower() == offer.candidate.suffix.lower()
        contents[target] = offer.candidate.read_bytes() if same_format else references.encoded(target, picture)
        replaced += [old.path] if old.exists and old.path != target else []
        lines.append(f"{offer.name}: {'replaced' if old.exists else 'wrote'} {target}")
    try:
        for target in map(Path, contents):
            target.parent.mkdir(parents=True, exist_ok=True)
        writing.write_files(contents)
        for path in replaced:
            path.unlink()
    except OSError as error:
        raise InputError(f"{error.filename}: cannot be written or replaced: {error.strerror}") from None
    return lines


def _reference(offer: Offer, root: Path) -> Reference:
    """Return the reference that a candidate replaces; InputError if it is not a picture below `root`."""
    names.check(offer.name)
    path = root / offer.reference
    if path.suffix.lower() not in references.SUFFIXES or not path.as_posix().endswith(f"/{offer.name}{path.suffix}"):
        raise InputError(f"reference of picture {offer.name!r} must have its name, got {offer.reference!r}")
    place, home = os.path.realpath(path), os.path.realpath(root)
    if not place.startswith(home.rstrip(os.sep) + os.sep):
        raise InputError(
            f"{offer.reference}: the reference must be below {home}; run this in the folder where the tests were "
            "started, or name it by --root"
        )
    # The project may have another format by now.
    found = references.find(path.parent, path.stem)
    if offer.status == "different" and not found.exists:
        raise InputError(f"{path}: the reference that is replaced must exist; name the project's folder by --root")
    return found


def _candidate(offer: Offer) -> Any:
    picture = read_picture(offer.candidate)
    if references.FINGERPRINT_ATTRIBUTE not in picture.attributes:
        raise InputError(f"{offer.candidate}: must be a candidate of pytest --texvol-report, has no fingerprint")
    if not np.isfinite(picture.pixels).all():
        raise InputError(f"picture {offer.name!r} must be finite to become a reference, has a NaN or an infinity")
    return picture
