"""Workers in the processes of an existing Dask cluster (``--executor dask://HOST:PORT``)."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import re
import sys
import time
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from swarmctl.remote import worker
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.lines import Line
from swarmctl.remote.transport import Transport
from swarmctl.remote.workers import Place, Workers
from swarmctl.version import __version__

if TYPE_CHECKING:
    import distributed

CONNECT = 10.0  # s
_LOOK = 0.5  # s
_SCHEMES = {"dask": "tcp", "dask+tls": "tls"}
INSTALL = 'pip install "swarmctl[scale]"'


class ClusterError(Exception):
    """Why the workers of a cluster cannot be used, and in ``fix`` what to do about it."""

    def __init__(self, message: str, fix: str) -> None:
        super().__init__(message)
        self.fix = fix


@dataclass(frozen=True)
class Address:
    """Where the scheduler of a cluster is; ``encrypted``: over TLS."""

    text: str
    host: str
    port: int
    encrypted: bool

    @property
    def dask(self) -> str:
        """The address as Dask writes it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'tls' if self.encrypted else 'tcp'}://{host}:{self.port}"


def address_of(text: str) -> Address:
    """Reads ``dask://HOST:PORT`` or ``dask+tls://HOST:PORT``. Raises ``ClusterError``."""
    fix = "write dask://HOST:PORT, or dask+tls://HOST:PORT, with the address of a Dask scheduler"
    try:
        parts = urlsplit(text)
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ClusterError(f"`{text}` is not an address: {error}", fix) from error
    if parts.scheme not in _SCHEMES:
        raise ClusterError(f"`{text}` names no executor that swarmctl knows", fix)
    if not host or not port or parts.path or parts.query or parts.fragment or parts.username is not None:
        raise ClusterError(f"`{text}` is not an address of a scheduler", fix)
    return Address(text, host, port, parts.scheme == "dask+tls")


@contextmanager
def workers(
    address: Address, *, login: Callable[[], Transport] = EitherSsh, secrets: bool = False
) -> Iterator[Workers]:
    """A transport whose sessions the workers of a cluster have. Raises ``ClusterError`` before any begins.

    ``secrets``: the requests will contain some.
    """
    with _connected(address) as client:
        found = _addresses(client)
        if not found:
            raise ClusterError(f"{address.text} has no workers", f"start one: `dask worker {address.dask}`")
        if secrets and not address.encrypted and not on_loopback({client.scheduler.address, *found}):
            raise ClusterError(
                f"{address.text} is not encrypted, and hosts of this swarm need secrets",
                "run the cluster with TLS and name it dask+tls://HOST:PORT, or run this without --executor",
            )
        check_versions(client.get_versions(packages=["swarmctl"]))
        cluster = _Cluster(client)
        places = [
            Place(client.get_executor(workers=[one], pure=False), one, partial(cluster.has, one))
            for one in found
        ]
        with Workers(places, cluster.line, login=login, serve=serve) as transport:
            yield transport


def serve(login: Callable[[], Transport], orders: Line, reports: Line) -> None:
    """As ``worker.serve``, beside the worker's other tasks."""
    import distributed  # noqa: PLC0415

    for one in (orders, reports):
        if isinstance(one, DaskLine):
            one.open()
    _end_profiling(distributed.get_worker())
    distributed.secede()  # it waits more than it computes: another task may have its thread
    worker.serve(login, orders, reports)


def _end_profiling(its_worker: distributed.Worker) -> None:
    """Ends the worker's statistical profiler, beside which threads that begin or end can lock up the process:
    ``sys._current_frames`` holds a lock of the interpreter while the garbage collector runs Dask's callbacks
    (python/cpython#106883)."""
    if profiler := its_worker.periodic_callbacks.pop("profile", None):  # a starting worker begins those left
        its_worker.loop.add_callback(profiler.stop)


class DaskLine:
    """A queue of the cluster's scheduler."""

    def __init__(self, queue: distributed.Queue) -> None:
        self._name: str = queue.name
        self._queue: distributed.Queue | None = queue

    def __getstate__(self) -> dict[str, Any]:
        return {"_name": self._name, "_queue": None}

    def open(self) -> None:
        """Connects it, in a task of the cluster."""
        import distributed  # noqa: PLC0415

        self._queue = distributed.Queue(self._name, client=distributed.get_client())

    def put(self, item: bytes) -> None:
        """See ``Line``."""
        self._opened.put(item)

    def get(self, timeout: float) -> bytes | None:
        """See ``Line``."""
        try:
            return bytes(self._opened.get(timeout=timeout))
        except (TimeoutError, asyncio.TimeoutError):  # one class since Python 3.11
            return None

    def close(self) -> None:
        """See ``Line``."""
        self._opened.close()

    @property
    def _opened(self) -> distributed.Queue:
        assert self._queue is not None, "a line that was pickled is used before it was opened"
        return self._queue


class _Cluster:
    """The cluster as its client sees it."""

    def __init__(self, client: distributed.Client) -> None:
        self._client = client
        self._workers = set(_addresses(client))
        self._looked = time.monotonic()

    def line(self) -> Line:
        """Returns a new queue."""
        import distributed  # noqa: PLC0415

        return DaskLine(distributed.Queue(client=self._client))

    def has(self, worker_address: str) -> bool:
        """Returns True as long as the scheduler has this worker; it looks once in ``_LOOK`` s for all."""
        if time.monotonic() > self._looked + _LOOK:
            with suppress(OSError):  # of a scheduler that has gone; its queues report that
                self._workers = set(_addresses(self._client))
            self._looked = time.monotonic()
        return worker_address in self._workers


@contextmanager
def _connected(address: Address) -> Iterator[distributed.Client]:
    try:
        import distributed  # noqa: PLC0415
    except ImportError as error:
        raise ClusterError(
            "--executor needs Dask, which is not installed", f"install it: `{INSTALL}`"
        ) from error
    for name in [one for one in logging.root.manager.loggerDict if one.split(".")[0] == "distributed"]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters of it is an error of ours
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # versions: those that matter are compared below
        try:
            client = distributed.Client(address.dask, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as error:  # a timeout is an OSError
            fix = "is the scheduler running there, and does a firewall let you through?"
            if address.encrypted:
                fix += " Dask reads its certificates from distributed.comm.tls in ~/.config/dask"
            raise ClusterError(
                f"no Dask scheduler answers at {address.text}: {_first_line(error)}", fix
            ) from error
    with client:
        yield client


def _addresses(client: distributed.Client) -> list[str]:
    return list(client.scheduler_info(n_workers=-1)["workers"])


def check_versions(found: Mapping[str, Any]) -> None:
    """Raises ``ClusterError`` for workers with another swarmctl, or another Python."""
    wrong: dict[str, list[str]] = {}
    here = f"{sys.version_info.major}.{sys.version_info.minor}"
    for name, one in sorted(found["workers"].items()):
        has = one["packages"].get("swarmctl")
        python = ".".join(one["host"]["python"].split(".")[:2])
        if has is None:
            wrong.setdefault("no swarmctl", []).append(name)
        elif has != __version__:
            wrong.setdefault(f"swarmctl {has}", []).append(name)
        elif python != here:
            wrong.setdefault(f"Python {python}", []).append(name)
    if wrong:
        text = "; ".join(f"{what} at {', '.join(names)}" for what, names in wrong.items())
        raise ClusterError(
            f"the workers do not fit: {text}",
            f"install swarmctl {__version__} on Python {here} there: `pip install swarmctl=={__version__}`",
        )


def on_loopback(addresses: Collection[str]) -> bool:
    """Returns True if all addresses, as Dask writes them, are of this machine."""
    hosts = [re.sub(r"^\w+://\[?|\]?:\d+$", "", one) for one in addresses]
    try:
        return all(ipaddress.ip_address(host).is_loopback for host in hosts)
    except ValueError:  # a name
        return False


def _first_line(error: BaseException) -> str:
    return str(error).partition("\n")[0] or type(error).__name__
