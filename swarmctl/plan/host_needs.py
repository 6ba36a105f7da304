"""What a host needs before a deploy, with the entries of the spec that need it. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from swarmctl.plan.host_tools import TOOLS
from swarmctl.plan.package_needs import package_needs
from swarmctl.plan.package_requirement import Entries, PackageRequirement
from swarmctl.render.bundle import Bundle, package, required
from swarmctl.render.middleware import middleware_of
from swarmctl.spec.install_model import Install
from swarmctl.swarm.resolved import Host, Swarm, SwarmctlDriver

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
