"""The lists of the swarm's hosts that its hosts keep: what they name that the spec has no more.

A host may lie in its list. So what it names is only a proposal: the address must be valid, and none of the
spec's, and ``cli.left_hosts`` has it contacted only after a question, with a key pinned for its name.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from pydantic import TypeAdapter, ValidationError
from swarm_onboard.agent.host_list import HostList, HostListState, digest_of
from swarm_onboard.agent.host_list import HostLogin as StoredLogin

from swarmctl.field_types import HostName
from swarmctl.plan.observed_host import Observed
from swarmctl.remote.transport import AgentSession, HostError
from swarmctl.spec.model import Host
from swarmctl.spec.reach import HostLogin

_AHEAD = 86_400  # s by which the clock of another operator may be ahead
Wanted = tuple[dict[str, StoredLogin], dict[str, int]]  # hosts, and when others were taken off
_MOST_GONE = 200
_MOST = 32  # different lists that are read


@dataclass(frozen=True)
class LeftHost(HostLogin):
    """A host that the spec has no more, with the login that the spec had for it; ``named_by``: the host whose
    list names it, empty if this machine deployed to it."""

    named_by: str = ""

    @property
    def place(self) -> str:
        """Where it is, for people."""
        port = f" port {self.port}" if self.port != 22 else ""
        via = f" via {self.via}" if self.via else ""
        return f"{self.user}@{self.address}{port}{via}"


@dataclass
class HostLists:
    """The lists of hosts, read while these are observed: of equal lists one.

    ``spec``: the hosts of the spec. A host that some list names counts until it is taken off later.
    """

    swarm: str
    spec: Mapping[str, StoredLogin]
    _seen: dict[str, HostListState] = field(default_factory=dict)  # by host
    _read: dict[str, HostList] = field(default_factory=dict)  # by digest
    _fetched: set[str] = field(default_factory=set)  # digests
    _reading: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        own = HostList(0, dict(self.spec), {})
        self._read[_digest(own.hosts, {})] = own

    def read(self, agent: AgentSession, host: str, observed: Observed) -> None:
        """Reads the list of one host, unless an equal one is known."""
        from swarm_onboard.agent.verbs import host_list  # noqa: PLC0415  (`plan --offline` asks no host)

        from swarmctl.remote.ask import ask  # noqa: PLC0415

        state = observed.host_list
        if state is None:
            return
        with self._reading:
            self._seen[host] = state
            known = state.digest in self._read or state.digest in self._fetched
            if known or len(self._fetched) >= _MOST:
                return
            self._fetched.add(state.digest)
        with suppress(HostError):  # a lost connection shows with the next request
            self.take(host, ask(agent, host_list.handle, host_list.Request(self.swarm)))

    def take(self, host: str, answer: HostList) -> None:
        """Takes the list of one host."""
        digest = _digest(answer.hosts, answer.gone)
        self._seen[host] = HostListState(answer.epoch, digest)
        self._read.setdefault(digest, answer)

    @property
    def left(self) -> Mapping[str, StoredLogin]:
        """The hosts in the lists that the spec has no more, as far as it may be true."""
        return {name: login for name, (_, _, login) in self._left().items()}

    def source(self, name: str) -> str:
        """Returns a host whose list names the host ``name``, which left."""
        return self._left()[name][1]

    @property
    def epoch(self) -> int:
        """The epoch of a list that is written now."""
        return max(int(time.time()), *(_time(one.epoch) + 1 for one in self._seen.values()), 1)

    @property
    def hosts(self) -> list[str]:
        """The hosts whose lists are known."""
        return list(self._seen)

    def wanted(
        self, deployed: Collection[str], chosen: Collection[str], gone: Collection[str] = ()
    ) -> Wanted:
        """Returns the list that hosts should have: those that left but for the ``gone``, and those of the
        spec that are ``deployed``, named already, or not ``chosen`` by this run, which does not know them."""
        named = {name for one in self._lists() for name in one[2].hosts}
        left = {name: login for name, login in self.left.items() if name not in gone}
        hosts = left | {
            name: login
            for name, login in self.spec.items()
            if name in deployed or name in named or name not in chosen
        }
        kept = {name: at for name, at in self._gone().items() if name not in hosts}
        kept |= dict.fromkeys(gone, self.epoch)
        return hosts, dict(sorted(kept.items(), key=lambda one: one[1])[-_MOST_GONE:])

    def outdated(self, hosts: Iterable[str], wanted: Wanted) -> list[str]:
        """Returns those of the hosts whose list is another one."""
        digest = _digest(*wanted)
        return [host for host in hosts if host not in self._seen or self._seen[host].digest != digest]

    def _lists(self) -> list[tuple[int, str, HostList]]:
        """The lists that were read, with epoch and host, the oldest first."""
        return sorted(
            (
                (_time(one.epoch), host, self._read[one.digest])
                for host, one in self._seen.items()
                if one.digest in self._read
            ),
            key=lambda one: one[:2],
        )

    def _gone(self) -> dict[str, int]:
        found: dict[str, int] = {}
        for _, _, one in self._lists():
            for name, at in one.gone.items():
                found[name] = max(found.get(name, 0), _time(at))
        return found

    def _left(self) -> dict[str, tuple[int, str, StoredLogin]]:
        gone = self._gone()
        taken = {one.address for one in self.spec.values()}
        return {
            name: (epoch, host, login)
            for epoch, host, one in self._lists()
            for name, login in one.hosts.items()
            if name not in self.spec
            and epoch > gone.get(name, -1)
            and login.address not in taken
            and _is_valid(name, login)
        }


def _time(epoch: int) -> int:
    """The epoch, or 0 if the clock of who wrote it is far ahead."""
    return epoch if 0 <= epoch <= time.time() + _AHEAD else 0


def _is_valid(name: str, login: StoredLogin) -> bool:
    """True if a spec could have this host: what it names goes into commands of ``~/.ssh/config``."""
    try:
        TypeAdapter(HostName).validate_python(name)
        via = None if login.via is None else TypeAdapter(HostName).validate_python(login.via)
        Host(address=login.address, user=login.user, port=login.port, via=via)
    except ValidationError:
        return False
    return True


def objects(hosts: Mapping[str, StoredLogin]) -> dict[str, dict[str, Any]]:
    """Returns the logins as hosts keep them."""
    return {name: login._asdict() for name, login in hosts.items()}


def _digest(hosts: Mapping[str, StoredLogin], gone: Mapping[str, int]) -> str:
    return digest_of(objects(hosts), gone)
