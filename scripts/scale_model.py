"""Seconds of one picture of a volume of any size by any number of workers, and what limits them: prints Markdown.

    python scripts/scale_model.py [--measure STORE] [--read MB/s …] [--visible F] [--held-against FILE.json]

A volume of V bytes is cut into N convex blocks of equal work, of which a fraction f shows. A worker

    reads      f V c / N      bytes as they are stored (c: stored for decoded), while it
    decodes    f V / N        bytes, and
    draws      f S / N        samples (S: samples of the volume; bake, upload and draw of a sample together);

decoding and drawing share the processor, unless a device draws (--device): then the slowest of the three counts. At the
level that pixels show V is V / 8^k, with the largest k whose samples lie no farther apart than pixels. A worker
without a chunk of its own has nothing to do.

A block covers A(1) = P N^(-2/3) of the P pixels of the box, m neighbouring blocks together A(m) = P (m / N)^(2/3);
pictures are cropped to that, of 16 bytes a pixel. Each message takes a latency l, bytes go at b per second, pixels are
composited at p per second:

    tree         log2 N stages: l + 16 A(2^(s-1)) / b + A(2^s) / p, s = 1 …
    direct send  each worker owns a part of the picture, which N^(1/3) blocks cover (Hsu 1993, "Segmented ray casting
                 for data parallel volume rendering"): N^(1/3) l + 16 A(1) / b + A(1) / p
    radix-k      rounds of direct send in groups of k (Peterka, Goodell, Ross, Shen, Thakur 2009, "A configurable
                 algorithm for parallel image-compositing applications"); in round i a worker holds a part 1 / K of what
                 K = k^(i-1) blocks cover: (k - 1) l + (k - 1) / k (16 A(K) / K / b) + (k - 1) / k (A(K) / K / p).
                 k = 2 is binary swap (Ma, Painter, Hansen, Krogh 1994, "Parallel volume rendering using binary-swap
                 compositing"), k = N is direct send where all pictures overlap

and then the parts come together in ceil(log2 N) l + 16 P / b, of the tree l + 16 P / b. A scheduler spends t on each
task: one for each block, and of the tree one for each of the N - 1 pairs. One worker composites nothing, and sends
nothing. What limits is the largest of these terms.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

SIZES = (10e9, 100e9, 1e12, 10e12, 100e12)  # bytes
WORKERS = (1, 10, 100, 1000, 10_000)
SCHEMES = ("tree", "direct send", "radix-k")
_PIXEL = 16  # bytes: premultiplied float32 RGBA


@dataclass(frozen=True)
class Throughput:
    """What one worker does in a second; megabytes are 10⁶ bytes."""

    read: float = 200.0  # MB from the store, as they are stored
    decode: float = 800.0  # MB of samples
    draw: float = 50.0  # million samples of the volume: baked, uploaded and drawn
    composite: float = 100.0  # million pixels
    network: float = 1000.0  # MB from worker to worker
    latency: float = 2e-4  # seconds of a message
    task: float = 5e-4  # seconds of the scheduler for a task
    store: float = math.inf  # MB/s that the store sends to all workers together


@dataclass(frozen=True)
class Picture:
    """What is drawn, and how."""

    size: float  # bytes of the volume
    sample_bytes: int = 1
    compression: float = 0.5  # stored bytes for one of the samples
    visible: float = 1.0  # fraction of the samples that shows
    pixels: int = 1024 * 1024  # that the box covers
    chunk: int = 64  # samples along an axis
    device: bool = False  # draws while the processor decodes
    shared: bool = False  # all workers share the processor that was measured

    @property
    def samples(self) -> float:
        """Number of samples of the volume."""
        return self.size / self.sample_bytes

    @property
    def at_pixels(self) -> Picture:
        """The picture from the level that pixels show."""
        finer = self.samples ** (1 / 3) / math.sqrt(self.pixels)
        halvings = max(math.floor(math.log2(finer) + 1e-9), 0) if finer > 1 else 0
        return replace(self, size=self.size / 8**halvings)


def of_block(picture: Picture, workers: int, rates: Throughput) -> dict[str, float]:
    """Return seconds that a worker reads, decodes and draws."""
    chunks = max(picture.samples * picture.visible / picture.chunk**3, 1.0)
    busy = min(workers, chunks)
    own, together = picture.visible * picture.size / busy, picture.visible * picture.size
    processor = 1 / min(workers, busy) if picture.shared else 1.0
    stored = own * picture.compression / 1e6
    return {
        "read": max(stored / rates.read, together * picture.compression / 1e6 / rates.store),
        "decode": own / 1e6 / (rates.decode * processor),
        "draw": own / picture.sample_bytes / 1e6 / (rates.draw * processor),
    }


def composition(scheme: str, pixels: int, workers: int, rates: Throughput, radix: int = 8) -> dict[str, float]:
    """Return seconds of composition and of messages between workers and to whoever wants the picture."""
    if workers == 1:
        return {"composite": 0.0, "network": 0.0}
    found = {"tree": _tree, "direct send": _direct_send, "radix-k": _radix}[scheme](pixels, workers, rates, radix)
    stages = 1 if scheme == "tree" else math.ceil(math.log2(workers))
    network = found[1] + stages * rates.latency + _PIXEL * pixels / 1e6 / rates.network
    return {"composite": found[0], "network": network}


def _area(pixels: int, blocks: float, workers: int) -> float:
    """Pixels that some neighbouring blocks of all cover together."""
    return pixels * min(blocks / workers, 1.0) ** (2 / 3)


def _sent(pixels: float, rates: Throughput) -> float:
    return _PIXEL * pixels / 1e6 / rates.network


def _tree(pixels: int, workers: int, rates: Throughput, _: int) -> tuple[float, float]:
    composite = network = 0.0
    for stage in range(1, math.ceil(math.log2(workers)) + 1):
        network += rates.latency + _sent(_area(pixels, 2 ** (stage - 1), workers), rates)
        composite += _area(pixels, 2**stage, workers) / 1e6 / rates.composite
    return composite, network


def _direct_send(pixels: int, workers: int, rates: Throughput, _: int) -> tuple[float, float]:
    own = _area(pixels, 1, workers)
    return own / 1e6 / rates.composite, workers ** (1 / 3) * rates.latency + _sent(own, rates)


def _radix(pixels: int, workers: int, rates: Throughput, radix: int) -> tuple[float, float]:
    rounds = max(math.ceil(math.log(workers, radix) - 1e-9), 1)
    k = workers ** (1 / rounds)
    composite = network = 0.0
    for number in range(rounds):
        held = k**number
        moved = (k - 1) / k * _area(pixels, held, workers) / held
        network += (k - 1) * rates.latency + _sent(moved, rates)
        composite += moved / 1e6 / rates.composite
    return composite, network


def terms(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> dict[str, float]:
    """Return the seconds of everything that a picture takes, by name."""
    tasks = 0 if workers == 1 else 2 * workers - 1 if scheme == "tree" else workers
    own = of_block(picture, workers, rates) | composition(scheme, picture.pixels, workers, rates, radix)
    return own | {"schedule": tasks * rates.task}


def seconds(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> float:
    """Return the seconds of a picture."""
    own = terms(picture, workers, rates, scheme, radix)
    drawn = max(own["decode"], own["draw"]) if picture.device else own["decode"] + own["draw"]
    return max(own["read"], drawn) + own["composite"] + own["network"] + own["schedule"]


def limit(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> str:
    """Return the name of the largest term."""
    own = terms(picture, workers, rates, scheme, radix)
    return max(own, key=lambda name: own[name])


def in_bytes(count: float) -> str:
    """Return a size in words: 10 GB."""
    return f"{count / 1e12:g} TB" if count >= 1e12 else f"{count / 1e9:g} GB"


def print_tables(picture: Picture, rates: Throughput, radix: int) -> None:
    """Print seconds and limits of all sizes and workers, and of the ways to composite."""
    print("\n## One picture\n\nComposited by the tree; seconds, and what limits.\n")
    kinds_of = ("full resolution", f"{picture.visible:.0%} of it visible", "level by pixels")
    print(f"| volume | workers | {' | limit | '.join(kinds_of)} | limit |\n|{'---|' * 8}")
    for size in SIZES:
        whole = replace(picture, size=size, visible=1.0)
        kinds = whole, replace(picture, size=size), replace(picture, size=size).at_pixels
        for workers in WORKERS:
            cells = (f"{seconds(kind, workers, rates):.3g} | {limit(kind, workers, rates)}" for kind in kinds)
            print(f"| {in_bytes(size)} | {workers} | {' | '.join(cells)} |")
    print(f"\n## Composition\n\nMilliseconds of {picture.pixels / 1e6:.3g} megapixels; k = {radix}.\n")
    print(f"| workers | {' | '.join(SCHEMES)} |\n|{'---|' * (len(SCHEMES) + 1)}")
    for workers in WORKERS:
        times = (sum(composition(each, picture.pixels, workers, rates, radix).values()) for each in SCHEMES)
        print(f"| {workers} | {' | '.join(f'{1e3 * each:.3g}' for each in times)} |")


def held_against(path: Path, picture: Picture, rates: Throughput) -> list[tuple[int, float, float]]:
    """Return workers, predicted seconds and measured seconds.

    The file has {"workers": {"1": seconds, "2": seconds}}.
    """
    measured = json.loads(path.read_text(encoding="utf-8"))["workers"]
    return [(int(count), seconds(picture, int(count), rates), float(each)) for count, each in measured.items()]


def _print_held(found: Sequence[tuple[int, float, float]]) -> None:
    print("\n## Held against measurement\n")
    names = ("workers", "predicted s", "measured s", "predicted / measured", "faster: predicted", "measured")
    print(f"| {' | '.join(names)} |\n|{'---|' * len(names)}")
    _, first, first_measured = found[0]
    for count, own, measured in found:
        ratios = f"{own / measured:.2f} | {first / own:.2f} | {first_measured / measured:.2f}"
        print(f"| {count} | {own:.3g} | {measured:.3g} | {ratios} |")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    units = {"latency": "s", "task": "s", "draw": "Msamples/s", "composite": "Mpixel/s"}
    for each in fields(Throughput):
        parser.add_argument(
            f"--{each.name}", type=float, metavar=units.get(each.name, "MB/s"), help=f"({each.default:g})"
        )
    parser.add_argument("--measure", type=Path, metavar="STORE", help="measure these, but for options that are given")
    parser.add_argument("--visible", type=float, default=0.3, metavar="F", help="fraction of samples that shows (0.3)")
    parser.add_argument("--pixels", type=int, default=1024 * 1024, help="that the box covers (1024 x 1024)")
    parser.add_argument("--sample-bytes", type=int, default=1, help="(1)")
    parser.add_argument("--compression", type=float, default=0.5, help="stored bytes for one of the samples (0.5)")
    parser.add_argument("--radix", type=int, default=8, metavar="K", help="(8)")
    parser.add_argument("--device", action="store_true", help="a device draws while the processor decodes")
    parser.add_argument("--shared", action="store_true", help="all workers share the processor that was measured")
    parser.add_argument("--held-against", type=Path, metavar="FILE.json", help="measured seconds by workers")
    parser.add_argument("--bytes", type=float, default=SIZES[0], help="of the volume of --held-against (1e10)")
    return parser


def main() -> None:
    """Print the tables."""
    parser = _parser()
    arguments = parser.parse_args()
    given = {each.name: vars(arguments)[each.name] for each in fields(Throughput)}
    if arguments.measure is not None:
        from scale_measuring import measured

        given = measured(arguments.measure) | {name: value for name, value in given.items() if value is not None}
    rates = Throughput(**{name: value for name, value in given.items() if value is not None})
    picture = Picture(
        arguments.bytes, arguments.sample_bytes, arguments.compression, arguments.visible, arguments.pixels,
        device=arguments.device, shared=arguments.shared,
    )  # fmt: skip
    print("One worker: " + ", ".join(f"{name} {value:.3g}" for name, value in vars(rates).items()) + ".")
    print_tables(replace(picture, shared=False), rates, arguments.radix)
    if arguments.held_against is not None:
        _print_held(held_against(arguments.held_against, picture, rates))


if __name__ == "__main__":
    main()
