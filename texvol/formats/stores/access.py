"""A Zarr store on this machine or on a server: its metadata, and its arrays opened by TensorStore.

A server that does not answer is asked a few times, and then named in an error: nothing waits for ever.
"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any
from urllib.parse import quote, urlsplit

from texvol.formats.readers.samples import FileFault, check_chunk
from texvol.util import reach
from texvol.util.locations import is_remote

_MOST_BYTES = 64 << 20  # of one piece of metadata
_PATIENCE = 30.0  # seconds without a byte after which a server is given up
_DOUBT = 3.0  # seconds after which a server is asked whether it is there
_CACHE = 16 << 20  # bytes
_RETRIES = {"max_retries": 3, "initial_delay": "200ms", "max_delay": "2s"}  # at most some 4 s beside the answers
METADATA = ("zarr.json", ".zarray", ".zgroup", ".zattrs")
_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_LONGEST = 160  # characters of a cause
_HOME = "~/.aws/credentials"


class Store:
    """Zarr hierarchy at a path or URL; keys are relative to it, "" is its root."""

    def __init__(self, path: str) -> None:
        self.path = path
        self.is_remote = is_remote(path)
        self._json: dict[str, Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path, "is_remote": self.is_remote, "_json": self._json}

    def json(self, key: str) -> Any:
        """Return the content of a JSON file, or None if there is none.

        Raises
        ------
        FileFault
            If it cannot be read, or is not a JSON object.
        """
        self.look_up([key])
        return self._json[key]

    def look_up(self, keys: Sequence[str]) -> None:
        """Read several JSON files at the same time, and keep their contents for `json`.

        A distant store takes a round trip for each file that is read alone.

        Raises
        ------
        FileFault
            As by `json`; or if a key, which another file of the store may have told, leads out of the store.
        InputError
            If a file is out of reach, see `texvol.util.reach`.
        """
        for key in keys:
            if ".." in key.split("/"):
                raise FileFault(f"all of it must lie within the store, got the path {key!r}")
            if not self.is_remote:
                reach.check(os.path.join(self.path, key))
            if key not in self._json and (node := self._node_in_root(key)) is not None:
                self._json[key] = node
        coming = [(key, self._kvstore.read(key)) for key in dict.fromkeys(keys) if key not in self._json]
        for key, each in coming:
            found = waited(each)
            self._json[key] = None if found.state == "missing" else _parsed(key, bytes(found.value))

    def _node_in_root(self, key: str) -> dict[str, Any] | None:
        """Return what a distant store's root tells of a node of version 3, so that it need not be asked for."""
        group, _, name = key.rpartition("/")
        known = self._json.get("zarr.json") if self.is_remote and group and name == "zarr.json" else None
        found = _consolidated_in(known).get(group)
        return dict(found) if isinstance(found, Mapping) else None

    def attributes(self, group: str) -> dict[str, Any] | None:
        """Return the attributes of a group or an array; None if there is neither."""
        node = self.json(joined(group, "zarr.json"))
        if node is not None:
            return _object(node.get("attributes", {}), joined(group, "zarr.json"))
        attributes = self.json(joined(group, ".zattrs"))
        if attributes is not None:
            return _object(attributes, joined(group, ".zattrs"))
        known = any(self.json(joined(group, each)) is not None for each in (".zgroup", ".zarray"))
        return {} if known else None

    def version(self, key: str) -> int:
        """Return the Zarr format of an array, 2 or 3, or 0 if there is no array."""
        node = self.json(joined(key, "zarr.json"))
        if node is not None:
            return 3 if node.get("node_type") == "array" else 0
        return 2 if self.json(joined(key, ".zarray")) is not None else 0

    def members(self, group: str) -> list[str]:
        """Return names of groups and arrays in a group, as far as the store tells them."""
        prefix = f"{group}/" if group else ""
        known = {key[len(prefix) :].split("/")[0] for key in self._consolidated if key.startswith(prefix)}
        if not self.is_remote:
            folder = os.path.join(self.path, group)
            known |= {each for each in os.listdir(folder) if _is_node(os.path.join(folder, each))}
        return sorted(each for each in known if each and each not in METADATA)

    @cached_property
    def _consolidated(self) -> tuple[str, ...]:
        """Names of all nodes that the root lists."""
        old = (self.json(".zmetadata") or {}).get("metadata") or {}
        return (*_consolidated_in(self.json("zarr.json")), *(key.rpartition("/")[0] for key in old))

    def open_arrays(self, keys: Sequence[str]) -> list[Any]:
        """Return the arrays as TensorStores, all opened at once.

        Raises
        ------
        FileFault
            If one does not exist, or TensorStore cannot read its kind.
        """
        self.look_up([joined(key, "zarr.json") for key in keys])
        self.look_up([joined(key, ".zarray") for key in keys if self.json(joined(key, "zarr.json")) is None])
        opened = [self._opened(key) for key in keys]
        found = []
        for key, each in zip(keys, opened, strict=True):
            try:
                found.append(each.result())
            except (ValueError, OSError, NotImplementedError):  # its message says more if it reads the metadata
                found.append(waited(self._opened(key, knows=False), f"its array {key or '/'}: "))
        for each in found:  # TensorStore ends the process where it finds no memory for a chunk
            if chunk := each.chunk_layout.read_chunk.shape:
                check_chunk(chunk, each.dtype.numpy_dtype.itemsize)
        return found

    def _opened(self, key: str, *, knows: bool = True) -> Any:
        """Return the future of an array; if it `knows` the metadata, these are not read again."""
        import tensorstore

        version = self.version(key)
        if not version:
            raise FileFault(f"has no array {key!r}" if key else "has no array at its root")
        if not self.is_remote:
            reach.check_tree(os.path.join(self.path, key))  # chunks may be links
        spec = {"driver": "zarr3" if version == 3 else "zarr", "kvstore": self._spec(key)}
        # What has been read once stays as it was when the array was opened.
        spec |= {"recheck_cached_data": "open"}
        if knows:
            spec |= {"metadata": self.json(joined(key, "zarr.json" if version == 3 else ".zarray"))}
        return tensorstore.open(spec, context=self._context, read=True, open=True, assume_metadata=knows)

    @property
    def check_alive(self) -> Callable[[], None] | None:
        """Function that raises ServerFault if the server refuses to answer; None of a store on this machine."""
        return self._ask_server if self.is_remote else None

    def _ask_server(self) -> None:
        import tensorstore

        once = {"max_retries": 1, "initial_delay": "100ms", "max_delay": "100ms"}
        # A context of its own, so that the question is not queued behind those that wait.
        context = tensorstore.Context({"http_request_retries": once, "s3_request_retries": once})
        with suppress(TimeoutError):
            try:
                tensorstore.KvStore.open(self._spec(""), context=context).result().read("zarr.json").result(
                    timeout=_DOUBT
                )
            except (ValueError, OSError) as error:
                raise ServerFault(reason_of(error)) from None

    @cached_property
    def _kvstore(self) -> Any:
        import tensorstore

        return tensorstore.KvStore.open(self._spec(""), context=self._context).result()

    @cached_property
    def _context(self) -> Any:
        import tensorstore

        # Who draws keeps the samples that it needs. Indices of shards are kept here, for their next chunk.
        known: dict[str, Any] = {"cache_pool": {"total_bytes_limit": _CACHE}}
        if self.is_remote:
            known |= {"http_request_retries": _RETRIES, "s3_request_retries": _RETRIES}
        if urlsplit(self.path).hostname in _LOOPBACK:
            # Simple servers queue 5 connections; one more waits for a second until it is tried again.
            known |= {"http_request_concurrency": {"limit": 4}}
        return tensorstore.Context(known)

    def _spec(self, key: str) -> dict[str, Any]:
        """Return TensorStore's description of where an array or the root lies."""
        if not self.is_remote:
            return {"driver": "file", "path": os.path.join(os.path.abspath(self.path), key, "")}
        parts = urlsplit(self.path)
        below = "/".join(each for each in (parts.path.strip("/"), key) if each) + "/"
        if parts.scheme.lower() == "s3":
            return {"driver": "s3", "bucket": parts.netloc, "path": below, **_s3()}
        query = f"?{parts.query}" if parts.query else ""
        path = below if "%" in parts.path else quote(below)
        return {"driver": "http", "base_url": f"{parts.scheme}://{parts.netloc}{query}", "path": f"/{path}"}


def joined(group: str, name: str) -> str:
    """Return the key of what has a name in a group."""
    return "/".join(each for each in (group.strip("/"), name.strip("/")) if each)


class ServerFault(FileFault):
    """A server that does not answer, which is not the fault of a chunk."""


def waited(
    future: Any, where: str = "", check_alive: Callable[[], None] | None = None, *, of_files: bool = False
) -> Any:
    """Return the result of TensorStore's future.

    Parameters
    ----------
    where : str
        Begin of the message of a fault.
    check_alive : callable, optional
        Called when no byte has come for some seconds; raises ServerFault if the server is gone. TensorStore itself ends
        only when it has tried every single chunk.
    of_files : bool
        True if files are read, which no server sends: gigabytes of them may take minutes to decode.

    Raises
    ------
    FileFault
        If it fails; a ServerFault if the server does not answer, or no byte has come for half a minute.
    """
    seen, since, asked = -1, time.monotonic(), False
    while True:
        try:
            return future.result(timeout=1)
        except TimeoutError:
            waiting = time.monotonic() - since
            if (now := bytes_so_far()) != seen:
                seen, since, asked = now, time.monotonic(), False
            elif waiting > _PATIENCE and not of_files:
                raise ServerFault(f"{where}its server has sent nothing for {_PATIENCE:g} s") from None
            elif waiting > _DOUBT and check_alive is not None and not asked:
                asked = True
                check_alive()
        except (ValueError, OSError, NotImplementedError) as error:
            kind = ServerFault if re.search(r"retry attempts failed|UNAVAILABLE|DEADLINE", str(error)) else FileFault
            raise kind(where + reason_of(error)) from None


def reason_of(error: Exception) -> str:
    """Return the cause at the end of TensorStore's message, without the place, which the caller names."""
    text = re.sub(r"\s*\[\w[\w ]*='.*", "", str(error), flags=re.S)
    text = re.sub(r"\b[A-Z][A-Z_]+: ", "", text)
    # A URL may hold a password.
    text = re.sub(r"(https?|s3)://[^\s\"']*[^\s\"':]", "its server", text)
    text = re.sub(r"Error \w+ [\w ]*\"[^\"]*\": ", "", text)
    parts = " ".join(text.split()).split(": ")
    said = parts.pop()
    while parts and len(parts[-1]) + len(said) < _LONGEST:
        said = f"{parts.pop()}: {said}"
    return said or type(error).__name__


def bytes_so_far() -> int:
    """Return bytes that TensorStore has read from all stores in this process."""
    import tensorstore

    found = tensorstore.experimental_collect_matching_metrics("/tensorstore/kvstore/")
    return sum(int(each["values"][0]["value"]) for each in found if each["name"].endswith("/bytes_read"))


def _parsed(key: str, content: bytes) -> dict[str, Any]:
    if len(content) > _MOST_BYTES:
        raise FileFault(f"its {key} has {len(content)} bytes; metadata must have at most {_MOST_BYTES}")
    try:
        found = json.loads(content)
    except (ValueError, RecursionError):
        raise FileFault(f"its {key} is not JSON") from None
    return _object(found, key)


def _object(thing: Any, key: str) -> dict[str, Any]:
    if not isinstance(thing, Mapping):
        raise FileFault(f"its {key} must hold a JSON object, got {type(thing).__name__}")
    return dict(thing)


def _consolidated_in(root: dict[str, Any] | None) -> dict[str, Any]:
    """Return the nodes that the metadata of a root of version 3 hold, by their paths."""
    told = (root or {}).get("consolidated_metadata")
    nodes = told.get("metadata") if isinstance(told, Mapping) else None
    return dict(nodes) if isinstance(nodes, Mapping) else {}


def _is_node(folder: str) -> bool:
    return any(os.path.isfile(os.path.join(folder, each)) for each in METADATA)


def _s3() -> dict[str, Any]:
    """Return endpoint, region and credentials of S3, as the environment names them for all its tools."""
    asked = os.environ.get
    found: dict[str, Any] = {}
    if endpoint := asked("AWS_ENDPOINT_URL_S3") or asked("AWS_ENDPOINT_URL"):
        found["endpoint"] = endpoint.rstrip("/")
    if region := asked("AWS_REGION") or asked("AWS_DEFAULT_REGION") or (endpoint and "us-east-1"):
        found["aws_region"] = region
    if asked("AWS_ACCESS_KEY_ID"):
        found["aws_credentials"] = {"type": "environment"}
    elif not (asked("AWS_PROFILE") or asked("AWS_ROLE_ARN") or os.path.exists(os.path.expanduser(_HOME))):
        found["aws_credentials"] = {"type": "anonymous"}  # public buckets
    return found
