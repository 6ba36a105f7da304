"""The request to each host to record: topics that it publishes, as far as they are wanted. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from swarm_onboard.agent.verbs.record import Request

from swarmctl.render.middleware import Middleware, middleware_of
from swarmctl.swarm.resolved import Island, Swarm


def requests(
    swarm: Swarm,
    accounts: Mapping[str, str],
    patterns: Sequence[str],
    *,
    seconds: float,
    megabytes: int,
) -> dict[str, Request]:
    """Returns the request to each host that runs ROS: ``seconds`` of what ``patterns`` match, 0 for ever.

    ``accounts``: as whom each host is logged in to; ``megabytes``: of a bag, until a new one begins.
    """
    found: dict[str, Request] = {}
    for island in swarm.islands:
        middleware = middleware_of(island.distro)
        recorder = middleware.bag_recorder
        master = middleware.master(swarm, island)
        hosts = {name: swarm.hosts[name] for name in island.hosts}
        homes = {
            text.lower(): name
            for name, host in hosts.items()
            for text in (host.ros_address, host.advertised, name)
        }
        nodes = {one: name for name in island.hosts for one in _nodes(swarm, middleware, name)}
        drivers = [middleware.driver(swarm, robot).node for name in hosts for robot in swarm.robots_on(name)]
        declared = _declared(swarm, middleware, island)
        for name in island.hosts:
            found[name] = Request(
                swarm.name,
                accounts[name],
                list(recorder.command(swarm.name, name, megabytes)),
                list(patterns),
                seconds,
                module=recorder.graph.name,
                master=master.uri if master else "",
                host=name,
                hub=island.hub,
                homes=homes,
                nodes=nodes,
                awaited=[one for one in drivers if one],
                declared=declared,
            )
    return found


def _nodes(swarm: Swarm, middleware: Middleware, host: str) -> Iterator[str]:
    """The nodes of a host whose names are known."""
    for robot in swarm.robots_on(host):
        driver = middleware.driver(swarm, robot)
        yield from filter(None, (driver.node, driver.gate and driver.gate.node))
    for program in swarm.programs_on(host):
        yield from filter(None, (middleware.program(swarm, program).name,))


def _declared(swarm: Swarm, middleware: Middleware, island: Island) -> dict[str, str]:
    """The host of each topic that drivers, gates and programs publish by the spec, and of the commands that
    drivers get from nodes that the spec does not have.

    A topic of several hosts is the hub's.
    """
    origins: dict[str, set[str]] = {}
    for host in island.hosts:
        topics: list[str] = []
        for robot in swarm.robots_on(host):
            driver = middleware.driver(swarm, robot)
            topics += [one.name for one in driver.topics]
            topics += [driver.gate.output, driver.gate.reports.name] if driver.gate else []
            topics += [driver.command] if driver.command else []
        for program in swarm.programs_on(host):
            topics += [name for name, _ in middleware.program(swarm, program).publishes]
        for topic in topics:
            origins.setdefault(topic, set()).add(host)
    return {topic: min(hosts) if len(hosts) == 1 else island.hub for topic, hosts in origins.items()}
