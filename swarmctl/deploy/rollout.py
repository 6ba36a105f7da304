"""Plans and removals: hosts in parallel, each on a connection of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing

from swarm_onboard.agent.verbs import remove as remove_verb

from swarmctl.deploy.host_lists import HostLists
from swarmctl.deploy.motion_guard import Guard, host_error
from swarmctl.deploy.observe_host import NO_SECRETS, observe_host
from swarmctl.deploy.outcome import Removed
from swarmctl.plan.plan import HostPlan, Plan, Problem
from swarmctl.plan.reconcile import reconcile
from swarmctl.plan.robots_in_use import Dependents
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.agent_archive import DEPLOY_VERBS
from swarmctl.remote.ask import ask
from swarmctl.remote.connections import Connections
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Session, Target, Transport
from swarmctl.render.bundle import Bundle


def observe(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    diff: bool = False,
    parallel: int,
    secrets: Mapping[str, str] = NO_SECRETS,
    host_lists: HostLists | None = None,
) -> Plan:
    """Observe every host and plan it; the plan of an unreachable host contains the reason.

    ``host_lists``: takes their lists of hosts.
    """

    def work(session: Session, target: Target, note: Callable[[str], None]) -> HostPlan:
        bundle = bundles[target.host]
        with agent_client.agent_session(session) as host:
            observed = observe_host(host, bundle, contents=diff, secrets=secrets)
            if host_lists is not None:
                host_lists.read(host, target.host, observed)
            return reconcile(bundle, observed, diff=diff)

    chosen = [targets[name] for name in bundles]
    events = parallel_hosts.run(chosen, work, transport=transport, parallel=parallel)
    found = parallel_hosts.results_of(events)
    swarm = next(iter(bundles.values())).swarm
    return Plan(swarm, tuple(planned(bundle, found[name]) for name, bundle in bundles.items()))


def planned(bundle: Bundle, result: HostPlan | HostError) -> HostPlan:
    """Returns the plan of a host; that of one with an error contains the reason."""
    if isinstance(result, HostPlan):
        return result
    problem = Problem(result.kind.value, result.message, result.hint)
    return HostPlan(bundle.host, None, bundle.digest, problem=problem)


def remove(
    hosts: Sequence[str],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    dependents: Dependents,
    parallel: int,
    stop: parallel_hosts.Stop | None = None,
    stop_robots: bool = False,
) -> Iterator[parallel_hosts.Event[Removed]]:
    """Remove the swarm from ``hosts``: stop the robots; remove units, links and folder.

    A host stays as it is if robots in use depend on its units, on whichever host of ``targets`` they are.
    """
    stop = stop or parallel_hosts.Stop()
    with closing(Connections(transport, stop, DEPLOY_VERBS)) as connections:

        def work(target: Target, note: Callable[[str], None]) -> Removed:
            request = remove_verb.Request(
                dependents.swarm.name, who=operators.this_one(), stop_robots=stop_robots
            )
            with connections.agent_session(target) as host:
                answer = ask(
                    host, remove_verb.handle, request, on_note=note, timeout=agent_client.CHANGE_TIMEOUT
                )
                return Removed(answer.removed)

        guard = Guard(dependents, targets, connections, parallel, stop, lenient=True, stop_robots=stop_robots)
        seen = guard.clear({host: dependents.units_on(host) for host in hosts})
        yield from seen.notes
        yield from (Finished(host, host_error(one), 0.0) for host, one in seen.problems.items())
        free = [targets[host] for host in hosts if host not in seen.problems]
        yield from parallel_hosts.each(free, work, parallel=parallel, stop=stop)
