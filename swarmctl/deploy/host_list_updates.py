"""Reads the lists that hosts keep of the swarm's hosts, and stores new ones, on many hosts at a time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, closing

from swarm_onboard.agent.host_list_messages import HostListAnswer, HostListRequest

from swarmctl.deploy.host_lists import HostLists, Wanted, read_host_list
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Finished, Skipped, Stop, result_of
from swarmctl.remote.transport import HostError, Session, Target, Transport

_VERBS = ("host_list",)
Opens = Callable[[], AbstractContextManager[Transport]]


def read_all(
    lists: HostLists, targets: Iterable[Target], opens: Opens, parallel: int
) -> Mapping[str, HostError]:
    """Reads the list of every host. Returns the errors of those that do not give it."""

    def work(session: Session, target: Target, note: object) -> HostListAnswer:
        with agent_client.agent_session(session, verbs=_VERBS) as host:
            return read_host_list(host, lists.swarm)

    errors: dict[str, HostError] = {}
    with opens() as transport:
        for event in parallel_hosts.run(list(targets), work, transport=transport, parallel=parallel):
            if isinstance(event, Finished | Skipped):
                found = result_of(event)
                if isinstance(found, HostError):
                    errors[event.host] = found
                else:
                    lists.take(event.host, found)
    return errors


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
    request: HostListRequest = {
        "verb": "host_list",
        "swarm": lists.swarm,
        "who": operators.this_one(),
        "wait": 2,
        "epoch": lists.epoch,
        "hosts": wanted[0],
        "gone": wanted[1],
        "forgotten": sorted(forgotten),
        "txid": agent_client.new_txid(),
    }

    def work(target: Target, note: object) -> None:
        with connections.agent_session(target) as host:
            host.request(request)

    events = parallel_hosts.each(list(targets), work, parallel=parallel, stop=Stop())
    results = {event.host: result_of(event) for event in events if isinstance(event, Finished | Skipped)}
    return {host: one for host, one in results.items() if isinstance(one, HostError)}
