"""The devices that drivers and programs open by themselves, as they name them."""

from __future__ import annotations

import posixpath
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from typing import NamedTuple

from swarmctl.diagnostics import Diagnostic, Span, note_of_other
from swarmctl.linter.context import RuleContext
from swarmctl.robot_types.ros_driver import RosDriver
from swarmctl.robot_types.ros_launchable import Loc, PlaceholderError, escaped, filled
from swarmctl.rules.drivers import place_of_driver
from swarmctl.spec.program_model import Program
from swarmctl.swarm.program_values import texts_of

_DEVICE = re.compile(r"(?:^|[\s=,:]|://)(/dev/(?:serial/by-path/\S+|[\w./+=@~-]+))", re.ASCII)
_FOR_ALL = re.compile(  # that several programs can have open
    r"/dev/((input|shm|dri|snd|bus|pts|fd|mqueue|net|dma_heap|vfio)(/.*)?|(std|i2c-|spidev|gpio|nvidia|nvh|rtc|hidraw|media|vc).*"
    r"|video[1-9][0-9]|null|zero|full|u?random|k?mem|kmsg|log|tty|kvm|kfd|fuse)"
)


class Opened(NamedTuple):
    """One device of a host, who opens it, and what returns its place in the spec."""

    host: str
    device: str
    owner: str
    span: Callable[[], Span]


def opened_twice(context: RuleContext, of_links: Iterable[Opened]) -> Iterator[Diagnostic]:
    """Yields a finding for each two owners that open one device; ID002 itself has those of two links."""
    homes = {name: host or context.line_hosts.get(name) for name, host in context.driving.items()}
    users = Counter((*homes.values(), *context.program_hosts.values()))
    opened = (*_of_drivers(context, homes, users), *_of_programs(context, users))
    first = {(one.host, one.device): one for one in of_links} if opened else {}
    reported: set[tuple[str, str]] = set()
    for one in opened:
        earlier = first.setdefault((one.host, one.device), one)
        if earlier.owner == one.owner or (earlier.owner, one.owner) in reported:
            continue
        span = one.span()
        reported.add((earlier.owner, one.owner))
        yield Diagnostic(
            "ID002",
            f"{earlier.owner} and {one.owner} open one device of host `{one.host}`, `{one.device}`",
            span,
            label=f"opened for {one.owner}",
            notes=note_of_other(earlier.span(), span),
            help=(
                f"give {one.owner} a host of its own",
                "or name another device in its params, args or command; those of a robot are in its `driver`",
            ),
        )


def _of_drivers(
    context: RuleContext, homes: Mapping[str, str | None], users: Counter[str | None]
) -> Iterator[Opened]:
    named: dict[int, tuple[tuple[Loc, str], ...]] = {}  # robots of a type share its driver
    for robot, driver in context.ros_drivers.items():
        host = homes[robot]
        if host is None or users[host] < 2:
            continue
        if id(driver) not in named:
            named[id(driver)] = tuple(_named_by(driver))
        space = context.namespaces[robot][1:]
        for loc, text in named[id(driver)]:
            for device in _devices(text, {"robot": robot, "namespace": space, "frame": space, "host": host}):
                place = partial(place_of_driver, context, robot, *loc)
                yield Opened(host, device, f"robot `{robot}`", place)


def _named_by(driver: RosDriver) -> Iterator[tuple[Loc, str]]:
    yield from (one for one in driver.texts if "/dev/" in one[1])
    yield from ((("devices", index), device) for index, device in enumerate(driver.devices))


def _of_programs(context: RuleContext, users: Counter[str | None]) -> Iterator[Opened]:
    for name, program in context.spec.programs.items():
        host = context.program_hosts[name]
        if host is None or users[host] < 2 or (program.package is None and program.lifecycle != "service"):
            continue
        for loc, text in _texts(program):
            if "/dev/" in text:
                space = context.program_namespaces[name][1:]
                values = {"program": name, "namespace": space, "robot": program.robot or "", "host": host}
                for device in _devices(text, values):
                    place = partial(context.span, "programs", name, *loc)
                    yield Opened(host, device, f"program `{name}`", place)


def _texts(program: Program) -> Iterator[tuple[Loc, str]]:
    """Yields the texts with devices of the host: those in a container's command are the container's own."""
    if program.container is None:
        yield from texts_of(program)
    else:
        devices = enumerate(program.container.devices)
        yield from ((("container", "devices", index), escaped(device)) for index, device in devices)


def _devices(text: str, values: Mapping[str, str]) -> Iterator[str]:
    """Yields the devices in a text that one program has for itself; none of one that a link gives."""
    with suppress(PlaceholderError):
        for found in _DEVICE.findall(str(filled(text, values))):
            if not _FOR_ALL.fullmatch(found):
                yield posixpath.normpath(found)
