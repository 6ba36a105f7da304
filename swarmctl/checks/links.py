"""Every robot hangs on its host, by a line that both have."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Fix, Note
from swarmctl.spec.edits import append_item, mend, set_key
from swarmctl.spec.model import Bluetooth, Mode


def robot_lines(case: Case) -> Iterator[Diagnostic]:
    """LINK001, LINK002, LINK003: each robot has one line, and it leads to the host that drives it."""
    spec = case.spec
    for name, found in case.lines_of.items():
        host = case.driving[name]
        if not found:
            yield Diagnostic(
                "LINK001",
                f"robot `{name}` has no line to its host",
                case.span("robots", name, key=True),
                label="no serial or bluetooth link names it",
                help=tuple(f"add to `links`: {line}" for line in _possible_lines(case, name, host)),
            )
            continue
        first, link = found[0]
        for second, _ in found[1:]:
            yield Diagnostic(
                "LINK002",
                f"robot `{name}` has more than one line",
                case.span("links", second, "robot"),
                label="a second line",
                notes=(Note(case.span("links", first, "robot"), "the first line"),),
                help=("keep the one that its driver is to use",),
            )
        if host is not None and link.host != host:
            why = (
                "the leader drives every robot" if spec.mode is Mode.SINGLE_MINDED else f"`{host}` drives it"
            )
            place = ("leader",) if spec.mode is Mode.SINGLE_MINDED else ("robots", name, "host")
            yield Diagnostic(
                "LINK003",
                f"robot `{name}` hangs on `{link.host}`, but {why}",
                case.span("links", first, "host"),
                label="this end",
                notes=(Note(case.span(*place), f"`{host}` is named here"),),
                help=(f"let the line start at `{host}`, or let `{link.host}` drive the robot",),
            )


def _possible_lines(case: Case, robot: str, host: str | None) -> Iterator[str]:
    """The links that the robot speaks and its host has the hardware for, as they would stand in the spec."""
    spec = case.spec
    kinds = case.types[spec.robots[robot].type].link.kinds
    ends = f"host: {host or '...'}, robot: {robot}"
    if "bluetooth" in kinds and host is not None and spec.hosts[host].bluetooth:
        yield f'{{kind: bluetooth, {ends}, mac: "..."}}'
    if "serial" in kinds:
        yield f"{{kind: serial, {ends}, usb: {{serial: ...}}}}"


def spoken_lines(case: Case) -> Iterator[Diagnostic]:
    """LINK007: a robot hangs on a kind of line that its type can be connected by."""
    spec = case.spec
    for index, link in case.lines:
        type_name = spec.robots[link.robot].type
        kinds = case.types[type_name].link.kinds
        if link.kind not in kinds:
            yield Diagnostic(
                "LINK007",
                f"robot `{link.robot}` is a {type_name}, which has no {link.kind} line",
                case.span("links", index, "kind"),
                label=f"not a line of `{type_name}`",
                notes=(Note(case.span("robots", link.robot, "type"), "the robot's type"),),
                help=(f"a {type_name} is connected by {' or '.join(kinds)}",),
            )


def adapters(case: Case) -> Iterator[Diagnostic]:
    """LINK006: a Bluetooth link needs an adapter that its host has."""
    spec = case.spec
    for index, link in enumerate(spec.links):
        if not isinstance(link, Bluetooth) or link.host not in spec.hosts:
            continue
        have = spec.hosts[link.host].bluetooth
        if not have or (link.adapter is not None and link.adapter not in have):
            missing = f"no adapter `{link.adapter}`" if link.adapter and have else "no Bluetooth adapter"
            yield Diagnostic(
                "LINK006",
                f"host `{link.host}` has {missing}",
                case.span("links", index, "adapter" if link.adapter else "host"),
                notes=(Note(case.span("hosts", link.host, key=True), "this host"),),
                help=(f"add `bluetooth: [{link.adapter or 'hci0'}]` to host `{link.host}` if it has one",),
                fix=_adapter_added(case, link.host, link.adapter or "hci0"),
            )


def _adapter_added(case: Case, host: str, adapter: str) -> Fix | None:
    loc = ("hosts", host)
    if case.spec.hosts[host].bluetooth:
        edits = append_item(case.source, (*loc, "bluetooth"), adapter)
    else:
        edits = set_key(case.source, loc, "bluetooth", [adapter])
    return mend(f"add `{adapter}` to the adapters of `{host}`", edits)


RULES: tuple[Rule, ...] = (robot_lines, spoken_lines, adapters)
