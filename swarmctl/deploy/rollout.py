"""Plans and removals: hosts in parallel, each on a connection of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from swarm_agent.messages import RemoveRequest

from swarmctl.deploy.host_transaction import APPLY_TIMEOUT
from swarmctl.deploy.launch_files_on_hosts import LaunchFiles
from swarmctl.deploy.look import NO_SECRETS, look
from swarmctl.deploy.outcome import Removed
from swarmctl.plan.plan import HostPlan, Plan, Problem
from swarmctl.plan.reconcile import reconcile
from swarmctl.remote import agent_client, operators, parallel_hosts
from swarmctl.remote.transport import HostError, Session, Target, Transport
from swarmctl.render.bundle import Bundle


def observe(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    diff: bool = False,
    parallel: int = parallel_hosts.PARALLEL,
    secrets: Mapping[str, str] = NO_SECRETS,
    launch_files: LaunchFiles | None = None,
) -> Plan:
    """Observe every host and plan it; the plan of an unreachable host contains the reason.

    ``launch_files``: those to be read on hosts and checked.
    """

    def work(session: Session, target: Target, note: Callable[[str], None]) -> HostPlan:
        bundle = bundles[target.host]
        with agent_client.talk(session) as host:
            observed = look(host, bundle, contents=diff, secrets=secrets)
            if launch_files is not None:
                launch_files.read(host, bundle)
            return reconcile(bundle, observed, diff=diff)

    chosen = [targets[name] for name in bundles]
    plans = {
        event.host: planned(bundles[event.host], parallel_hosts.result_of(event))
        for event in parallel_hosts.run(chosen, work, transport=transport, parallel=parallel)
        if isinstance(event, parallel_hosts.Finished | parallel_hosts.Skipped)
    }
    swarm = next(iter(bundles.values())).swarm
    hosts = (plans[name] for name in bundles)
    return Plan(swarm, tuple(launch_files.checked(one) for one in hosts) if launch_files else tuple(hosts))


def planned(bundle: Bundle, result: HostPlan | HostError) -> HostPlan:
    """Returns the plan of a host; that of one with an error contains the reason."""
    if isinstance(result, HostPlan):
        return result
    problem = Problem(result.kind.value, result.message, result.hint)
    return HostPlan(bundle.host, None, bundle.digest, problem=problem)


def remove(
    swarm: str,
    targets: Iterable[Target],
    transport: Transport,
    *,
    parallel: int = parallel_hosts.PARALLEL,
    stop: parallel_hosts.Stop | None = None,
    stop_robots: bool = False,
) -> Iterator[parallel_hosts.Event[Removed]]:
    """Remove the swarm from every target: stop the robots; remove units, links and folder."""

    def work(session: Session, target: Target, note: Callable[[str], None]) -> Removed:
        request: RemoveRequest = {
            "verb": "remove",
            "swarm": swarm,
            "who": operators.this_one(),
            "stop_robots": stop_robots,
        }
        with agent_client.talk(session) as host:
            return Removed(host.ask(request, on_note=note, timeout=APPLY_TIMEOUT)["removed"])

    return parallel_hosts.run(targets, work, transport=transport, parallel=parallel, stop=stop)
