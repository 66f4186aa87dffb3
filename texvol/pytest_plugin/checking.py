"""One check of one picture, from the test's call to a pass or a failure with its reason."""

from __future__ import annotations

import os
import sys
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.comparison.judged import judged
from texvol.comparison.limits import ONE_DRIVER, Limits
from texvol.comparison.outcome import Outcome, examine, explained
from texvol.comparison.pictures import Picture
from texvol.pytest_plugin import names, options, oracle, references
from texvol.pytest_plugin.candidates import Candidate, Request, UnreadableError
from texvol.pytest_plugin.records import PictureError, Record, first
from texvol.pytest_plugin.references import Reference
from texvol.pytest_plugin.repeats import Repeats, repeats_of
from texvol.pytest_plugin.tables import Rules, Tables
from texvol.util.errors import AccuracyWarning, InputError, MissingExtraError

if TYPE_CHECKING:
    import pytest

    from texvol.pytest_plugin.session import PictureSession
    from texvol.scene.scene import Scene

_MOST_REASONS = 3  # of each list in a message; the page has the rest


class Check:
    """`check_picture` of one test; tests call `__call__`."""

    def __init__(self, item: pytest.Item, session: PictureSession) -> None:
        self._item, self._session = item, session

    def __call__(
        self,
        picture: Any,
        name: str,
        *,
        oracle: bool = False,
        repeat: int = 1,
        scene: Scene | None = None,
        driver: str | None = None,
        renderer: Any = None,
        **options: Any,
    ) -> Outcome:
        """Compare a picture with its stored reference, or with the oracle.

        Parameters
        ----------
        picture : array, path, Scene, Picture, Figure, Image, or callable that returns one of these
            An array (height, width[, 1 to 4 channels]) of floating point is linear and premultiplied; uint8 and uint16
            are sRGB, straight. A path is that of an EXR, PNG, TIFF or JPEG. A Scene is drawn, and so is a Figure of
            matplotlib. An Image is one of Pillow.
        name : str
            Name of the picture: the reference is references/NAME.exr beside the test's file.
        oracle : bool
            True to use the oracle's picture of the scene as reference, not a stored one.
        repeat : int
            Number of times that a scene or callable makes the picture, to separate noise from a systematic difference.
        scene : Scene, optional
            Scene that an array or a file shows, for `oracle`.
        driver : str, optional
            Driver that drew an array, or a file without a driver in its header.
        renderer : Renderer, optional
            Renderer for a scene; by default one that all tests share.
        **options
            Options of `Renderer.render` for scenes: `size` (128 × 128), `sampling_rate`, `max_error`, …

        Returns
        -------
        Outcome

        Raises
        ------
        PictureError
            An AssertionError: the picture is different, broken or new.
        InputError
            If an argument, the limits or the reference's folder is wrong.
        """
        __tracebackhide__ = True
        where = sys._getframe(1)
        position = (where.f_code.co_filename, where.f_lineno)
        names.check(name)
        request = Request(name, repeat, driver, scene, renderer, options)
        return _Run(self._item, self._session, request, position).outcome_of(picture, against_oracle=oracle)


class _Run:
    """One check while it runs."""

    def __init__(self, item: pytest.Item, session: PictureSession, request: Request, position: tuple[str, int]) -> None:
        self._item, self._session, self._request, self._position = item, session, request, position
        self._name, self._test = request.name, item.nodeid
        self._folder = names.references_of(item.path, item.config)
        self._limits_file = names.limits_of(self._folder, item.config)
        self._reference = Reference(self._folder / f"{self._name}.exr", False)
        self._key = names.name_key(self._folder, self._name)
        self._is_against_oracle = False

    def outcome_of(self, thing: Any, *, against_oracle: bool) -> Outcome:
        """Return the outcome of the check and report it to the session, or raise its failure."""
        __tracebackhide__ = True
        self._is_against_oracle = against_oracle
        try:
            self._session.claims.claim(self._key, self._name, self._test)
            if against_oracle:
                return self._held_against_oracle(thing)
            return self._held_against_stored(thing)
        except UnreadableError as error:
            lines = [f"picture {self._name!r} is broken", str(error)]
            self._keep("broken", lines)
            raise PictureError("\n".join(lines), "broken") from None
        except (InputError, MissingExtraError) as error:
            if isinstance(error, names.SharedNameError) and options.updates(self._item.config):
                self._session.pending.refuse(self._key, str(error))
            self._keep("refused", [str(error)])
            if callable(thing):
                raise  # may be the test's own error
            raise type(error)(str(error)) from None

    def _held_against_oracle(self, thing: Any) -> Outcome:
        __tracebackhide__ = True
        if self._name in Tables.read(self._limits_file).tables:
            raise InputError(
                f"{self._limits_file}: [{self._name}] has no effect on a picture with oracle=True; remove the table"
            )
        accuracy = {key: self._request.options[key] for key in oracle.ACCURACY if key in self._request.options}
        candidate = self._session.maker.candidate(thing, replace(self._request, of_any=oracle.ACCURACY))
        outcome = oracle.examined(candidate, accuracy, self._session.maker, self._name)
        outcome = self._told(candidate, outcome, "the oracle")
        if words := oracle.loose_words(outcome):
            warnings.warn_explicit(words, AccuracyWarning, *self._position)
        return outcome

    def _held_against_stored(self, thing: Any) -> Outcome:
        __tracebackhide__ = True
        rules = Tables.read(self._limits_file).rules_for(self._name)
        self._reference = references.find(self._folder, self._name)
        request = replace(self._request, drawn_as=self._reference.drawn_as)
        return self._held_against(self._session.maker.candidate(thing, request), rules)

    def _held_against(self, candidate: Candidate, rules: Rules) -> Outcome:
        __tracebackhide__ = True
        reference = self._waiting() or self._reference
        if not reference.exists:
            return self._alone(candidate, rules)
        try:
            stored = reference.read()
        except InputError as error:
            return self._alone(candidate, rules, str(error))
        try:
            limits = self._limits(rules, candidate.picture, stored)
        except InputError:
            if not self._may_write(candidate):
                raise
            found = examine(candidate.picture, stored, ONE_DRIVER, name=self._name, regions=rules.regions)
            return self._written(candidate, found, rules)
        repeats = tuple(references.like_stored(each, stored) for each in candidate.repeats)
        candidate = replace(candidate, picture=references.like_stored(candidate.picture, stored), repeats=repeats)
        outcome = self._examined(candidate, stored, limits, rules)
        if not outcome.passed and self._may_write(candidate):
            return self._written(candidate, outcome, rules)
        if not outcome.passed and self._waiting():
            self._session.pending.doubt(self._key, self._test)
        return self._told(candidate, outcome, self._said(self._reference.path))

    def _limits(self, rules: Rules, picture: Picture, stored: Picture) -> Limits:
        drivers = [references.driver_of(each.attributes) for each in (picture, stored)]
        try:
            return rules.limits(*drivers)
        except InputError as error:
            raise InputError(f"picture {self._name!r}: {error}") from None

    def _examined(self, candidate: Candidate, stored: Picture, limits: Limits, rules: Rules) -> Outcome:
        """Return the outcome of the mean of the repeats; also different if a single repeat is."""
        how: dict[str, Any] = {"explain": False, "regions": rules.regions}
        outcome = examine(candidate.picture, stored, limits, name=self._name, **how)
        for number, each in enumerate(candidate.repeats, 1):
            if outcome.passed and not (one := examine(each, stored, limits, **how)).passed:
                first = f"repeat {number} of {len(candidate.repeats)}, but not the mean of all: {one.violations[0]}"
                outcome = replace(outcome, status=one.status, violations=(first, *one.violations[1:]))
        if outcome.passed and outcome.measures is not None:
            return outcome
        # Kinds and the oracle's verdict take longer: only for failures.
        outcome = explained(outcome)
        if candidate.scene is None or outcome.status != "different":
            return outcome
        return judged(outcome, scene=candidate.scene, explain=False)

    def _alone(self, candidate: Candidate, rules: Rules, fault: str = "") -> Outcome:
        """Make the picture the reference that is missing, or unreadable by that fault, or raise its failure."""
        __tracebackhide__ = True
        picture, name = candidate.picture, self._name
        status, reason = "broken", fault
        if fault:
            lines = [f"picture {name!r} has a broken reference", fault]
        elif candidate.is_finite:
            status, reason = "new", "there is no reference yet"
            lines = [f"picture {name!r} is new: there is no reference {self._said(self._reference.path)} yet"]
        else:
            reason = examine(picture, picture, ONE_DRIVER, name=name).violations[0]
            lines = [f"picture {name!r} is broken, and has no reference", reason]
        outcome = Outcome(name, picture, picture, None, ONE_DRIVER, (reason,), status)
        if self._may_write(candidate):
            return self._written(candidate, outcome, rules)
        raise self._failed(candidate, outcome, lines, "")

    def _may_write(self, candidate: Candidate) -> bool:
        """True if the reference is to be written: at the user's request, once, and never with a NaN or an infinity."""
        return options.updates(self._item.config) and candidate.is_finite and not self._waiting()

    def _waiting(self) -> Reference | None:
        """Return the picture that becomes the reference at the end of the run, if there is one."""
        return self._session.pending.of(self._key) if options.updates(self._item.config) else None

    def _written(self, candidate: Candidate, outcome: Outcome, rules: Rules) -> Outcome:
        """Make the candidate the reference; the file is moved to its place at the end of the run."""
        __tracebackhide__ = True
        path = references.position_of(self._reference, candidate.picture)
        replaced = self._reference.path if self._reference.exists else None
        content = references.encoded(path, candidate.picture)
        if not self._session.pending.keep(self._key, path, replaced, content):
            return self._held_against(candidate, rules)  # another process has written it
        self._keep("updated", [f"wrote {self._said(path)}"], outcome, candidate)
        return outcome

    def _told(self, candidate: Candidate, outcome: Outcome, reference: str) -> Outcome:
        """Return the outcome and keep it for the report, or raise its failure."""
        __tracebackhide__ = True
        repeats = repeats_of(candidate.repeats, candidate.picture, outcome.reference)
        if not outcome.passed:
            lines = _difference(outcome, repeats.words if repeats else "")
            raise self._failed(candidate, outcome, lines, reference, repeats)
        self._keep("same", [], outcome, candidate, repeats)
        return outcome

    def _failed(
        self, candidate: Candidate, outcome: Outcome, lines: list[str], reference: str, repeats: Repeats | None = None
    ) -> PictureError:
        """Return the failure, after reporting it to the session."""
        record = self._keep(outcome.status, lines, outcome, candidate, repeats)
        lines = [*lines, *_positions(record["candidate"], reference, record["page"])]
        if not record["not_accepted"]:
            lines.append(_how_to_update(self._test))
        return PictureError("\n".join(lines), outcome.status)

    def _not_accepted(self, candidate: Candidate | None) -> str:
        """Return why the picture may not become a reference; empty if it may."""
        if self._is_against_oracle:
            return "it is held against the oracle, and has no reference"
        return "" if candidate is None or candidate.is_finite else "it must be finite, and has a NaN or an infinity"

    def _said(self, path: Path) -> str:
        """Return a path relative to the folder where pytest was started, if it is in that folder."""
        relative = os.path.relpath(path, self._item.config.invocation_params.dir)
        return str(path) if relative.startswith("..") else relative

    def _keep(
        self,
        status: str,
        lines: list[str],
        outcome: Outcome | None = None,
        candidate: Candidate | None = None,
        repeats: Repeats | None = None,
    ) -> Record:
        """Report the result to the session, and return its record."""
        record = self._record(status, lines, outcome, candidate)
        metadata = dict(record["fingerprint"])
        if repeats:
            record["repeats"] = asdict(repeats) | {"words": repeats.words}
            metadata["repeats"] = repeats.words
        if status == "updated":
            metadata["reference"] = lines[0]
        return self._session.keep(self._item, record, outcome, metadata)

    def _record(self, status: str, lines: list[str], outcome: Outcome | None, candidate: Candidate | None) -> Record:
        measures = outcome.measures if outcome else None
        picture = candidate.picture if candidate else None
        return {
            "test": self._test,
            "name": self._name,
            "file": self._position[0],
            "line": self._position[1],
            "status": status,
            "message": lines,
            "max_error": measures.max_error if measures else None,
            "rms_error": measures.rms_error if measures else None,
            "kinds": [*outcome.scene_words, *(kind.words for kind in outcome.kinds)] if outcome else [],
            "driver": references.driver_of(picture.attributes) if picture else None,
            "fingerprint": references.fingerprint_of(picture) if picture else {},
            "reference": self._said(self._reference.path),
            "limits": str(self._limits_file),
            "folder": str(self._folder),
            "key": self._key,
            "page": None,
            "candidate": None,
            "not_accepted": self._not_accepted(candidate),
            **(self._session.self_test(candidate, outcome) if candidate and outcome else {}),
        }


def _difference(outcome: Outcome, repeats: str) -> list[str]:
    """Lines on a picture that is different or broken."""
    lines = [
        f"picture {outcome.name!r} is {outcome.status}",
        *first(outcome.violations, _MOST_REASONS),
        *outcome.scene_words,
    ]
    lines += first([kind.words for kind in outcome.kinds], _MOST_REASONS)
    if outcome.measures is not None and outcome.measures.max_error > 0:
        (column, row), (ours, theirs) = outcome.measures.worst_pixel, outcome.measures.worst_values
        lines.append(f"worst pixel: column {column}, row {row}, {_rgba(ours)}, reference {_rgba(theirs)}")
    if outcome.three_way is not None:
        lines.append(outcome.three_way.words)
    lines += outcome.notes
    return [*lines, *([repeats] if repeats else [])]


def _positions(candidate: str | None, reference: str, page: str | None) -> list[str]:
    """Lines with the paths of candidate, reference and page."""
    found = {"candidate": candidate, "reference": reference, "page": page}
    return [f"{what + ':':11}{position}" for what, position in found.items() if position]


def _how_to_update(test: str) -> str:
    """Line with the command that makes the candidate the reference."""
    quoted = f"'{test}'" if any(each in test for each in " []()") else test
    return f"look at the candidate, and if it is right: pytest --texvol-update {quoted}"


def _rgba(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{each:.4g}" for each in values) + ")"
