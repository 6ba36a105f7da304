"""Which delivered packages have to be built, for which platform, and on which host. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from swarmctl.plan.host_preparation import HostPreparation, Kind, Step
from swarmctl.plan.plan import Problem
from swarmctl.ros_packages.builds import build_key, with_dependencies, without_ros
from swarmctl.ros_packages.package import DeliveredPackage
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.used_packages import on_host
from swarmctl.yamltext import hostlist


@dataclass(frozen=True)
class Build:
    """What a host builds: ``keys`` of the missing builds by package, for ``hosts`` of its platform.

    ``sources``: all packages of these hosts that are built, and those they depend on; a build that is there
    already costs no time again.
    """

    builder: str
    platform: str
    hosts: tuple[str, ...]
    keys: Mapping[str, str]
    sources: tuple[DeliveredPackage, ...]

    @property
    def steps(self) -> tuple[Step, ...]:
        """The steps of the build in the plan of its host."""
        cause = f"for {hostlist.written(self.hosts)} ({self.platform})"
        origins = {one.name: one.origin for one in self.sources}
        return tuple(Step(Kind.COMPILE, name, f"{origins[name]}, {cause}") for name in self.keys)


def keys_of(swarm: Swarm, host: str, platform: str) -> dict[str, str]:
    """Returns the keys of all builds that a host of this platform needs, by package."""
    return {
        one.name: build_key(one.name, swarm.packages, swarm.distro_of(host), platform)
        for one in on_host(swarm, swarm.hosts[host])
        if one.built_by
    }


def builds_of(
    swarm: Swarm,
    platforms: Mapping[str, str],
    stored: Collection[str],
    hosts: Collection[str],
) -> tuple[tuple[Build, ...], Mapping[str, Problem]]:
    """Returns the builds that are due, and by host why its packages cannot be built.

    ``platforms``: of the hosts that answered; ``stored``: the keys of builds that exist; ``hosts``: those
    that are chosen, of which alone one may build. A host without ROS yet gets that of its builder.
    """
    due: dict[str, dict[str, str]] = {}  # missing keys by package, by platform
    users: dict[str, list[str]] = {}  # hosts by platform
    for host in hosts:
        if platform := platforms.get(host, ""):
            keys = keys_of(swarm, host, platform)
            if missing := {name: key for name, key in keys.items() if key not in stored}:
                due.setdefault(platform, {}).update(missing)
                users.setdefault(platform, []).append(host)
    builds: list[Build] = []
    problems: dict[str, Problem] = {}
    for platform, keys in due.items():
        able = (one for one in swarm.builders if one in hosts and one in platforms)
        builder = next((one for one in able if _alike(platforms[one], platform)), None)
        if builder is None:
            names = ", ".join(keys)
            problem = Problem(
                "lacks",
                f"a build of {names} for {platform}",
                _advice(swarm, hosts, platforms, platform),
            )
            problems |= dict.fromkeys(users[platform], problem)
        else:
            names_used = [one.name for host in users[platform] for one in on_host(swarm, swarm.hosts[host])]
            sources = with_dependencies(_built(swarm, names_used), swarm.packages)
            builds.append(Build(builder, platform, tuple(users[platform]), keys, sources))
    return tuple(builds), problems


def planned(
    seen: Collection[HostPreparation], builds: Collection[Build], problems: Mapping[str, Problem]
) -> tuple[HostPreparation, ...]:
    """Returns the preparations with the builds as steps of their builders, and with the problems."""
    steps: dict[str, tuple[Step, ...]] = {}
    for build in builds:
        steps[build.builder] = (*steps.get(build.builder, ()), *build.steps)
    return tuple(
        replace(
            host,
            steps=(*host.steps, *steps.get(host.host, ())),
            lacks=(*host.lacks, *([problems[host.host]] if host.host in problems else [])),
        )
        for host in seen
    )


def _built(swarm: Swarm, names: Collection[str]) -> Iterator[str]:
    return (name for name in dict.fromkeys(names) if swarm.packages[name].built_by)


def _alike(one: str, other: str) -> bool:
    """True if a build for one platform runs on the other, as far as it is known: one may have no ROS yet."""
    return one == other or (without_ros(one) == without_ros(other) and without_ros(one) in (one, other))


def _advice(swarm: Swarm, hosts: Collection[str], platforms: Mapping[str, str], platform: str) -> str:
    name = f"name a host of {platform} under `ros.builders`"
    away = [one for one in swarm.builders if one not in hosts]
    if away:
        return f"include the builder {hostlist.written(away)}, or {name}"
    for one in swarm.builders:
        of = platforms.get(one, "")
        if of and without_ros(of) == without_ros(platform):
            return f"update ROS: the builder {one} is {of}; or {name} as well"
    return f"{name}; {hostlist.written(swarm.builders)} is none"
