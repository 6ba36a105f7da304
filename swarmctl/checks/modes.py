"""What each working mode asks of a spec."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Note, Severity
from swarmctl.topology.modes import READY, ROLES


def ready_modes(case: Case) -> Iterator[Diagnostic]:
    """MODE001: the mode is one that this version can deploy, not only check."""
    mode = case.spec.mode
    if mode not in READY:
        ready = ", ".join(f"`{one.value}`" for one in READY)
        yield Diagnostic(
            "MODE001",
            f"mode `{mode.value}` joins several ROS masters; this version checks it but cannot deploy it",
            case.span("mode"),
            severity=Severity.WARNING,
            help=(f"the modes that can be deployed today: {ready}",),
        )


def role_named(case: Case) -> Iterator[Diagnostic]:
    """MODE002, MODE003: the host that the mode is built around is named, and no other role is."""
    spec = case.spec
    role = ROLES.get(spec.mode)
    if role is None:
        return
    other = "hub" if role.key == "leader" else "leader"
    if getattr(spec, role.key) is None and getattr(spec, other) is None:
        first = next(iter(spec.hosts))
        yield Diagnostic(
            "MODE002",
            f"mode `{spec.mode.value}` needs a `{role.key}`",
            case.span("mode"),
            label=f"which host {role.duty}?",
            help=(f"add `{role.key}: {first}`",),
        )
    if getattr(spec, other) is not None:
        both = getattr(spec, role.key) is not None
        yield Diagnostic(
            "MODE003",
            f"mode `{spec.mode.value}` has no `{other}`",
            case.span(other, key=True),
            label=f"the host that {role.duty} is called `{role.key}`",
            notes=(Note(case.span(role.key, key=True), "named here"),) if both else (),
            help=("remove this line" if both else f"write `{role.key}: {getattr(spec, other)}`",),
        )


def robots_have_hosts(case: Case) -> Iterator[Diagnostic]:
    """MODE004: outside single-minded, every robot says which host drives it."""
    spec = case.spec
    for name, robot in spec.robots.items():
        if robot.host is None and spec.mode.value != "single-minded":
            yield Diagnostic(
                "MODE004",
                f"robot `{name}` has no host",
                case.span("robots", name, key=True),
                label="which host drives it?",
                help=(f"add `host: {next(iter(spec.hosts))}`",),
            )


def programs_wait(case: Case) -> Iterator[Diagnostic]:
    """PROG001: programs are checked, but this version does not start them."""
    for name in case.spec.programs:
        yield Diagnostic(
            "PROG001",
            f"program `{name}` is checked but not started by this version",
            case.span("programs", name, key=True),
            severity=Severity.WARNING,
            help=(f"start it by hand, after `source /opt/swarm/{case.spec.name}/current/setup.bash`",),
        )


NAMES: tuple[Rule, ...] = (role_named, robots_have_hosts)
RULES: tuple[Rule, ...] = (ready_modes, programs_wait)
