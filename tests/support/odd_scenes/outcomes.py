"""Random scenes, each as odd as it gets, held against the oracle: was the error what the renderer said it was?

    python scripts/odd_scenes.py [--count N] [--far-off] [--seed N] [-o FILE.jsonl]
    python scripts/odd_scenes.py --only N … [--far-off]

A scene is an outlier where its picture is farther from the oracle than LOOSE times the estimate or what was wanted, and
farther than FLOOR of the size of its numbers. Where the renderer said so, by its estimate or by a warning, the estimate
knew; else it did not. FILE has a line for each scene; those that it has are not drawn again. Exit status 1 if there is
an outlier of which nothing was said, or a scene ended in an error that is none of texvol's.
"""

from __future__ import annotations

import argparse
import json
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.odd_scenes.scenes import OddScene, odd_scene
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.util.errors import TexvolError

# Estimates at a fixed thickness come from a sixteenth of the pixels, here 8 x 8, which pass over what lies between.
LOOSE = 3.0
FLOOR = 0.01
WITHIN, KNEW, UNKNOWN, REFUSED, FAILED = "within", "knew", "did not know", "refused", "failed"
VERDICTS = (WITHIN, KNEW, UNKNOWN, REFUSED, FAILED)


def outcome(odd: OddScene, renderer: Renderer) -> dict[str, Any]:
    """Error and estimate of a scene, and a verdict on them."""
    begin = time.perf_counter()
    found: dict[str, Any] = {"number": odd.number, "words": list(odd.words)}
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            picture = renderer.render(odd.scene, odd.size, **odd.options)
            stats = dict(renderer.stats)
        found["said"] = [" ".join(str(each.message).split()) for each in caught]
        found["drawn"] = round(time.perf_counter() - begin, 3)
        truth = raycast(odd.scene, odd.size)
    except TexvolError as error:
        return found | {"verdict": REFUSED, "said": [str(error)]}
    except Exception:
        return found | {"verdict": FAILED, "said": [traceback.format_exc()]}
    off, scale = differences(picture, truth), size_of(truth)
    bound = odd.options.get("max_error", FLOOR * scale)
    found |= {"error": float(off.max()), "scale": scale, "pixels": int((off > bound).any(axis=2).sum())}
    estimate = stats["estimated_error"]
    found |= {"estimate": None if estimate is None else float(estimate)}
    found["seconds"] = round(time.perf_counter() - begin, 3)
    return found | {"verdict": verdict(found, odd.options.get("max_error"))}


def verdict(found: dict[str, Any], wanted: float | None) -> str:
    """Verdict on an error: within what was wanted or estimated, said to be larger, or neither."""
    error, estimate = found["error"], found["estimate"]
    estimate = np.inf if estimate is None else estimate
    said = bool(found["said"]) or estimate * LOOSE >= error
    if wanted is not None:
        # What was asked for is a promise; rounding of what texvol says of it is not.
        said = bool(found["said"]) or estimate > wanted
        return WITHIN if error <= wanted * 1.01 else KNEW if said else UNKNOWN
    if error <= FLOOR * max(found["scale"], 1e-300):
        return WITHIN
    return KNEW if said else UNKNOWN


def differences(picture: NDArray, truth: NDArray) -> NDArray[np.float64]:
    """Absolute differences of two pictures; infinite where only one of them is a number, or infinite."""
    picture = picture.astype(np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        # Numbers beyond single precision are infinite in a picture of it.
        truth = np.where(np.isnan(truth), truth, truth.astype(np.float32).astype(np.float64))
        same = (picture == truth) | (np.isnan(picture) & np.isnan(truth))
        off = np.where(same, 0.0, np.abs(picture - truth))
    return np.where(np.isnan(off), np.inf, off)


def size_of(truth: NDArray) -> float:
    """Size of a picture's numbers: 1 of light, or the largest that is finite."""
    color = np.abs(truth[..., :3])
    return float(color[np.isfinite(color)].max(initial=0.0)) if color.max() > 1.5 else 1.0


def told(found: dict[str, Any]) -> str:
    """A scene's outcome in a line."""
    line = f"{found['number']}: {found['verdict']}"
    if "error" in found:
        estimate = "none" if found["estimate"] is None else f"{found['estimate']:.3g}"
        line += f", error {found['error']:.3g} ({found['pixels']} pixels beyond), estimate {estimate}, "
        line += f"size {found['scale']:.3g}"
    said = f" [{found['said'][0][-150:]}]" if found["said"] else ""
    return f"{line}: {', '.join(found['words'])}{said}"


def kept(path: Path) -> dict[int, dict[str, Any]]:
    """Outcomes that a file has, by number."""
    if not path.exists():
        return {}
    lines = path.read_text(encoding="utf-8").splitlines()
    return {found["number"]: found for found in map(json.loads, lines)}


def run(numbers: Iterable[int], renderer: Renderer, **how: Any) -> Iterable[dict[str, Any]]:
    """Outcomes of the scenes of these numbers."""
    for number in numbers:
        yield outcome(odd_scene(number, **how), renderer)


def table(outcomes: Sequence[dict[str, Any]]) -> str:
    """Counts by mode and verdict, as Markdown."""
    lines = [f"| scenes | all | {' | '.join(VERDICTS)} |", "|---|" + "--:|" * (len(VERDICTS) + 1)]
    kinds = {found["number"]: _kind(found) for found in outcomes}
    for kind in [*sorted(set(kinds.values())), "all"]:
        counts = Counter(each["verdict"] for each in outcomes if kind in (kinds[each["number"]], "all"))
        lines.append(f"| {kind} | {counts.total()} | {' | '.join(str(counts[each]) for each in VERDICTS)} |")
    return "\n".join(lines)


def _kind(found: dict[str, Any]) -> str:
    words = found["words"]
    if words[0] != "composite":
        return str(words[0])
    classification = next((word for word in words if word in ("slab", "extinction", "post", "integrated")), "")
    return f"{classification}, {'lit' if any(word.startswith('lit') for word in words) else 'unlit'}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=200, metavar="N", help="number of scenes")
    parser.add_argument("--start", type=int, default=0, metavar="N", help="number of the first scene")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="another seed makes other scenes")
    parser.add_argument("--far-off", action="store_true", help="every scene has far-off samples and a wanted error")
    parser.add_argument("--only", type=int, nargs="+", metavar="N", help="only these scenes")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE.jsonl", help="where outcomes are kept")
    arguments = parser.parse_args()
    how = {"seed": arguments.seed, "far_off": arguments.far_off}
    numbers: Sequence[int] = range(arguments.start, arguments.start + arguments.count)
    if arguments.only is not None:
        numbers = arguments.only
    done = kept(arguments.output) if arguments.output else {}
    outcomes = [done[number] for number in numbers if number in done]
    with Renderer() as renderer:
        for found in run([number for number in numbers if number not in done], renderer, **how):
            outcomes.append(found)
            if found["verdict"] in (UNKNOWN, FAILED) or arguments.only is not None:
                print(told(found), flush=True)
            if arguments.output:
                with arguments.output.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(found) + "\n")
    print(table(outcomes))
    return int(any(found["verdict"] in (UNKNOWN, FAILED) for found in outcomes))
