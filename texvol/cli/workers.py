"""Options of the commands that several workers can compute."""

from __future__ import annotations

import argparse
from functools import partial
from typing import TYPE_CHECKING

from texvol.options import texts
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.distributed.workers import Workers


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add --workers, --dask and the files of TLS."""
    group = parser.add_argument_group("workers")
    processes = partial(texts.count, what="workers")
    where = group.add_mutually_exclusive_group()
    where.add_argument("--workers", type=processes, metavar="N", help="processes on this machine that work together")
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="scheduler of a Dask cluster: tcp:// or tls://HOST:PORT, or its scheduler file",
    )
    group.add_argument("--tls-ca", type=texts.file_name, metavar="FILE", help="certificate authority of the cluster")
    group.add_argument("--tls-cert", type=texts.file_name, metavar="FILE", help="certificate of this client")
    group.add_argument("--tls-key", type=texts.file_name, metavar="FILE", help="key of this client")


def workers_of(arguments: argparse.Namespace) -> Workers | None:
    """Start or find the workers that are asked for; None if none are.

    Raises
    ------
    InputError
        If no cluster answers, or files of TLS have no cluster to go with.
    """
    tls = {name: vars(arguments)[name] for name in ("tls_ca", "tls_cert", "tls_key")}
    if arguments.dask is None and any(tls.values()):
        raise InputError("--tls-ca, --tls-cert and --tls-key must go with --dask, got none")
    if arguments.workers is None and arguments.dask is None:
        return None
    from texvol.distributed.workers import Workers

    own = vars(arguments)
    kept = {name: own[name] for name in ("backend", "texture_memory", "memory") if own.get(name) is not None}
    if arguments.dask is not None:
        return Workers(address=arguments.dask, **tls, **kept)
    for name in {"texture_memory", "memory"} & set(kept):  # of all workers together
        kept[name] = kept[name] // arguments.workers
    return Workers(arguments.workers, **kept)
