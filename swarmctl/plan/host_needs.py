"""What a host needs before a deploy, with the entries of the spec that need it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import yaml

from swarmctl import resources
from swarmctl.render.bundle import Bundle, package, required
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.install_model import Install
from swarmctl.swarm.resolved import Host, Swarm, SwarmctlDriver
from swarmctl.swarm.used_packages import in_swarm, on_host

Entries = tuple[str, ...]
"""The entries of the spec that need something, such as ``robots.k3``."""


@dataclass(frozen=True)
class PackageRequirement:
    """Something that one of the Debian ``packages`` brings; without ``requirement`` the package itself.

    ``key``: the rosdep key of a package.xml that it is; the first of ``packages`` that apt knows counts then.
    """

    requirement: str
    packages: tuple[str, ...]
    entries: Entries
    key: str = ""


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


@dataclass(frozen=True)
class Tool:
    """``without`` describes the host that lacks it, ``then`` what takes it into use."""

    package: str
    without: str = ""
    then: str = ""

    @property
    def note(self) -> str:
        """What a plan notes about a host that lacks it."""
        return f"{self.without}; `swarmctl prepare` installs it (`apt install {self.package}`){self.then}"


TOOLS = {
    "chronyd": Tool("chrony", "chrony: its clock is not synchronised", ", then deploy again"),
    "bluetoothctl": Tool("bluez", "bluetoothctl: its robots cannot be paired", ", then deploy again"),
    "rfcomm": Tool("bluez", "rfcomm: its Bluetooth robots have no serial line", ", then deploy again"),
    "avrdude": Tool("avrdude", "avrdude: `swarmctl firmware flash` cannot write its boards"),
    "iw": Tool("iw", "iw: wlan power saving stays on", ", then reboot"),
    "nft": Tool("nftables"),
    "wg": Tool("wireguard-tools"),
    "podman": Tool("podman"),
    "docker": Tool("docker.io"),
}


def install_hints(distro: str, missing: Sequence[str]) -> Iterator[str]:
    """Yields what to do on a host that lacks ``missing``: tools first, then what belongs to its ROS."""
    if tools := [TOOLS[one].package for one in missing if one in TOOLS]:
        yield f"`apt install {' '.join(tools)}`"
    yield from middleware_of(distro).install_hints([one for one in missing if one not in TOOLS])


LINE_GROUPS = ("dialout",)  # who opens a robot's line
ACCOUNT_GROUPS = ("dialout", "audio", "video", "plugdev")  # of the units of the account (account.j2)


@dataclass(frozen=True)
class HostNeeds:
    """What one host needs. ``account``: the one that the spec logs in as."""

    swarm: str
    host: str
    account: str
    distro: str
    packages: tuple[PackageRequirement, ...] = ()
    pip: Mapping[str, Entries] = field(default_factory=dict)
    groups: Mapping[str, Entries] = field(default_factory=dict)
    workspaces: Mapping[str, Entries] = field(default_factory=dict)
    images: Mapping[tuple[str, str], Entries] = field(default_factory=dict)  # by engine and image
    by_hand: tuple[str, ...] = ()  # what a person sets on a robot itself

    @property
    def debian(self) -> tuple[str, ...]:
        """Every Debian package that may be installed."""
        return tuple(dict.fromkeys(name for need in self.packages for name in need.packages))

    @property
    def keys(self) -> tuple[str, ...]:
        """The rosdep keys."""
        return tuple(dict.fromkeys(need.key for need in self.packages if need.key))


def needs_of(swarm: Swarm, host: Host, bundle: Bundle) -> HostNeeds:
    """Returns what ``host`` needs for its ``bundle``, and what the spec installs beside."""
    entries = {**bundle.wants, **bundle.requires}
    for unit in bundle.units:
        for name in unit.packages:
            one = package(name)
            entries[one] = tuple(dict.fromkeys((*entries.get(one, ()), f"programs.{unit.program}")))
    workspaces = {name: who for one, who in bundle.requires.items() for name in _workspace(one)}
    installed = list(_installs(swarm, host))
    return HostNeeds(
        swarm=swarm.name,
        host=host.name,
        account=host.user,
        distro=swarm.distro_of(host.name),
        packages=(
            *_needs((*bundle.asks, *bundle.wants), entries, swarm.distro_of(host.name)),
            *package_needs(swarm, host),
            *(
                PackageRequirement("", (name,), who)
                for name, who in _by_name((i.apt, at) for i, at in installed).items()
            ),
        ),
        pip=_by_name((one.pip, at) for one, at in installed),
        groups=_groups(swarm, host),
        workspaces=workspaces,
        images=_images(swarm, host),
        by_hand=bundle.by_hand,
    )


def _workspace(requirement: str) -> Iterator[str]:
    kind, name = required(requirement)
    if kind == "workspace":
        yield name


def _needs(
    requirements: Iterable[str], entries: Mapping[str, Entries], distro: str
) -> Iterator[PackageRequirement]:
    middleware = middleware_of(distro)
    for one in requirements:
        if required(one)[0] != "workspace":
            tool = TOOLS.get(one)
            packages = (tool.package,) if tool else middleware.debian_packages(one)
            yield PackageRequirement(one, packages, entries.get(one, ()))


def _installs(swarm: Swarm, host: Host) -> Iterator[tuple[Install, str]]:
    yield host.install, f"hosts.{host.name}.install"
    for program in swarm.programs_on(host.name):
        yield program.declared.install, f"programs.{program.name}.install"


def _by_name(lists: Iterable[tuple[tuple[str, ...], str]]) -> dict[str, Entries]:
    found: dict[str, Entries] = {}
    for names, entry in lists:
        for name in names:
            found[name] = (*found.get(name, ()), entry)
    return found


def _images(swarm: Swarm, host: Host) -> dict[tuple[str, str], Entries]:
    found: dict[tuple[str, str], Entries] = {}
    for program in swarm.programs_on(host.name):
        container = program.declared.container
        if container is not None:
            key = (container.engine, container.image)
            found[key] = (*found.get(key, ()), f"programs.{program.name}")
    return found


def _groups(swarm: Swarm, host: Host) -> dict[str, Entries]:
    robots = [
        (LINE_GROUPS if isinstance(robot.driver, SwarmctlDriver) else ACCOUNT_GROUPS, f"robots.{robot.name}")
        for robot in swarm.robots_on(host.name)
    ]
    programs = [
        (ACCOUNT_GROUPS, f"programs.{one.name}")
        for one in swarm.programs_on(host.name)
        if one.declared.use is None
    ]
    return _by_name([*robots, *programs])
