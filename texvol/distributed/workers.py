"""Workers: processes that draw blocks, on this machine or on a cluster of Dask."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import replace
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from texvol.distributed import drawing
from texvol.distributed.cropped import Cropped, over
from texvol.distributed.drawing import Drawn, DrawnFrame, FrameOrder, Machine, Order
from texvol.distributed.sending import Packer
from texvol.scene.picture_size import checked_size
from texvol.scene.scene import CompleteScene, Scene
from texvol.util.errors import InputError, missing_extra
from texvol.util.memory import free_memory
from texvol.util.termination import unheard_by_children

T = TypeVar("T")
Compositing = Callable[[Callable[[int], Any], Callable[[Any, Any], Any]], Any]

_MOST_LOSSES = 4  # as often as Dask, by default, lets workers die of a task
_PAUSE = 0.5  # seconds, in which a scheduler notices that a worker is gone
_TILE = 4096  # pixels of the oracle, at most, in one piece
_PATIENCE = 60.0  # seconds for a scheduler to answer and for its workers to come


class Workers:
    """Processes that draw together; use it in a `with` statement.

    Parameters
    ----------
    count : int, optional
        Processes on this machine; as many as it has cores by default. Not with `address`.
    address : str, optional
        Of a scheduler of Dask, tcp://HOST:PORT or tls://HOST:PORT, or its scheduler file (FILE.json).
    tls_ca, tls_cert, tls_key : str, optional
        Files of the certificate authority, and of the certificate and key of this client, in PEM.
    backend : "auto", "egl" or "osmesa"
    texture_memory : float, optional
        Megabytes (10^6 bytes) for textures of each worker.
    memory : int, optional
        Bytes of samples of a large volume, of each worker; on this machine by default a part of half of what is free.

    Raises
    ------
    InputError
        If an argument is out of range, or no scheduler or worker answers.
    MissingExtraError
        If dask.distributed is not installed.

    Notes
    -----
    Dask runs what it is sent: whoever reaches its scheduler runs code on its workers. Those on this machine speak TLS
    with a certificate of the moment; of a cluster see to it that TLS, or its network, keeps strangers out.
    """

    def __init__(
        self,
        count: int | None = None,
        *,
        address: str | None = None,
        tls_ca: str | None = None,
        tls_cert: str | None = None,
        tls_key: str | None = None,
        backend: str = "auto",
        texture_memory: float | None = None,
        memory: int | None = None,
    ) -> None:
        if count is not None and (address is not None or count < 1):
            raise InputError(f"workers must be at least 1, and not beside an address, got {count}")
        textures = int(texture_memory * 1e6) if texture_memory else None
        self._machine, self._packer, self._cluster = Machine(backend, textures, memory), Packer(), None
        self._sent: dict[str, Any] = {}
        self._client: Any = None
        logging.getLogger("asyncio").addFilter(_is_no_exit)
        try:
            if address is None:
                self._start(count or os.cpu_count() or 1)
            else:
                self._connect(address, tls_ca, tls_cert, tls_key)
        except BaseException:
            self.close()
            raise

    def _start(self, count: int) -> None:
        """Start processes on this machine."""
        dask, distributed = _libraries()
        threads = max((os.cpu_count() or 1) // count, 1)
        memory = self._machine.memory or free_memory() // 2 // count
        textures = self._machine.texture_memory or free_memory() // 2 // count
        self._machine = replace(self._machine, memory=memory, texture_memory=textures, threads=threads)
        settings = {
            "distributed.worker.multiprocessing-method": "spawn",
            "distributed.nanny.pre-spawn-environ.NUMBA_NUM_THREADS": threads,
            "distributed.comm.timeouts.connect": "60s",
            # Nobody looks at the pages that these would serve.
            "distributed.scheduler.http.routes": [],
            "distributed.worker.http.routes": [],
            # Nor at what they show of each process, which takes a tenth of a core while the workers wait.
            "distributed.worker.profile.enabled": False,
            "distributed.admin.system-monitor.interval": "10s",
            "distributed.admin.tick.interval": "1s",
        }
        with dask.config.set(settings), unheard_by_children():
            self._cluster = distributed.LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                processes=True,
                protocol="tls://",
                security=distributed.Security.temporary(),
                memory_limit=0,
                dashboard_address="127.0.0.1:0",
                worker_dashboard_address="127.0.0.1:0",
                silence_logs=50,
            )
            self._client = distributed.Client(self._cluster, set_as_default=False)

    def _connect(self, address: str, ca: str | None, cert: str | None, key: str | None) -> None:
        """Connect to the scheduler of a cluster, and wait for a worker."""
        _, distributed = _libraries()
        # Of workers and schedulers that are gone an error tells, or nothing where others take their place.
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL + 1)
        security = None
        if ca or cert or key:
            for path in (ca, cert, key):
                if path is not None and not os.path.isfile(path):
                    raise InputError(f"{path}: must be a file of a certificate or key, got none")
            security = distributed.Security(
                tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key, require_encryption=True
            )
        if not address.startswith(("tcp://", "tls://", "ws://", "wss://")) and not os.path.isfile(address):
            raise InputError(f"{address}: must be tcp://HOST:PORT, tls://HOST:PORT or a scheduler file, got neither")
        where = {"scheduler_file": address} if os.path.isfile(address) else {"address": address}
        try:
            self._client = distributed.Client(**where, security=security, timeout=_PATIENCE, set_as_default=False)
            self._client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TypeError, TimeoutError) as error:
            raise InputError(f"{address}: no scheduler with workers answers: {error}") from None

    @property
    def count(self) -> int:
        """Number of workers there are now, at least 1."""
        return max(len(self.addresses()), 1)

    def raycast(
        self,
        scene: Scene,
        size: tuple[int, int] = (512, 512),
        tell: Callable[[float], None] = lambda fraction: None,
    ) -> NDArray[np.float64]:
        """Return the exact picture of a scene, as `texvol.raycast` does, tile by tile; `tell` is told the fraction."""
        width, height = checked_size(size)
        rows, columns = np.divmod(np.arange(width * height), width)
        pixels = np.column_stack([columns, rows])
        return self.raycast_pixels(scene, (width, height), pixels, tell).reshape(height, width, 4)

    def raycast_pixels(
        self,
        scene: Scene,
        size: tuple[int, int],
        pixels: NDArray[np.intp],
        tell: Callable[[float], None] = lambda fraction: None,
    ) -> NDArray[np.float64]:
        """Return some pixels of the exact picture, shape (n, 4); `pixels` has column and row of each."""
        complete = scene.completed(size)
        tiles = np.array_split(pixels, max(-(-len(pixels) // _TILE), min(self.count, max(len(pixels), 1))))

        def drawn() -> list[NDArray[np.float64]]:
            packed, digests = self._packer.pack(complete)
            parts = self._parts(digests)
            futures = [
                self._client.submit(drawing.raycast_pixels, self._machine, packed, size, tile, parts, pure=False)
                for tile in tiles
            ]
            self._wait(futures, tell)
            return self._gathered(futures)

        return np.concatenate(self.again_if_lost(drawn))

    def draw(
        self,
        scene: CompleteScene,
        orders: Sequence[Order],
        composited: Compositing | None,
        tell: Callable[[float], None],
    ) -> tuple[list[Drawn], Cropped | None]:
        """Draw blocks; return what is told of each, and the picture of all.

        Parameters
        ----------
        orders : sequence of Order
            Of each block; the scene in them is put in its place here.
        composited : callable, optional
            Is given the picture of a number, and *over*; returns the picture of all. Without it blocks are returned
            with their pictures.
        """
        return self.again_if_lost(lambda: self._drawn(scene, orders, composited, tell))

    def _drawn(
        self,
        scene: CompleteScene,
        orders: Sequence[Order],
        composited: Compositing | None,
        tell: Callable[[float], None],
    ) -> tuple[list[Drawn], Cropped | None]:
        packed, digests = self._packer.pack(scene)
        self._packer.forget(digests)
        parts, addresses = self._parts(digests), self.addresses()
        client = self._client
        # The same block goes to the same worker, which has its textures; if that is gone, to any other.
        drawn = [
            client.submit(
                drawing.draw,
                self._machine,
                replace(order, scene=packed),
                parts,
                pure=False,
                workers=[addresses[number % len(addresses)]] if addresses else None,
                allow_other_workers=bool(addresses),
            )
            for number, order in enumerate(orders)
        ]
        if composited is None:
            self._wait(drawn, tell)
            return self._gathered(drawn), None
        pictures = [client.submit(drawing.picture_of, each, pure=False) for each in drawn]
        told = [client.submit(drawing.without_picture, each, pure=False) for each in drawn]
        whole = composited(pictures.__getitem__, lambda front, behind: client.submit(over, front, behind, pure=False))
        self._wait(told, tell)
        picture, *stats = self._gathered([whole, *told])
        return stats, picture

    def begin_frame(self, scene: Scene, order: FrameOrder, address: str) -> Any:
        """Let a worker draw a whole frame, or another one if that is gone; return the frame to come.

        Parts of a scene that is seen from several sides are sent to all workers at once.
        """
        content, digests = self._packer.pack(scene)
        self._packer.forget(digests)
        parts = self._parts(digests, None if order.views > 1 else address)
        return self._submitted(address, drawing.draw_frame, self._machine, order, content, parts)

    def prepare(self, scene: Scene, addresses: Sequence[str]) -> list[Any]:
        """Let workers open their contexts and unpack a scene that was sent; return what to keep until they have."""
        content, digests = self._packer.pack(scene)
        arguments = self._machine, content, self._parts(digests)
        return [self._submitted(each, drawing.prepare, *arguments) for each in addresses]

    def _submitted(self, address: str, function: Callable[..., Any], *arguments: Any) -> Any:
        where = {"workers": [address], "allow_other_workers": True}
        return self._client.submit(function, *arguments, pure=False, **where)

    def drawn_frame(self, coming: Any) -> DrawnFrame:
        """Wait for a frame; raises CancelledError if something that it needs is lost with a worker."""
        (frame,) = self._gathered([coming])
        assert isinstance(frame, DrawnFrame)
        return frame

    def again_if_lost(self, draw: Callable[[], T]) -> T:
        """Call a function, and again if what it sent was lost with the only worker that had it; return the result.

        Raises
        ------
        InputError
            If that happens again and again, or no worker comes in place of those that are gone.
        """
        from distributed.comm import CommClosedError

        for attempt in range(_MOST_LOSSES):
            time.sleep(_PAUSE if attempt else 0.0)
            self._wait_for_a_worker()
            # Something was lost with a worker, or a worker died while it was sent to.
            with suppress(CancelledError, CommClosedError, TimeoutError):
                return draw()
        raise InputError(f"workers died again and again while they drew: {_MOST_LOSSES} times")

    def _wait_for_a_worker(self) -> None:
        try:
            self._client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, TimeoutError) as error:
            raise InputError(f"workers or scheduler do not answer within {_PATIENCE:g} s: {error}") from None

    def close(self) -> None:
        """Stop the processes on this machine, or leave the cluster."""
        self._sent.clear()
        if self._client is not None:
            self._client.close()
        if self._cluster is not None:
            self._cluster.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def addresses(self) -> list[str]:
        """Return the addresses of the workers there are now."""
        return sorted(self._client.nthreads())

    def _parts(self, digests: Sequence[str], address: str | None = None) -> dict[str, Any]:
        """Return the parts of a scene as they lie on the workers; they are sent once, to all workers or to one."""
        self._sent = {digest: future for digest, future in self._sent.items() if digest in digests}
        where: dict[str, Any] = {"broadcast": True} if address is None else {"workers": [address]}
        for digest in digests:
            future = self._sent.get(digest)
            if future is None or future.status in ("lost", "cancelled", "error"):
                self._sent[digest] = self._client.scatter(self._packer.parts[digest], hash=False, **where)
        return dict(self._sent)

    def _wait(self, futures: Sequence[Any], tell: Callable[[float], None]) -> None:
        from distributed import as_completed

        for done, _ in enumerate(as_completed(list(futures), loop=self._client.loop, raise_errors=False), 1):
            tell(done / len(futures))

    def _gathered(self, futures: list[Any]) -> Any:
        from distributed.scheduler import KilledWorker

        try:
            return self._client.gather(futures)
        except KilledWorker as error:
            raise InputError(f"workers died again and again while they drew: {error}") from None


def _libraries() -> tuple[Any, Any]:
    try:
        import dask
        import distributed
    except ImportError:
        raise missing_extra("distributed", "dask", "drawing by workers") from None
    return dask, distributed


def _is_no_exit(record: logging.LogRecord) -> bool:
    """True unless a message is of Dask's own way out of waiting, which nobody fetches after ctrl-C."""
    return record.exc_info is None or getattr(record.exc_info[0], "__name__", "") != "AllExit"
