"""Workers in the processes of an existing Dask cluster (``--executor dask://HOST:PORT``)."""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import re
import sys
import threading
import time
import warnings
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from swarmctl.remote.agent_archive import Agent
from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.session_thread import BecomeRoot, Note, Request
from swarmctl.remote.transport import CHANNEL_TIMEOUT, HostError, Kind, Target, Transport
from swarmctl.remote.worker import Sessions
from swarmctl.version import __version__

if TYPE_CHECKING:
    import distributed

CONNECT = 10.0  # s
_LOGIN = 300.0  # s, more than the sum of the limits of a login through jump hosts
_LOOK = 1.0  # s between two looks whether a worker is alive
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

    ``login``, which is pickled, makes the transport of each worker there. ``secrets``: the requests will
    contain some.
    """
    with _connected(address) as client:
        found = list(client.scheduler_info(n_workers=-1)["workers"])
        if not found:
            raise ClusterError(f"{address.text} has no workers", f"start one: `dask worker {address.dask}`")
        if secrets and not address.encrypted and not on_loopback({client.scheduler.address, *found}):
            raise ClusterError(
                f"{address.text} is not encrypted, and hosts of this swarm need secrets",
                "run the cluster with TLS and name it dask+tls://HOST:PORT, or run this without --executor",
            )
        check_versions(client.get_versions(packages=["swarmctl"]))
        yield Workers([_Worker(client, one, login) for one in found])


class Workers:
    """A transport that spreads sessions over workers.

    A worker that ends loses its own sessions only; the others open the next ones.
    """

    def __init__(self, workers: Sequence[_Worker]) -> None:
        self._lock = threading.Lock()
        self._numbers = count()
        self._all = workers

    @property
    def processes(self) -> int:
        """How many processes have the sessions."""
        return len(self._all)

    @contextmanager
    def connect(self, target: Target) -> Iterator[_Session]:
        """A session of the worker with the fewest; its first request logs in. Raises ``HostError``."""
        with self._lock:
            live = [one for one in self._all if one.alive]
            if not live:
                raise HostError(
                    Kind.UNREACHABLE,
                    f"{target.host} was not reached: no worker is left",
                    "start workers again, then run the same command again",
                )
            chosen = min(live, key=lambda one: one.sessions)
            chosen.sessions += 1
        session = _Session(next(self._numbers), target, chosen)
        try:
            yield session
        finally:
            session.close()
            with self._lock:
                chosen.sessions -= 1


class _Worker:
    """A worker with an actor of this operator, which Dask frees with the client."""

    def __init__(self, client: distributed.Client, name: str, login: Callable[[], Transport]) -> None:
        self.name = name
        self.sessions = 0
        self.lost = False  # seen by a session, which may be before Dask's client learns it
        self._task = client.submit(Sessions, login, actor=True, pure=False, workers=[name])
        try:
            with client.as_current():  # an actor belongs to the client that is current when it arrives
                self.actor: Any = self._task.result(timeout=CONNECT)
        except Exception as error:  # what Dask raises, or the worker when it imports swarmctl
            raise ClusterError(
                f"the worker {name} does not begin: {_first_line(error)}",
                "end the tasks that keep it busy, or run a cluster of its own for swarmctl",
            ) from error
        self.agents: set[str] = set()  # the digests of those that it has
        self.lock = threading.Lock()

    @property
    def alive(self) -> bool:
        """True unless it or the scheduler was lost."""
        return not self.lost and bool(self._task.status == "finished")


class _Session:
    """A session that a worker has; it is the session with the agent, too."""

    def __init__(self, number: int, target: Target, its_worker: _Worker) -> None:
        self._worker = its_worker
        self._number = number
        self._target = _elsewhere(target)
        self._closed = False
        self._agent: Agent | None = None
        self._become = False

    def agent_session(self, chosen: Agent, *, become: bool) -> _Session:
        """See ``WorkerSession``."""
        self._agent, self._become = chosen, become
        return self

    def request(
        self,
        request: Mapping[str, Any],
        payload: bytes = b"",
        *,
        on_note: Callable[[str], None] | None = None,
        timeout: float = 60.0,
    ) -> Any:
        """See ``AgentSession``."""
        agent, worker = self._agent, self._worker
        assert agent is not None, "a request before the session"
        with worker.lock:
            if agent.digest not in worker.agents:
                self._called("keep", agent, timeout=0)
                worker.agents.add(agent.digest)
        order = Request(agent.digest, self._become, dict(request), payload, timeout)
        return self._answer(order, timeout, on_note)

    def become_root(self) -> None:
        """See ``WorkerSession``."""
        self._answer(BecomeRoot(), CHANNEL_TIMEOUT)

    def close(self) -> None:
        """See ``WorkerSession``."""
        self._closed = True
        with suppress(RuntimeError):  # the worker was lost, and the session with it
            self._worker.actor.close(self._number)

    def _answer(
        self, order: Request | BecomeRoot, timeout: float, on_note: Callable[[str], None] | None = None
    ) -> Any:
        report = self._called("answer", self._number, self._target, order, timeout=timeout)
        while isinstance(report, Note):
            if on_note is not None:
                on_note(report.text)
            report = self._called("more", self._number, timeout=timeout)
        if isinstance(report, HostError):
            raise self._from_there(report)
        return report

    def _called(self, method: str, *args: Any, timeout: float) -> Any:
        """What a method of the actor returns. Raises ``HostError``: a lost worker, a closed session."""
        end = time.monotonic() + timeout + _LOGIN
        name, host = self._worker.name, self._target.host
        try:
            pending = getattr(self._worker.actor, method)(*args)
            while not self._closed:
                with suppress(TimeoutError, asyncio.TimeoutError):  # one class since Python 3.11
                    return pending.result(timeout=_LOOK)
                if not self._worker.alive:
                    raise OSError("it has ended")
                if time.monotonic() > end:
                    raise OSError(f"it has reported nothing for {timeout + _LOGIN:.0f} s")
        except (OSError, RuntimeError) as error:
            self._worker.lost = True
            raise HostError(
                Kind.LOST,
                f"the worker {name} was lost while it was connected to {host}: {error}",
                "run the same command again",
            ) from error
        raise HostError(Kind.LOST, f"the connection to {host} was closed")

    def _from_there(self, error: HostError) -> HostError:
        """The error, with the worker if what went wrong may depend on it."""
        name = self._worker.name
        if error.kind is Kind.AUTH:
            hint = f"workers log in with their own keys and ssh-agent, not yours; there: {error.hint}"
            return HostError(error.kind, f"{error.message} (on worker {name})", hint)
        if error.kind is Kind.UNREACHABLE:
            return HostError(error.kind, f"{error.message} (from worker {name})", error.hint)
        return error


def _elsewhere(target: Target) -> Target:
    """The target for another account: key files in the home of this one are those in the home of that one."""
    home = Path.home()
    keys = (
        Path("~", key.relative_to(home)) if key.is_relative_to(home) else key for key in target.identities
    )
    return replace(target, identities=tuple(keys), jump=target.jump and _elsewhere(target.jump))


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
