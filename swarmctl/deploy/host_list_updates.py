"""Reads the lists that hosts keep of the swarm's hosts, and stores new ones, on many hosts at a time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, closing

from swarm_onboard.agent.verbs import host_list

from swarmctl.deploy.host_lists import HostLists, Wanted, objects
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.ask import ask, ask_each
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Stop, results_of
from swarmctl.remote.transport import HostError, Target, Transport

_VERBS = ("host_list",)
Opens = Callable[[], AbstractContextManager[Transport]]


def read_all(
    lists: HostLists, targets: Iterable[Target], opens: Opens, parallel: int
) -> Mapping[str, HostError]:
    """Reads the list of every host. Returns the errors of those that do not give it."""

    chosen = {target.host: target for target in targets}
    requests = dict.fromkeys(chosen, host_list.Request(lists.swarm))
    with opens() as transport:
        results = results_of(ask_each(host_list.handle, requests, chosen, transport, parallel=parallel))
    for host, found in results.items():
        if not isinstance(found, HostError):
            lists.take(host, found)
    return {host: found for host, found in results.items() if isinstance(found, HostError)}


def write_all_anew(
    lists: HostLists,
    wanted: Wanted,
    targets: Sequence[Target],
    opens: Opens,
    *,
    forgotten: Collection[str],
    parallel: int,
) -> Mapping[str, HostError]:
    """As ``write_all``, over connections of its own."""
    with opens() as transport, closing(Connections(transport, Stop(), _VERBS)) as connections:
        return write_all(lists, wanted, targets, connections, forgotten=forgotten, parallel=parallel)


def write_all(
    lists: HostLists,
    wanted: Wanted,
    targets: Iterable[Target],
    connections: Connections,
    *,
    forgotten: Collection[str] = (),
    parallel: int,
) -> Mapping[str, HostError]:
    """Stores a list on hosts. Returns the errors of those that keep another one."""
    request = host_list.Request(
        lists.swarm,
        objects(wanted[0]),
        wanted[1],
        lists.epoch,
        sorted(forgotten),
        agent_client.new_txid(),
        who=operators.this_one(),
    )

    def work(target: Target, note: object) -> None:
        with connections.agent_session(target) as host:
            ask(host, host_list.handle, request)

    events = parallel_hosts.each(list(targets), work, parallel=parallel, stop=Stop())
    return {host: one for host, one in results_of(events).items() if isinstance(one, HostError)}
