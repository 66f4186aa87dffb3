"""Transport of scenes to another process: large objects are sent once, and arrays through shared memory.

The renderer caches its work by the identity of volumes, transfer functions, masks and meshes. So each such object gets
a number and is sent when a scene first needs it; the receiver keeps the object for as long as successive scenes need
it. An array of more than a few pages is a memory file that both processes map; its descriptor is sent through the
socket.
"""

from __future__ import annotations

import copyreg
import io
import mmap
import os
import pickle
import threading
from collections.abc import Iterable
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle, send_handle
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.shapes import Lines, Mesh
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume

_KNOWN_BY_IDENTITY = (Volume, TransferFunction, Mask, AddedVolume, Mesh, Lines)
_LARGE = 1 << 16  # bytes: capacity of a pipe


class SharedArrays:
    """Memory files of arrays, one for each array, used by all processes."""

    def __init__(self) -> None:
        self._files: dict[int, tuple[NDArray, int]] = {}
        self._prepared: frozenset[int] = frozenset()
        self._changing = threading.Lock()

    def descriptor(self, array: NDArray) -> int:
        """Return the descriptor of the memory file with an array's bytes."""
        known = self._files.get(id(array))
        if known is not None:
            return known[1]
        file = _memory_file(array)  # without the lock: another thread may copy another array
        with self._changing:
            _, kept = self._files.setdefault(id(array), (array, file))
        if kept != file:
            os.close(file)
        return kept

    def prepare(self, arrays: Iterable[NDArray]) -> None:
        """Copy arrays that will be needed soon; they are kept until the next call. May be called on any thread.

        Raises
        ------
        OSError
            If there is no memory for the copies.
        """
        arrays = [each for each in arrays if is_large(each)]
        with self._changing:  # before they are copied, so that `keep_only` does not close their files
            self._prepared = frozenset(map(id, arrays))
        for each in arrays:
            self.descriptor(each)

    def keep_only(self, arrays: set[int]) -> None:
        """Close the memory files of all arrays but these and the prepared ones; existing mappings stay valid."""
        with self._changing:
            for key in self._files.keys() - arrays - self._prepared:
                os.close(self._files.pop(key)[1])

    def close(self) -> None:
        """Close all memory files."""
        self.prepare(())
        self.keep_only(set())


def is_large(array: NDArray) -> bool:
    """True if an array goes through shared memory."""
    return array.nbytes > _LARGE


def _memory_file(array: NDArray) -> int:
    file = os.memfd_create("texvol-array")
    try:
        with open(file, "wb", closefd=False) as stream:
            stream.write(np.ascontiguousarray(array).data.cast("B"))
    except BaseException:
        os.close(file)
        raise
    return file


class Sender:
    """Sending end: pickles messages for one process."""

    def __init__(self, connection: Connection, shared: SharedArrays) -> None:
        self._connection, self._shared = connection, shared
        self._sent: dict[int, Any] = {}  # by identity; kept alive, so that no other object gets the same identity
        self._needed: set[int] = set()

    def send(self, message: Any) -> None:
        """Send a message, after the objects that it needs and the receiver does not have."""
        self._needed = set()
        packed = self._packed(message)
        forgotten = self._sent.keys() - self._needed
        for key in forgotten:
            del self._sent[key]
        self._put("message", forgotten, packed)

    @property
    def arrays(self) -> set[int]:
        """Identities of the arrays that the last message needs."""
        return {key for key in self._needed if isinstance(self._sent.get(key), np.ndarray)}

    def _put(self, *parts: Any) -> None:
        self._connection.send_bytes(pickle.dumps(parts))

    def _packed(self, thing: Any) -> bytes:
        stream = io.BytesIO()
        _Pickler(stream, self, thing).dump(thing)
        return stream.getvalue()

    def token_of(self, thing: Any) -> int | None:
        """Return the number of an object, and send the object if needed; None for objects that are sent by value."""
        is_array = type(thing) is np.ndarray and is_large(thing)
        if not is_array and not isinstance(thing, _KNOWN_BY_IDENTITY):
            return None
        key = id(thing)
        self._needed.add(key)
        if key not in self._sent:
            if is_array:
                file = self._shared.descriptor(thing)  # first, because shared memory may be full
                self._put("array", key, thing.dtype.str, thing.shape)
                send_handle(self._connection, file, 0)  # Unix needs no number of the receiving process
            else:
                self._put("object", key, self._packed(thing))
            self._sent[key] = thing
        elif not is_array:  # its parts are needed, too
            for part in vars(thing).values():
                if id(part) in self._sent and id(part) not in self._needed:
                    self.token_of(part)
        return key


def _read_only(content: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(content)  # a function, because pickle does not find MappingProxyType by its name


class _Pickler(pickle.Pickler):
    """Pickler of a thing as a whole, with numbers in place of the large objects that it refers to."""

    dispatch_table = copyreg.dispatch_table | {MappingProxyType: lambda view: (_read_only, (dict(view),))}

    def __init__(self, stream: io.BytesIO, sender: Sender, whole: Any) -> None:
        super().__init__(stream, protocol=pickle.HIGHEST_PROTOCOL)
        self._sender, self._whole = sender, whole

    def persistent_id(self, thing: Any) -> int | None:
        return None if thing is self._whole else self._sender.token_of(thing)


class Receiver:
    """Receiving end: unpickles messages."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._known: dict[int, Any] = {}

    def receive(self) -> Any:
        """Return the next message; raise EOFError if the connection is closed."""
        while True:
            kind, *rest = pickle.loads(self._connection.recv_bytes())
            if kind == "array":
                key, dtype, shape = rest
                self._known[key] = self._mapped(np.dtype(dtype), shape)
            elif kind == "object":
                key, content = rest
                self._known[key] = self._unpacked(content)
            else:
                forgotten, packed = rest
                message = self._unpacked(packed)
                for key in forgotten:
                    self._known.pop(key, None)
                return message

    def _mapped(self, dtype: np.dtype, shape: tuple[int, ...]) -> NDArray:
        file = recv_handle(self._connection)
        try:
            memory = mmap.mmap(file, 0, mmap.MAP_SHARED, mmap.PROT_READ)
        finally:
            os.close(file)
        return np.frombuffer(memory, dtype).reshape(shape)

    def _unpacked(self, content: bytes) -> Any:
        return _Unpickler(io.BytesIO(content), self._known).load()


class _Unpickler(pickle.Unpickler):
    def __init__(self, stream: io.BytesIO, known: dict[int, Any]) -> None:
        super().__init__(stream)
        self._known = known

    def persistent_load(self, key: int) -> Any:
        return self._known[key]
