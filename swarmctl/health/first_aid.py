"""What keeps an operator from a host: one check after the other, each after those that it needs.

Decides alone; who looks at the network and at the host is a ``Contact``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from ipaddress import ip_address
from typing import Protocol

from swarm_onboard.host_checks import disk

from swarmctl.health.verdict import State, Verdict, bad, ok, warning
from swarmctl.remote.first_contact import Greeting, Route, Visit
from swarmctl.remote.transport import HostError, Kind, Target

OLDEST_PYTHON = (3, 8)
_APART = 60.0  # s between the clocks of host and operator that are worth a warning
_OF_CONNECTION = (Kind.UNREACHABLE, Kind.HOST_KEY)  # errors before the login


@dataclass(frozen=True)
class Step:
    """A check that is still to be made, which may raise ``HostError``; ``needs``: the one before it."""

    name: str
    look: Callable[[], Verdict]
    needs: str = ""


@dataclass(frozen=True)
class Check:
    """A check that was made, or skipped since another one failed."""

    name: str
    verdict: Verdict


class Contact(Protocol):
    """Looks at the network and at a host. Each raises ``HostError``."""

    def resolve(self, target: Target) -> str:
        """Returns the IP address of the host."""
        ...

    def route(self, target: Target, address: str) -> Route | None:
        """Returns how packets get there; None if this machine has no `ip`."""
        ...

    def ping(self, address: str) -> bool | None:
        """Returns True if it answers; None if this machine has no ``ping``."""
        ...

    def greeting(self, target: Target) -> Greeting:
        """Connects to the port and waits for a line."""
        ...

    def visit(self, target: Target) -> Visit:
        """Logs in once."""
        ...


def examine(steps: Iterable[Step]) -> Iterator[Check]:
    """Makes each check whose need is met, and yields it as it is done."""
    failed = set()
    for step in steps:
        if step.needs in failed:
            verdict = Verdict(State.SKIPPED, f"needs {step.needs}")
            failed.add(step.name)
        else:
            try:
                verdict = step.look()
            except HostError as error:
                verdict = bad(error.message, error.hint)
            if verdict.state is State.BAD:
                failed.add(step.name)
        yield Check(step.name, verdict)


def host_steps(target: Target, contact: Contact) -> list[Step]:
    """The checks of one host, from its name to its disk.

    Those of the network are of the first jump host, if it is reached through some.
    """
    first = [*target.way()][-1]
    resolved = cache(lambda: contact.resolve(first))
    greeting = cache(lambda: contact.greeting(first))
    visit = cache(lambda: _outcome(lambda: contact.visit(target)))
    by_program = Verdict(State.SKIPPED, "ProxyCommand in ~/.ssh/config leads to it")

    def network(look: Callable[[], Verdict]) -> Callable[[], Verdict]:
        return (lambda: by_program) if first.proxy_command else look

    return [
        Step("address", network(lambda: _address(first, resolved()))),
        Step("route", network(lambda: _route(resolved(), contact.route(first, resolved()))), "address"),
        Step("ping", network(lambda: _ping(contact.ping(resolved()))), "route"),
        Step(
            "port",
            network(lambda: ok(f"{first.port} is open, after {1000 * greeting().seconds:.0f} ms")),
            "route",
        ),
        Step("sshd", network(lambda: _banner(first, greeting().banner)), "port"),
        Step("host key", lambda: _key(visit()), "sshd"),
        Step("login", lambda: _login(target, visit()), "host key"),
        Step("root", lambda: _root(_visited(visit())), "login"),
        Step("python", lambda: _python(_visited(visit())), "login"),
        Step("clock", lambda: _clock(_visited(visit())), "login"),
        Step("disk", lambda: _disk(target.host, _visited(visit())), "login"),
    ]


def _outcome(visit: Callable[[], Visit]) -> Visit | HostError:
    try:
        return visit()
    except HostError as error:
        return error


def _visited(outcome: Visit | HostError) -> Visit:
    assert isinstance(outcome, Visit)  # the login was checked
    return outcome


def _address(target: Target, address: str) -> Verdict:
    way = "" if target.address == address else f"{target.address} is "
    return ok(f"{way}{address}")


def _route(address: str, found: Route | None) -> Verdict:
    if found is None:
        return Verdict(State.SKIPPED, "this machine has no program `ip`")
    if found.gateway and ip_address(address).is_private:
        return warning(
            f"{found.interface} has no address in its network: packets go to the gateway {found.gateway}",
            "is this machine in the Wi-Fi of the robots? `ip address` shows its networks",
        )
    return ok(f"from {found.own} by {found.interface}")


def _ping(answers: bool | None) -> Verdict:
    if answers is None:
        return Verdict(State.SKIPPED, "this machine has no program `ping`")
    return ok("answers") if answers else warning("does not answer; a firewall may drop pings")


def _banner(target: Target, banner: str) -> Verdict:
    if banner.startswith("SSH-"):
        return ok(f"greets as {banner}")
    sent = f"sends `{banner}`" if banner else "sends nothing"
    return bad(
        f"what listens on port {target.port} {sent}: no sshd",
        "is this the port of its sshd? if so, the host may be overloaded or hung",
    )


def _key(outcome: Visit | HostError) -> Verdict:
    if isinstance(outcome, HostError) and outcome.kind in _OF_CONNECTION:
        return bad(outcome.message, outcome.hint)
    return ok("the pinned one")


def _login(target: Target, outcome: Visit | HostError) -> Verdict:
    if isinstance(outcome, HostError):
        return bad(outcome.message, outcome.hint)
    return ok(f"as {target.user}")


def _root(visit: Visit) -> Verdict:
    if visit.no_root is not None:
        return bad(visit.no_root.message, visit.no_root.hint)
    return ok("the account runs commands as root")


def _fact(visit: Visit, name: str) -> str:
    found = re.search(rf"^{name}=([0-9.]{{1,20}})$", visit.facts, re.MULTILINE)
    return found[1] if found else ""


def _python(visit: Visit) -> Verdict:
    version = re.fullmatch(r"([0-9]+)\.([0-9]+)", _fact(visit, "python"))
    if version is None:
        return bad("the host has no python3 that runs", "install it: `apt install python3`")
    if (int(version[1]), int(version[2])) < OLDEST_PYTHON:
        return bad(f"{version[0]} is too old", "swarmctl needs Python 3.8 or newer on a host")
    return ok(version[0])


def _clock(visit: Visit) -> Verdict:
    time = _fact(visit, "time")
    if not time.isdecimal():
        return Verdict(State.UNKNOWN, "the host does not report its time")
    if (apart := abs(int(time) - visit.now)) > _APART:
        return warning(
            f"{apart:.0f} s apart from that of this machine: logs and the stamps of messages do not fit",
            "on both: `timedatectl` shows which is wrong",
        )
    return ok("as on this machine")


def _disk(host: str, visit: Visit) -> Verdict:
    size, free = (_fact(visit, name) for name in ("size", "free"))
    if not (size.isdecimal() and free.isdecimal()):
        return Verdict(State.UNKNOWN, "the host does not report how much is free")
    seen = disk.Seen(
        "/opt", "/opt/swarm", free=int(free) << 10, size=int(size) << 10, inodes=None, read_only=False
    )
    judged = disk.judge(seen, host)
    return Verdict(
        State(judged.state), f"/opt {judged.message}" if judged.state != "ok" else judged.message, judged.hint
    )
