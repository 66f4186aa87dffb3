"""Seconds of one picture of a volume of any size by any number of workers, and what limits them: prints Markdown.

    python scripts/scale_model.py [--measure STORE] [--read MB/s …] [--visible F]
    python scripts/scale_model.py --measure STORE --held-against FILE.json     FILE.json: of benchmark_workers.py

A volume of V bytes is cut into N convex blocks of equal work, of which a fraction f shows. A worker

    reads      m f V c / N    bytes as they are stored (c: stored for decoded), while it
    decodes    m f V / N      bytes,
    prepares   f S / N        samples of the volume (S): texels and empty space, and their upload, and
    draws      f P D / N      samples of rays: P pixels of the box, and D = S^(1/3) slabs along each;

m >= 1 is what neighbours decode twice: a block takes the chunks that it touches, and needs a sample beyond each of its
ends. With n chunks and q blocks along an axis, of which 2 (q - 1) ends lie inside, m is the product of
1 + 2 (q - 1) / n over three axes.

Rates are of one processor core. A worker keeps some of its cores busy while it decodes and prepares, and some while it
draws; where N workers share C cores each has at most C / N of them. Decoding, preparing and drawing share the
processor, unless a device draws (--device): then the slower of the two counts. At the level that pixels show V is
V / 8^k, with the largest k whose samples lie no farther apart than pixels. A worker without a chunk of its own has
nothing to do. A picture whose texels are on the device since the one before is only drawn. The first picture of
processes that have just begun waits until they can draw.

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

and then the parts come together in ceil(log2 N) l + 16 P / b, of the tree l + 16 P / b; one worker composites nothing,
and sends its picture. A picture takes the client a time of its own, to cut the box and to send the scene, and the
scheduler a time for each task: three for each block (it is drawn, its picture goes on, its numbers come back), and of
the tree one for each of the N - 1 pairs. What limits is the largest of the terms that a picture waits for.
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
    decode: float = 800.0  # MB of samples, by a core
    prepare: float = 100.0  # million samples of the volume, by a core
    draw: float = 200.0  # million samples of rays, by a core or a device
    cores: float = 1.0  # that a worker keeps busy while it decodes and prepares
    draw_cores: float = 1.0  # the same while it draws
    composite: float = 100.0  # million pixels
    network: float = 1000.0  # MB from worker to worker
    latency: float = 2e-4  # seconds of a message
    task: float = 5e-4  # seconds of the scheduler for a task
    picture: float = 0.02  # seconds of the client for a picture
    start: float = 0.5  # seconds until a process that has begun can draw
    start_processor: float = 0.4  # processor seconds of that
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
    rate: float = 1.0  # slabs per sample
    device: bool = False  # draws while the processor decodes
    shared: float = math.inf  # processor cores that all workers share; infinite: each has its own
    again: bool = False  # texels are on the device
    just_begun: bool = False  # processes have drawn nothing yet

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


def decoded_twice(picture: Picture, workers: float) -> float:
    """Return how many times a chunk is decoded on average: neighbours both take those at the border of two blocks."""
    chunks = max(picture.samples ** (1 / 3) / picture.chunk, 1.0)
    halvings = math.log2(workers)
    factor = 1.0
    for axis in range(3):  # one after the other is halved
        parts = 2 ** (halvings // 3 + min(max(halvings % 3 - axis, 0.0), 1.0))
        factor *= 1 + 2 * (min(parts, chunks) - 1) / chunks
    return factor


def of_block(picture: Picture, workers: int, rates: Throughput) -> dict[str, float]:
    """Return seconds that a worker reads, decodes, prepares and draws."""
    chunks = max(picture.samples * picture.visible / picture.chunk**3, 1.0)
    busy = min(workers, chunks)
    own, most = picture.visible / busy, picture.shared / busy
    cores, draw_cores = min(rates.cores, most), 1.0 if picture.device else min(rates.draw_cores, most)
    rays = picture.pixels * picture.samples ** (1 / 3) * picture.rate
    decoded = own * picture.size * decoded_twice(picture, busy) / 1e6
    stored = decoded * picture.compression
    found = {
        "read": max(stored / rates.read, stored * busy / rates.store),
        "decode": decoded / rates.decode / cores,
        "prepare": own * picture.samples / 1e6 / rates.prepare / cores,
        "draw": own * rays / 1e6 / rates.draw / draw_cores,
    }
    return {name: 0.0 if picture.again and name != "draw" else each for name, each in found.items()}


def composition(scheme: str, pixels: int, workers: int, rates: Throughput, radix: int = 8) -> dict[str, float]:
    """Return seconds of composition and of messages between workers and to whoever wants the picture."""
    if workers == 1:
        return {"composite": 0.0, "network": rates.latency + _sent(pixels, rates)}
    found = {"tree": _tree, "direct send": _direct_send, "radix-k": _radix}[scheme](pixels, workers, rates, radix)
    stages = 1 if scheme == "tree" else math.ceil(math.log2(workers))
    network = found[1] + stages * rates.latency + _sent(pixels, rates)
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


def tasks(workers: int, scheme: str = "tree") -> int:
    """Return the number of tasks of a picture."""
    return 3 * workers + (workers - 1 if scheme == "tree" else 0)


def terms(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> dict[str, float]:
    """Return the seconds of everything that a picture takes, by name."""
    own = of_block(picture, workers, rates) | composition(scheme, picture.pixels, workers, rates, radix)
    start = rates.start * max(workers / picture.shared, 1.0) if picture.just_begun else 0.0
    return own | {"schedule": rates.picture + tasks(workers, scheme) * rates.task, "start": start}


def path_of(own: dict[str, float], device: bool) -> list[str]:
    """Return the names of the terms that a picture waits for: reading, or the processor, or the device."""
    processor = ["decode", "prepare"] if device else ["decode", "prepare", "draw"]
    at_once = [["read"], processor, ["draw"]] if device else [["read"], processor]
    slowest = max(at_once, key=lambda names: sum(own[name] for name in names))
    return [*slowest, "composite", "network", "schedule", "start"]


def seconds(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> float:
    """Return the seconds of a picture."""
    own = terms(picture, workers, rates, scheme, radix)
    return sum(own[name] for name in path_of(own, picture.device))


def processor_seconds(picture: Picture, workers: int, rates: Throughput) -> float:
    """Return the processor seconds of a worker."""
    one_core = replace(rates, cores=1.0, draw_cores=1.0)
    own = of_block(replace(picture, shared=math.inf), workers, one_core)
    start = rates.start_processor if picture.just_begun else 0.0
    return own["decode"] + own["prepare"] + (0.0 if picture.device else own["draw"]) + start


def limit(picture: Picture, workers: int, rates: Throughput, scheme: str = "tree", radix: int = 8) -> str:
    """Return the name of the largest term that a picture waits for."""
    own = terms(picture, workers, rates, scheme, radix)
    return max(path_of(own, picture.device), key=lambda name: own[name])


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


@dataclass(frozen=True)
class Held:
    """Predictions beside measurements: wall seconds, and processor seconds of the busiest worker."""

    kind: str
    workers: int
    predicted: tuple[float, float]
    measured: tuple[float, float]
    limit: str


def held_against(path: Path, rates: Throughput) -> list[Held]:
    """Return predictions of what `benchmark_workers.py --json` has measured on the machine of the rates."""
    told = json.loads(path.read_text(encoding="utf-8"))
    found = []
    for kind in ("first", "again"):
        picture = Picture(**told["picture"], again=kind == "again", just_begun=kind == "first")
        for count, (wall, busy) in told[kind].items():
            workers = int(count)
            predicted = seconds(picture, workers, rates), processor_seconds(picture, workers, rates)
            found.append(Held(kind, workers, predicted, (wall, busy), limit(picture, workers, rates)))
    return found


def _print_held(found: Sequence[Held]) -> None:
    print("\n## Held against measurement\n\nSeconds, and processor seconds of the busiest worker.\n")
    of_both = ("predicted", "measured", "ratio")
    names = (
        "picture",
        "workers",
        "s: " + of_both[0],
        *of_both[1:],
        "processor s: " + of_both[0],
        *of_both[1:],
        "limit",
    )
    print(f"| {' | '.join(names)} |\n|{'---|' * len(names)}")
    for each in found:
        pairs = zip(each.predicted, each.measured, strict=True)
        cells = " | ".join(f"{own:.3g} | {measured:.3g} | {own / measured:.2f}" for own, measured in pairs)
        print(f"| {each.kind} | {each.workers} | {cells} | {each.limit} |")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    units = dict.fromkeys(("latency", "task", "picture", "start", "start_processor"), "s") | dict.fromkeys(
        ("cores", "draw_cores"), "N"
    )
    units |= {"prepare": "Msamples/s", "draw": "Msamples/s", "composite": "Mpixel/s"}
    for each in fields(Throughput):
        option = f"--{each.name.replace('_', '-')}"
        parser.add_argument(option, type=float, metavar=units.get(each.name, "MB/s"), help=f"({each.default:g})")
    parser.add_argument("--measure", type=Path, metavar="STORE", help="measure these, but for options that are given")
    parser.add_argument("--visible", type=float, default=0.3, metavar="F", help="fraction of samples that shows (0.3)")
    parser.add_argument("--pixels", type=int, default=1024 * 1024, help="that the box covers (1024 x 1024)")
    parser.add_argument("--sample-bytes", type=int, default=1, help="(1)")
    parser.add_argument("--compression", type=float, default=0.5, help="stored bytes for one of the samples (0.5)")
    parser.add_argument("--radix", type=int, default=8, metavar="K", help="(8)")
    parser.add_argument("--device", action="store_true", help="a device draws while the processor decodes")
    parser.add_argument("--held-against", type=Path, metavar="FILE.json", help="measured by benchmark_workers.py")
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
        SIZES[0], arguments.sample_bytes, arguments.compression, arguments.visible, arguments.pixels,
        device=arguments.device,
    )  # fmt: skip
    print("One worker: " + ", ".join(f"{name} {value:.3g}" for name, value in vars(rates).items()) + ".")
    print_tables(picture, rates, arguments.radix)
    if arguments.held_against is not None:
        _print_held(held_against(arguments.held_against, rates))


if __name__ == "__main__":
    main()
