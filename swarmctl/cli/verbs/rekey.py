"""``swarmctl rekey``: new WireGuard keys for the hosts of a sealed swarm, without an interruption."""

from __future__ import annotations

from swarmctl.cli import console, sealed_hosts, selected
from swarmctl.cli.where import Where, with_where


@with_where("limit")
def rekey(
    where: Where,
) -> None:
    """Give the hosts of a sealed swarm new WireGuard keys; the old ones are worth nothing then.

    A host changes its key once all its peers know the new one. What an interrupted run has left is finished.
    """
    from swarmctl.deploy import rekey as keys
    from swarmctl.yamltext import hostlist

    swarm, pins, exchange = sealed_hosts.reached(where)
    members = keys.members(swarm)
    chosen = [one for one in selected.hosts(swarm.candidates, where.limit) if one in members]
    done = keys.rekey(swarm, chosen, pins, exchange)
    if done.changed:
        console.out().print(f"{hostlist.written(done.changed)}: a new WireGuard key, pinned in {pins.path}")
    sealed_hosts.show_errors(done.kept, "keeps its key")
    behind = {host: one for host, one in done.behind.items() if host not in done.kept}
    sealed_hosts.show_errors(behind, "does not know all keys until the next deploy reaches it")
    where.advise("status")
    sealed_hosts.end({**done.kept, **done.behind})
