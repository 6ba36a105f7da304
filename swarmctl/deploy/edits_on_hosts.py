"""Reads what people have edited on the hosts of a swarm."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from swarmctl.adoption.changes import EditedFile
from swarmctl.deploy.observe_host import observe_host
from swarmctl.plan.host_edits import edited_files
from swarmctl.remote import agent_client, parallel_hosts
from swarmctl.remote.transport import HostError, Session, Target, Transport
from swarmctl.render.bundle import Bundle


def edits_on_hosts(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    parallel: int,
) -> dict[str, list[EditedFile] | HostError]:
    """Returns by host the edits that ``bundles`` would replace, or why the host did not say."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> list[EditedFile]:
        with agent_client.agent_session(session) as host:
            return edited_files(bundles[target.host], observe_host(host, bundles[target.host]))

    chosen = [targets[name] for name in bundles]
    events = parallel_hosts.run(chosen, work, transport=transport, parallel=parallel)
    found = parallel_hosts.results_of(events)
    return {name: found[name] for name in bundles}
