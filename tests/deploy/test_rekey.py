"""New keys and lost hosts: whatever host is away or dies on the way, two ends keep a key in common."""

from __future__ import annotations

import base64
import itertools
from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.verbs.wireguard_key import Answer, Request
from swarm_onboard.tunnel.keys import Keys, joined, line

from swarmctl.deploy import rekey as keys
from swarmctl.remote.transport import HostError, Kind
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.loading import load_swarm

HOSTS = ("koala-laptop", "k3-pi", "epuck-pi")  # the robots' hosts are peers of the laptop, and of each other
LOST = HostError(Kind.LOST, "the connection was lost")


class Pins:
    def __init__(self, text: str) -> None:
        self.text = text

    @property
    def keys(self) -> Keys:
        return Keys(self.text)

    def add(self, lines: str) -> None:
        self.text = joined(self.text, lines)


class Hosts:
    """The agents of the hosts, which keep keys as ``agent.wireguard_key`` does.

    ``dies``: numbers of requests, in their order, that fail; the second says whether they took place.
    """

    def __init__(self, dies: Mapping[int, bool] | None = None) -> None:
        self._numbers = itertools.count(1)
        self._requests = itertools.count()
        self.dies = dies or {}
        self.away: set[str] = set()
        self.key = {host: self._made() for host in HOSTS}
        self.next: dict[str, str] = {}
        self.pins = Pins("".join(line(host, key) for host, key in self.key.items()))
        self.known = dict.fromkeys(HOSTS, self.pins.text)

    def _made(self) -> str:
        return base64.b64encode(next(self._numbers).to_bytes(32, "big")).decode()

    def exchange(self, requests: Mapping[str, Request]) -> Mapping[str, Answer | HostError]:
        return {host: self._one(host, request) for host, request in requests.items()}

    def _one(self, host: str, request: Request) -> Answer | HostError:
        done = self.dies.get(next(self._requests))
        if host in self.away or done is False:
            return HostError(Kind.UNREACHABLE, f"{host}: no answer")
        self.known[host] = joined(self.known[host], request.known)
        if lost := request.expel:
            own = Keys(self.known[host]).live.get(lost, ())
            self.known[host] = joined(self.known[host], "".join(line(lost, one, retired=True) for one in own))
        if request.make_next:
            self.next.setdefault(host, self._made())
        if (wanted := request.use) and wanted != self.key[host]:
            assert self.next.pop(host) == wanted
            self.key[host] = wanted
        return LOST if done else Answer(self.key[host], self.next.get(host, ""))

    def accept(self, host: str, other: str) -> bool:
        """Whether ``host`` knows the key that ``other`` has."""
        return self.key[other] in Keys(self.known[host]).live.get(other, ())


@pytest.fixture(scope="module")
def swarm(tmp_path_factory: pytest.TempPathFactory) -> Swarm:
    spec = tmp_path_factory.mktemp("sealed") / "swarm.yaml"
    text = (ROOT / "examples/paper-leader/swarm.yaml").read_text("utf-8")
    spec.write_text(f"{text}security: sealed\n", "utf-8")
    found, errors = load_swarm(spec)
    assert found is not None, errors
    assert found.peers["koala-laptop"] == {"k3-pi", "epuck-pi"}
    return found


def pairs_in_common(hosts: Hosts, swarm: Swarm) -> bool:
    return all(hosts.accept(one, other) for one in HOSTS for other in swarm.peers[one])


def test_every_host_has_a_new_key_and_the_old_ones_are_retired(swarm: Swarm) -> None:
    hosts = Hosts()
    before = dict(hosts.key)
    done = keys.rekey(swarm, HOSTS, hosts.pins, hosts.exchange)
    assert (done.changed, done.kept, done.behind) == (HOSTS, {}, {})
    assert pairs_in_common(hosts, swarm)
    assert hosts.pins.keys.live == {host: (key,) for host, key in hosts.key.items()}
    assert hosts.pins.keys.retired == {host: (key,) for host, key in before.items()}
    assert all(Keys(one).retired == hosts.pins.keys.retired for one in hosts.known.values())


def test_peers_of_a_host_that_is_away_keep_their_keys(swarm: Swarm) -> None:
    hosts = Hosts()
    hosts.away = {"epuck-pi"}
    before = dict(hosts.key)
    done = keys.rekey(swarm, HOSTS, hosts.pins, hosts.exchange)
    assert (done.changed, hosts.key) == ((), before)
    assert str(done.kept["koala-laptop"]) == "epuck-pi does not know its next key"
    assert pairs_in_common(hosts, swarm)
    hosts.away = set()
    assert keys.rekey(swarm, HOSTS, hosts.pins, hosts.exchange).changed == HOSTS
    assert pairs_in_common(hosts, swarm)


def test_a_foreign_key_is_not_replaced(swarm: Swarm) -> None:
    hosts = Hosts()
    hosts.key["k3-pi"] = base64.b64encode(bytes(32)).decode()
    done = keys.rekey(swarm, ["k3-pi"], hosts.pins, hosts.exchange)
    assert str(done.kept["k3-pi"]) == "its WireGuard key is not the pinned one"
    assert hosts.pins.keys.live["k3-pi"] != (hosts.key["k3-pi"],)


@given(dies=st.dictionaries(st.integers(0, 14), st.booleans(), max_size=5))
def test_whatever_dies_two_peers_have_keys_in_common(swarm: Swarm, dies: Mapping[int, bool]) -> None:
    """A request may be lost on its way, or its answer; the same command, run again, finishes it."""
    hosts = Hosts(dies)
    before = dict(hosts.key)
    keys.rekey(swarm, HOSTS, hosts.pins, hosts.exchange)
    assert pairs_in_common(hosts, swarm)
    hosts.dies = {}
    keys.rekey(swarm, HOSTS, hosts.pins, hosts.exchange)
    assert pairs_in_common(hosts, swarm)
    assert not {*before.values()} & {*hosts.key.values()}
    assert hosts.pins.keys.live == {host: (key,) for host, key in hosts.key.items()}


def test_a_lost_host_is_accepted_nowhere(swarm: Swarm) -> None:
    hosts = Hosts()
    newer = base64.b64encode(b"n" * 32).decode()  # of a rekey from another machine
    hosts.known["koala-laptop"] += line("k3-pi", newer)
    hosts.away = {"epuck-pi"}
    behind = keys.expel(swarm, "k3-pi", hosts.pins, hosts.exchange)
    assert set(behind) == {"epuck-pi"}
    assert "k3-pi" not in Keys(hosts.known["koala-laptop"]).live
    assert hosts.accept("epuck-pi", "k3-pi")
    hosts.away = set()
    assert keys.expel(swarm, "k3-pi", hosts.pins, hosts.exchange) == {}
    assert not hosts.accept("epuck-pi", "k3-pi")
