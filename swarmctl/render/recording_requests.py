"""The request to each host to record: topics that it publishes, as far as they are wanted. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from swarm_onboard.agent.recording_messages import RecordRequest

from swarmctl.render.bag_recorder import BagRecorder
from swarmctl.render.middleware import Middleware, middleware_of
from swarmctl.swarm.resolved import Island, Swarm


def requests(
    swarm: Swarm,
    recorder: BagRecorder,
    accounts: Mapping[str, str],
    patterns: Sequence[str],
    *,
    seconds: float,
    megabytes: int,
) -> dict[str, RecordRequest]:
    """Returns the request to each host that runs ROS: ``seconds`` of what ``patterns`` match, 0 for ever.

    ``accounts``: as whom each host is logged in to; ``megabytes``: of a bag, until a new one begins.
    """
    found: dict[str, RecordRequest] = {}
    for island in swarm.islands:
        middleware = middleware_of(island.distro)
        master = middleware.master(swarm, island)
        hosts = {name: swarm.hosts[name] for name in island.hosts}
        homes = {
            text.lower(): name
            for name, host in hosts.items()
            for text in (host.ros_address, host.advertised, name)
        }
        declared = declared_topics(swarm, middleware, island)
        for name in island.hosts:
            found[name] = {
                "verb": "record",
                "swarm": swarm.name,
                "account": accounts[name],
                "command": list(recorder.command(swarm.name, name, megabytes)),
                "topics": [one for one in declared[name] if any(fnmatchcase(one, two) for two in patterns)],
                "patterns": list(patterns),
                "graph": {
                    "module": recorder.graph.name,
                    "master": master.uri if master else "",
                    "host": name,
                    "hub": island.hub,
                    "homes": homes,
                },
                "seconds": seconds,
            }
    return found


def declared_topics(swarm: Swarm, middleware: Middleware, island: Island) -> dict[str, list[str]]:
    """Returns the topics that drivers, gates and programs of each host publish by the spec, and the commands
    that its drivers get from nodes that the spec does not have.

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
    found: dict[str, list[str]] = {host: [] for host in island.hosts}
    for topic, hosts in origins.items():
        found[min(hosts) if len(hosts) == 1 else island.hub].append(topic)
    return found
