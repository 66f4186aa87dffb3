"""Scenes as bytes: what takes long to send or to prepare is sent apart, once, and is one and the same object there.

Textures are kept by the identity of volumes, transfer functions, masks and lights. So these keep theirs from one scene
to the next: they are known by a digest of their content.
"""

from __future__ import annotations

import hashlib
import io
import pickle
from collections import OrderedDict
from typing import Any

from texvol.scene.lighting import Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

_KEPT = Volume | TransferFunction | Mask | Lighting
_MOST_KEPT = 64  # parts, but for those of the scene that is drawn


class Packer:
    """Makes bytes of scenes, and of each of their parts once."""

    def __init__(self) -> None:
        # Parts by identity, kept so that it stays theirs, with their digests and those of the parts in them.
        self._known: dict[int, tuple[Any, str, dict[str, None]]] = {}
        self.parts: dict[str, bytes] = {}

    def pack(self, scene: Scene) -> tuple[bytes, tuple[str, ...]]:
        """Return a scene as bytes, and the digests of its parts, whose bytes are in `parts`.

        Raises
        ------
        InputError
            If a volume cannot be sent.
        """
        used: dict[str, None] = {}
        return self._packed(scene, None, used), tuple(used)

    def forget(self, kept: tuple[str, ...]) -> None:
        """Forget all parts but some."""
        self._known = {key: known for key, known in self._known.items() if known[1] in kept}
        self.parts = {digest: content for digest, content in self.parts.items() if digest in kept}

    def _packed(self, thing: Any, itself: Any, used: dict[str, None]) -> bytes:
        packer = self

        class Pickler(pickle.Pickler):
            def persistent_id(self, found: Any) -> str | None:
                if not isinstance(found, _KEPT) or found is itself:
                    return None
                digest = packer._digest(found, used)
                used[digest] = None
                return digest

        content = io.BytesIO()
        try:
            Pickler(content, protocol=pickle.HIGHEST_PROTOCOL).dump(thing)
        except (TypeError, AttributeError, pickle.PicklingError) as error:
            raise InputError(f"the scene cannot be sent to workers: {error}") from None
        return content.getvalue()

    def _digest(self, part: Any, used: dict[str, None]) -> str:
        known = self._known.get(id(part))
        if known is None:
            inner: dict[str, None] = {}
            content = self._packed(part, part, inner)
            known = part, hashlib.blake2b(content, digest_size=16).hexdigest(), inner
            self._known[id(part)] = known
            self.parts[known[1]] = content
        used.update(known[2])
        return known[1]


class Unpacker:
    """Makes scenes of bytes; parts of the same content are the same object as long as they are kept."""

    def __init__(self) -> None:
        self._parts: OrderedDict[str, Any] = OrderedDict()

    def unpack(self, content: bytes, parts: dict[str, bytes]) -> Scene:
        """Return the scene of the bytes that `Packer.pack` made; `parts` has those of its parts by their digests."""
        scene = self._unpacked(content, parts)
        while len(self._parts) > max(_MOST_KEPT, len(parts)):
            self._parts.popitem(last=False)
        volumes = [digest for digest, part in self._parts.items() if isinstance(part, Volume) and digest not in parts]
        for digest in volumes:  # which take much memory
            del self._parts[digest]
        assert isinstance(scene, Scene)
        return scene

    def _unpacked(self, content: bytes, parts: dict[str, bytes]) -> Any:
        unpacker = self

        class Unpickler(pickle.Unpickler):
            def persistent_load(self, digest: str) -> Any:
                if digest not in unpacker._parts:
                    unpacker._parts[digest] = unpacker._unpacked(parts[digest], parts)
                unpacker._parts.move_to_end(digest)
                return unpacker._parts[digest]

        return Unpickler(io.BytesIO(content)).load()
