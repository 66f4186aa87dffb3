"""Scenes on their way to another process: what is large or known by identity goes over once, arrays in shared memory.

The renderer knows volumes, transfer functions, masks and meshes by identity: what it has made of one it keeps for as
long as it gets the same. So each such object has a number, is sent when it is first needed, and is the same object
over there for as long as one scene after the other has it. An array of more than a few pages is a memory file that
both sides map; its descriptor goes through the socket.
"""

from __future__ import annotations

import io
import mmap
import os
import pickle
import socket
from multiprocessing.connection import Connection
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
_LARGE = 1 << 16  # bytes: what a pipe holds at once


class Shared:
    """Memory files of arrays, by the arrays' identity: an array has one, whoever it is sent to."""

    def __init__(self) -> None:
        self._files: dict[int, tuple[NDArray, int]] = {}

    def descriptor(self, array: NDArray) -> int:
        """The memory file with the array's bytes."""
        if id(array) not in self._files:
            file = os.memfd_create("texvol-array")
            try:
                with open(file, "wb", closefd=False) as stream:
                    stream.write(np.ascontiguousarray(array).data.cast("B"))
            except BaseException:
                os.close(file)
                raise
            self._files[id(array)] = array, file
        return self._files[id(array)][1]

    def keep_only(self, arrays: set[int]) -> None:
        """Close the files of all others; who has mapped one keeps it."""
        for key in [each for each in self._files if each not in arrays]:
            os.close(self._files.pop(key)[1])

    def close(self) -> None:
        """Close all."""
        self.keep_only(set())


class Sender:
    """This end: packs scenes for one process."""

    def __init__(self, connection: Connection, shared: Shared) -> None:
        self._connection, self._shared = connection, shared
        self._sent: dict[int, Any] = {}  # by identity; held, so that no other object gets its number
        self._needed: set[int] = set()

    def send(self, message: Any) -> None:
        """The message, after whatever it needs and the other side has not got."""
        self._needed = set()
        packed = self._packed(message)
        forgotten = [key for key in self._sent if key not in self._needed]
        for key in forgotten:
            del self._sent[key]
        self._connection.send_bytes(pickle.dumps(("message", forgotten, packed)))

    @property
    def arrays(self) -> set[int]:
        """Identities of the arrays that the last message needs."""
        return {key for key in self._needed if isinstance(self._sent.get(key), np.ndarray)}

    def _packed(self, thing: Any) -> bytes:
        stream = io.BytesIO()
        _Pickler(stream, self).dump(thing)
        return stream.getvalue()

    def token_of(self, thing: Any) -> int | None:
        """The number under which the other side has it, sent now if it has not; None for what is sent by value."""
        is_array = type(thing) is np.ndarray and thing.nbytes > _LARGE
        if not is_array and not isinstance(thing, _KNOWN_BY_IDENTITY):
            return None
        key = id(thing)
        self._needed.add(key)
        if key not in self._sent:
            if is_array:
                file = self._shared.descriptor(thing)  # first: there may be no room for it
                self._connection.send_bytes(pickle.dumps(("array", key, thing.dtype.str, thing.shape)))
                with socket.socket(fileno=os.dup(self._connection.fileno())) as through:
                    socket.send_fds(through, [b"a"], [file])
            else:
                content = self._packed(_Whole(thing))
                self._connection.send_bytes(pickle.dumps(("object", key, content)))
            self._sent[key] = thing
        elif not is_array:
            self._keep_parts(thing)
        return key

    def _keep_parts(self, thing: Any) -> None:
        """Mark what the object holds as needed, too."""
        for part in vars(thing).values():
            if id(part) in self._sent and id(part) not in self._needed:
                self.token_of(part)


class _Whole:
    """An object's class and content, to be pickled in spite of its number."""

    def __init__(self, thing: Any) -> None:
        self.kind, self.content = type(thing), dict(vars(thing))


class _Pickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO, sender: Sender) -> None:
        super().__init__(stream, protocol=pickle.HIGHEST_PROTOCOL)
        self._sender = sender

    def persistent_id(self, thing: Any) -> int | None:
        return self._sender.token_of(thing)

    def reducer_override(self, thing: Any) -> Any:
        if type(thing) is MappingProxyType:
            return _read_only, (dict(thing),)
        return NotImplemented


def _read_only(content: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(content)  # pickle does not find the class by its own name


class Receiver:
    """The other end: unpacks them."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._known: dict[int, Any] = {}

    def receive(self) -> Any:
        """The next message; EOFError where there will be none."""
        while True:
            kind, *rest = pickle.loads(self._connection.recv_bytes())
            if kind == "array":
                key, dtype, shape = rest
                self._known[key] = self._mapped(np.dtype(dtype), shape)
            elif kind == "object":
                key, content = rest
                whole = self._unpacked(content)
                self._known[key] = _made(whole)
            else:
                forgotten, packed = rest
                message = self._unpacked(packed)
                for key in forgotten:
                    self._known.pop(key, None)
                return message

    def _mapped(self, dtype: np.dtype, shape: tuple[int, ...]) -> NDArray:
        file = _descriptor(self._connection)
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


def _made(whole: _Whole) -> Any:
    thing = object.__new__(whole.kind)
    thing.__dict__.update(whole.content)  # as frozen as it was
    return thing


def _descriptor(connection: Connection) -> int:
    with socket.socket(fileno=os.dup(connection.fileno())) as through:
        _, (file,), *_ = socket.recv_fds(through, 1, 1)
    return file
