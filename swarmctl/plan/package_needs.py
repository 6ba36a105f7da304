"""What delivered packages need by their package.xml to run on a host, and to be built there. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache

import yaml

from swarmctl import resources
from swarmctl.plan.package_requirement import Entries, PackageRequirement
from swarmctl.render.bundle import package
from swarmctl.render.middleware import middleware_of
from swarmctl.swarm.resolved import Host, Swarm
from swarmctl.swarm.used_packages import in_swarm, on_host

_COMPILERS = ("g++", "make")
_TOOLS = ("catkin", "rosgraph")  # rosgraph has the version of ROS, which is part of a platform


def package_needs(swarm: Swarm, host: Host) -> Iterator[PackageRequirement]:
    """Yields the needs of the packages of ``host``, and those of all builds on a builder."""
    distro, run = swarm.distro_of(host.name), dict[str, Entries]()
    for one in on_host(swarm, host):
        _add(swarm, run, one.name, one.to_run)
    build: dict[str, Entries] = {}
    if host.name in swarm.builders and (compiled := [one for one in in_swarm(swarm) if one.built_by]):
        for one in compiled:
            _add(swarm, build, one.name, one.to_build)
        entries = tuple(one.origin for one in compiled)
        build |= dict.fromkeys(_TOOLS, entries)
        yield from (PackageRequirement("", (name,), entries) for name in _COMPILERS)
    for key, who in build.items():
        yield _need(distro, key, (*who, *run.pop(key, ())), headers=True)
    for key, who in run.items():
        headers = any(one.built_by and one.origin in who for one in swarm.packages.values())
        yield _need(distro, key, who, headers=headers)


def _add(swarm: Swarm, found: dict[str, Entries], name: str, keys: frozenset[str]) -> None:
    """Adds the ``keys`` that no delivered package is; those that the spec skips are no needs."""
    for key in sorted(keys - swarm.packages[name].skip_keys - set(swarm.packages)):
        found[key] = (*found.get(key, ()), swarm.packages[name].origin)


def _need(distro: str, key: str, entries: Entries, *, headers: bool) -> PackageRequirement:
    known = system_packages().get(key, ())
    if known:
        return PackageRequirement("", known, entries, key)
    candidates = middleware_of(distro).packages_of_key(key, headers=headers)
    return PackageRequirement(package(key), candidates, tuple(dict.fromkeys(entries)), key)


@lru_cache
def system_packages() -> Mapping[str, tuple[str, ...]]:
    """Returns the Debian packages of the known keys that are not ROS packages."""
    text = (resources.templates() / "data/system_keys.yaml").read_text("utf-8")
    return {key: tuple(names) for key, names in yaml.safe_load(text).items()}
