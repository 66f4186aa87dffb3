"""Selection of the hypotheses that explain a difference: those that undo most of it, the simplest first.

The difference that a kind leaves is explained in turn, as long as it exceeds rounding. A kind has to undo most of the
difference, or to be followed by a kind that explains the rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from operator import itemgetter

import numpy as np
from numpy.typing import NDArray

from texvol.comparison.kinds import edges, end_slabs, gamma, geometry, levels, light, opacity, order, posterised
from texvol.comparison.kinds.isolated import isolated
from texvol.comparison.kinds.kind import CHANNELS, Change, Finding, Kind, goes_with, number
from texvol.comparison.kinds.noise import MOST_GAUSSIAN, noise
from texvol.comparison.kinds.pair import Pair

MOST_KINDS = 3
# Fractions of the squared difference: of an explanation, of an explanation if another explains the rest, and of an
# explanation for which no better one is looked for.
_EXPLAINS, _HELPS, _COMPLETE = 0.8, 0.2, 0.98
# A fitted parameter costs a tenth of the rest; scores within a fiftieth are equal.
_PER_NUMBER, _AS_WELL = 0.1, 1.02
_NOTHING = 1e-9  # of the squared difference; encodings in float32 leave 1e-12
# A superfluous second change undoes a little, too: a second change must undo most of the rest.
_SECOND = 0.2
_CURVE = 0.95  # a curve of any form fits a little of everything
_STARTS = 3  # first changes of a chain of two that are tried
_ALONE = 0.5
_SPARSE = 0.2  # of the pixels; fewer differing pixels may be outlines
_FEW_STEPS = 2.0  # a larger distance may have any cause
_BOX = 0.9  # of an unexplained difference, in the columns and rows that are named
_score = itemgetter(0)
_NEVER_UNDONE = ("noise", "edges only", "swapped order", "banding", "unexplained")


@dataclass(frozen=True)
class Found:
    """Chain of findings, each of the rest that the one before leaves, and alternatives to the first."""

    chain: tuple[Finding, ...]
    alternatives: tuple[Finding, ...] = ()
    is_proven: bool = False  # whatever fraction it explains

    @property
    def explained(self) -> float:
        """Fraction that the whole chain explains."""
        return sum(each.kind.explained for each in self.chain)

    @property
    def is_rounded(self) -> bool:
        """True if the first finding is banding."""
        return self.chain[0].kind.name == "banding"

    @property
    def left(self) -> Pair:
        """Pair that the last finding leaves."""
        return self.chain[-1].left

    def kinds(self, fraction: float = 1.0) -> list[Kind]:
        """Return the kinds, and the alternatives, of a difference that is a fraction of the whole difference."""
        alternatives = [_in_all(each.kind, fraction) for each in self.alternatives]
        return [
            *(_in_all(each.kind, fraction) for each in self.chain),
            *(replace(each, words=f"or, as likely: {each.words}") for each in alternatives),
        ]


def explain(pair: Pair) -> list[Kind]:
    """Return at most three kinds that together explain the pair's difference, and equally good alternatives."""
    kinds: list[Kind] = []
    fraction, left = 1.0, pair
    while len(kinds) < MOST_KINDS and not left.is_rounding and left.total > _NOTHING * pair.total:
        if kinds and (left.is_within_allowance or left.is_format):
            break
        found = _next(left, {kind.name for kind in kinds})
        if found is None:
            break
        kinds += found.kinds(fraction)
        if kinds[-1].name == "unexplained":
            break
        fraction *= max(0.0, 1 - found.explained)
        left = found.left
    return kinds[:MOST_KINDS]


def explain_systematic(pair: Pair) -> list[Kind]:
    """Return the kinds of a difference of the size of rounding that follow the content, as rounding does not."""
    ranked = [each for each in (*_pixelwise(pair), *_elsewhere(pair)) if not each.is_rounded]
    ranked = [each for each in ranked if each.explained >= _EXPLAINS and goes_with(pair, each.left)]
    if not ranked:
        return []
    return max(ranked, key=lambda each: each.explained).kinds()[:MOST_KINDS]


def _next(pair: Pair, before: set[str]) -> Found | None:
    """Return the best explanation of the difference that the kinds `before` left."""
    alone = isolated(pair, pair.beyond) if "isolated pixels" not in before else None
    if alone is not None and alone.kind.explained >= _ALONE:
        return Found((alone,))
    few = posterised.posterised(pair) if "banding" not in before else None
    if few is not None:
        return Found((few,))
    ranked = _pixelwise(pair)
    if ranked and ranked[0].explained >= _COMPLETE:
        return ranked[0]
    if "scaled opacity" in before:
        # The rest is absorption in a medium of several colours, which no change of single pixels describes.
        return next((each for each in ranked if each.is_rounded and each.explained >= _EXPLAINS), None)
    proven = next((each for each in ranked if each.is_proven), None)
    if proven is not None:
        return proven
    if "shifted" not in before:
        ranked += _elsewhere(pair)
    ranked.sort(key=lambda each: -each.explained)
    if ranked and (ranked[0].explained >= _EXPLAINS or ranked[0].chain[0].kind.name == "shifted"):
        return ranked[0]
    described = _described(pair, before)
    if described is not None:
        return described
    for each in ranked:
        rest = _rest(each) if each.explained >= _HELPS else None
        if rest is not None:
            return rest
    return Found((_unexplained(pair),)) if not before else None


def _pixelwise(pair: Pair) -> list[Found]:
    """Return changes of each pixel by itself, one or two in a chain, best first, measured on all pixels."""
    sample = pair.sample
    tried = _tried(sample, levels.changes(sample))
    if not tried or tried[0][0] > 1 - _COMPLETE:
        tried = sorted([*tried, *_tried(sample, _changes(sample))], key=_score)
    if not tried:
        return []
    score, change = tried[0]
    if score > 1 - _COMPLETE:
        two = _two(sample, tried)
        if two is not None and two[0] < min(_SECOND * score, 1 - _CURVE):
            return [_measured(pair, two[1])]
        if score > 1 - _CURVE:
            curve = _tried(sample, gamma.tone_curves(sample))
            if curve and curve[0][0] < _SECOND * score:
                return [_measured(pair, (curve[0][1],))]
    proven = [c for _, c in tried if c.name == "scaled opacity" and opacity.proves(sample, c)]
    if proven and score > 1 - _COMPLETE:
        return [replace(_measured(pair, (proven[0],)), is_proven=True)]
    if score > 1 - _HELPS / 2:
        return []
    found = _measured(pair, (change,))
    alike = {c.name: c for s, c in tried[:0:-1] if c.name != change.name and s <= _AS_WELL * score + _NOTHING}
    others = alike.values() if found.explained >= _EXPLAINS else ()
    first = Found(found.chain, tuple(_measured(pair, (c,)).chain[0] for c in others))
    others_that_help = [c for s, c in tried[1:] if s < 1 - _HELPS and c.name != change.name][:2]
    weaker = others_that_help if score > 1 - _EXPLAINS else []
    return [first, *(_measured(pair, (c,)) for c in weaker)]


def _two(sample: Pair, tried: list[tuple[float, Change]]) -> tuple[float, tuple[Change, Change]] | None:
    """Return the best chain of two changes and its score."""
    chains = []
    for score, first in tried[:_STARTS]:
        if score > 1 - _HELPS / 2:
            break
        after = first.undone(sample)
        for _, second in _tried(after, _changes(after))[:1]:
            if second.name != first.name:
                left = 1 - sample.explained_by(second.undone(after))
                chains.append((left * (1 + _PER_NUMBER * (first.fitted + second.fitted)), (first, second)))
    return min(chains, key=_score, default=None)


def _tried(sample: Pair, changes: Iterable[Change]) -> list[tuple[float, Change]]:
    """Return (score, change), best first, of the changes that undo a part of a sample's difference.

    The score is the fraction that is left, plus a little for each fitted parameter.
    """
    scored = []
    for change in changes:
        explained = change.explained(sample)
        if explained > 0:
            scored.append(((1 - explained) * (1 + _PER_NUMBER * change.fitted), change))
    return sorted(scored, key=_score)


def _changes(sample: Pair) -> Iterator[Change]:
    yield from gamma.changes(sample)
    yield from opacity.changes(sample)
    yield from light.changes(sample)


def _measured(pair: Pair, chain: tuple[Change, ...]) -> Found:
    """Undo the changes in all pixels, one after another."""
    findings, left, before = [], pair, 0.0
    for change in chain:
        left = change.undone(left)
        explained = pair.explained_by(left)
        kind = Kind(change.name, explained - before, change.words, change.parameters)
        findings.append(Finding(kind, left))
        before = explained
    return Found(tuple(findings))


def _elsewhere(pair: Pair) -> list[Found]:
    found = [Found((each,)) for each in geometry.flips(pair)]
    if not any(each.explained >= _COMPLETE for each in found):
        shift = geometry.shift(pair)
        found += [Found((shift,))] if shift is not None else []
    best = max(found, key=lambda each: each.explained, default=None)
    if best is None:
        return []
    alike = [f for f in found if f is not best and 1 - f.explained <= _AS_WELL * (1 - best.explained) + _NOTHING]
    return [Found(best.chain, tuple(f.chain[0] for f in alike))]


def _described(pair: Pair, before: set[str]) -> Found | None:
    """Return kinds that are recognised by their traits and cannot be undone."""
    rounded = levels.off_by_steps(pair, _FEW_STEPS)
    if rounded is not None:
        return Found((rounded,))
    random = noise(pair)
    if random is not None and random.kind.parameters["share"] < _SPARSE:
        outlines = edges.edges(pair)
        if outlines is not None and outlines.kind.explained >= _EXPLAINS:
            return Found((outlines,))
    if random is not None or "brightness" not in before:
        dimmed = _dimmed_before_noise(pair, random)
        if dimmed is not None:
            return dimmed
    if random is not None:
        alone = isolated(pair) if "isolated pixels" not in before else None
        rest = noise(alone.left) if alone is not None else None
        # In noise that is even everywhere, a pixel that stands out is an isolated pixel.
        if alone is not None and rest is not None and rest.kind.parameters["kurtosis"] < MOST_GAUSSIAN:
            return Found((rest, replace(alone, left=random.left)))
        return Found((random,))
    if "shifted" in before:
        return None  # the rest of resampling
    for describe in (order.swapped, end_slabs.unclipped, edges.blur, edges.edges):
        finding = describe(pair)
        if finding is not None and finding.kind.explained >= _EXPLAINS:
            return Found((finding,))
    return None


def _dimmed_before_noise(pair: Pair, random: Finding | None) -> Found | None:
    """Return a brightness and the noise that hides most of it: the factor follows the content, noise does not."""
    change = light.dimmed(pair)
    if change is None:
        return None
    found = _measured(pair, (change,)).chain[0]
    if not goes_with(pair, found.left):
        return None
    rest = noise(found.left)
    if rest is None or rest.kind.parameters["share"] < _SPARSE:
        return None
    fraction = found.kind.explained
    after = replace(rest, kind=replace(rest.kind, explained=(1 - fraction) * rest.kind.explained))
    chain = (found, after) if fraction > 0.5 else (replace(after, left=found.left), replace(found, left=after.left))
    return Found(chain)


def _rest(found: Found) -> Found | None:
    """Return the chain followed by a finding that explains the rest; None if none does."""
    left = found.left
    if left.is_rounding:
        return found
    fraction = 1 - found.explained
    random = noise(left)
    follower = Found((random,)) if random is not None else next(iter(_pixelwise(left)), None)
    if follower is None or follower.explained < 0.9:
        return None
    last = follower.chain[0]
    kind = replace(last.kind, explained=fraction * last.kind.explained)
    return Found((*found.chain, replace(last, kind=kind)))


def _in_all(kind: Kind, fraction: float) -> Kind:
    """Return the kind with its fraction of the whole difference, and with words on the part that it leaves."""
    words = kind.words
    if kind.name not in _NEVER_UNDONE and kind.explained < _CURVE:
        words += f"; this explains {100 * _fraction(kind.explained):.0f} % of the squared difference"
    return replace(kind, explained=_fraction(fraction * kind.explained), words=words)


def _fraction(explained: float) -> float:
    return min(1.0, max(0.0, explained))


def _unexplained(pair: Pair) -> Finding:
    """Return the position, channel and sign of a difference of no known kind."""
    left, top, right, bottom = _box(pair.energy)
    of_channels = np.square(pair.difference / max(pair.largest, 1e-30), dtype=np.float64).sum(axis=(0, 1))
    channel = int(of_channels.argmax())
    part = float(of_channels[channel] / max(of_channels.sum(), 1e-300))
    mean = float(pair.difference[..., channel].mean(dtype=np.float64))
    corner = pair.corner
    box = (left + corner[0], top + corner[1], right + corner[0], bottom + corner[1])
    which = f"mostly in {CHANNELS[channel]}" if part > 0.5 else "in several channels"
    more = ("brighter" if mean > 0 else "darker") if channel < 3 else ("more" if mean > 0 else "less")
    words = (
        f"of no known kind: 90 % of it lies in columns {box[0]} to {box[2]}, rows {box[1]} to {box[3]}, {which}; "
        f"on average the candidate's {CHANNELS[channel]} is {more}, by {number(abs(mean))}"
    )
    parameters = {"box": list(box), "channel": CHANNELS[channel], "share_of_channel": part, "mean": mean}
    return Finding(Kind("unexplained", 0.0, words, parameters), pair)


def _box(energy: NDArray) -> tuple[int, int, int, int]:
    """Return (left, top, right, bottom), inclusive, of the middle 90 % along each axis."""
    ends = []
    for axis in (0, 1):
        along = energy.sum(axis=axis, dtype=np.float64)
        fraction = np.cumsum(along) / max(along.sum(), 1e-300)
        # Four tails, which together hold the rest.
        tail = (1 - _BOX) / 4
        ends.append((int(np.searchsorted(fraction, tail)), int(np.searchsorted(fraction, 1 - tail))))
    (left, right), (top, bottom) = ends
    return left, top, min(right, energy.shape[1] - 1), min(bottom, energy.shape[0] - 1)
