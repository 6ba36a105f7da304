"""The seam to what joins the masters of several islands: what a multimaster provider must offer.

To add one, write an object with the members of ``MultimasterProvider`` and register it under the name that
``multimaster.provider`` gives (see ``swarmctl.plugins``).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, cast

from swarmctl.plugins import MULTIMASTERS
from swarmctl.render.bundle import Part
from swarmctl.render.middleware import Capability
from swarmctl.spec.model import Spec
from swarmctl.spec.ros_model import Multimaster
from swarmctl.swarm import names
from swarmctl.swarm.bridges import joins, provider_name
from swarmctl.swarm.ports import Listener, PortRange
from swarmctl.swarm.resolved import Host, Island, Swarm, joinable


@dataclass(frozen=True)
class Discovery:
    """The limits of a provider whose masters find each other by heartbeats."""

    group: str  # its multicast group, unless the spec names another
    forget_factor: float  # how many times `active_request_after` its `remove_after` is by default


@dataclass(frozen=True)
class JoinNodes:
    """The nodes that join a hub's master to others, by full names.

    ``reporter`` is the one that publishes the state of the bridges on /diagnostics.
    """

    names: tuple[str, ...]
    reporter: str | None = None


class MultimasterProvider(Protocol):
    """One way to bridge topics between the masters of several islands.

    Its systemd unit, if a hub has one, is ``names.unit(swarm.name, names.MULTIMASTER)``.
    """

    @property
    def settings(self) -> frozenset[str]:
        """The keys of ``multimaster:`` that it reads beside ``provider`` and ``topics``."""

    @property
    def needs(self) -> Capability | None:
        """What a middleware must have whose islands it joins."""

    @property
    def discovery(self) -> Discovery | None:
        """The limits of its discovery; None if it discovers nothing."""

    @property
    def memory_mb(self) -> int:
        """Memory that its nodes take on a hub, MB."""

    @property
    def offsets(self) -> tuple[int, ...]:
        """The TCP ports that it takes on a hub, counted from the port of the master."""

    @property
    def relays(self) -> bool:
        """Whether it publishes on the hub what it brings; else nodes of both islands connect directly."""

    @property
    def only_receivers(self) -> bool:
        """Whether only hubs to which a topic is bridged run it; otherwise all hubs do."""

    def reaches(self, island: Island) -> bool:
        """Whether it can join ``island`` to others, by the way in which the nodes there find each other."""

    def listeners(self, spec: Spec, island: Island) -> Iterable[Listener]:
        """Returns the ports that it takes on the hub of ``island``."""

    def ports(self, swarm: Swarm, island: Island) -> Sequence[PortRange]:
        """Returns where it listens for other hubs on the hub of ``island``."""

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterable[Part]:
        """Returns what the hub ``host`` of ``island`` gets; called only for hubs that run the provider."""

    def nodes(self, swarm: Swarm, island: Island) -> JoinNodes:
        """Returns the nodes that a healthy hub of ``island`` shows."""


class OneNode:
    """What providers have in common that run one node of ours, on each hub that receives topics."""

    settings: frozenset[str] = frozenset()
    discovery = None
    offsets: tuple[int, ...] = ()
    only_receivers = True

    def reaches(self, island: Island) -> bool:
        """Returns True: nodes with a master are found there."""
        return True

    def listeners(self, spec: Spec, island: Island) -> Iterable[Listener]:
        """Nothing: the node takes ports as all nodes of ROS do."""
        return ()

    def ports(self, swarm: Swarm, island: Island) -> Sequence[PortRange]:
        """Returns nothing: its node is one of those of ROS."""
        return ()

    def nodes(self, swarm: Swarm, island: Island) -> JoinNodes:
        """Returns the node, which reports the state of its bridges."""
        node = names.multimaster_node(island.name)
        return JoinNodes((node,), reporter=node)


class _NoProvider(OneNode):
    """What a middleware has that joins no islands, unless the spec names a provider."""

    needs = None
    memory_mb = 0
    relays = False

    def parts(self, swarm: Swarm, host: Host, island: Island) -> Iterable[Part]:
        return ()

    def nodes(self, swarm: Swarm, island: Island) -> JoinNodes:
        return JoinNodes(())


_NONE = _NoProvider()


def provider_of(settings: Multimaster | None, distro: str) -> MultimasterProvider:
    """Returns the provider called `provider_name`. Raises KeyError if it is not registered."""
    name = provider_name(settings, distro)
    return cast(MultimasterProvider, MULTIMASTERS.get(name)) if name else _NONE


def joins_islands(settings: Multimaster | None, distros: Collection[str]) -> bool:
    """Returns True if each of ``distros`` has a provider, and one that ``settings`` name joins some."""
    named = settings and settings.provider
    fits = not named or any(joins(named, one) for one in distros)
    return fits and all(provider_of(settings, one) is not _NONE for one in distros)


def providers_with(setting: str) -> Iterator[str]:
    """Yields the names of the providers that read ``setting`` of ``multimaster:``."""
    for name in MULTIMASTERS.names():
        if setting in cast(MultimasterProvider, MULTIMASTERS.get(name)).settings:
            yield name


def running_on(
    settings: Multimaster | None, islands: Sequence[Island], carriers: Collection[str]
) -> Mapping[str, MultimasterProvider]:
    """Returns the provider that the hub of each island runs, by island; ``carriers``: with bridged topics."""
    joined = joinable(islands)
    providers = ((one, provider_of(settings, one.distro)) for one in islands)
    return {
        one.name: provider
        for one, provider in providers
        if provider is not _NONE
        and (one.name in carriers or (not provider.only_receivers and one.name in joined))
    }
