"""First aid for a host: each fault gives one line, and what cannot be known after it is skipped."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from swarmctl.health.first_aid import examine, host_steps
from swarmctl.health.verdict import State
from swarmctl.remote import ssh_errors
from swarmctl.remote.first_contact import Greeting, Route, Visit
from swarmctl.remote.transport import HostError, Kind, Target

PI = Target("pi", "10.0.0.1", "robot", keys=("ssh-ed25519 AAAA",))
FACTS = "time=1000\npython=3.11\nsize=4000000\nfree=1000000\n"
SOUND = {
    "resolve": "10.0.0.1",
    "route": Route("wlan0", "10.0.0.9"),
    "ping": True,
    "greeting": Greeting(0.003, "SSH-2.0-OpenSSH_9.2"),
    "visit": Visit(FACTS, 1000.5),
}
ORDER = ["address", "route", "ping", "port", "sshd", "host key", "login", "root", "python", "clock", "disk"]


class Invented:
    """A ``Contact`` that gives these answers."""

    def __init__(self, answers: dict[str, Any]) -> None:
        self.answers = answers

    def __getattr__(self, name: str) -> Any:
        def answer(*_: object) -> Any:
            if isinstance(found := self.answers[name], HostError):
                raise found
            return found

        return answer


def found(target: Target = PI, **answers: Any) -> dict[str, Any]:
    steps = host_steps(target, Invented({**SOUND, **answers}))
    return {one.name: one.verdict for one in examine(steps)}


def visit(facts: str = FACTS, no_root: HostError | None = None) -> dict[str, Any]:
    return {"visit": Visit(facts, 1000.5, no_root)}


def test_a_sound_host_passes_every_check_in_order() -> None:
    verdicts = found()
    assert list(verdicts) == ORDER
    assert {one.state for one in verdicts.values()} == {State.OK}
    assert verdicts["port"].message == "22 is open, after 3 ms"


STALLED = ssh_errors.stalled_handshake(PI)
CHANGED = HostError(Kind.HOST_KEY, "shows another host key than the pinned one", "re-flashed?")
NO_SUDO = HostError(Kind.PRIVILEGE, "a password is required", "NOPASSWD")


@pytest.mark.parametrize(
    ("fault", "name", "says", "skipped"),
    [
        ({"resolve": ssh_errors.unknown_name(PI)}, "address", "cannot resolve", ORDER[1:]),
        ({"route": ssh_errors.no_way(PI, "no route")}, "route", "no route", ORDER[2:]),
        ({"greeting": ssh_errors.nothing_listens(PI)}, "port", "nothing listens", ORDER[4:]),
        ({"greeting": Greeting(0.1, "220 mail")}, "sshd", "sends `220 mail`: no sshd", ORDER[5:]),
        ({"greeting": Greeting(0.1, "")}, "sshd", "sends nothing", ORDER[5:]),
        ({"visit": STALLED}, "host key", "does not finish the SSH handshake", ORDER[6:]),
        ({"visit": CHANGED}, "host key", "another host key", ORDER[6:]),
        ({"visit": ssh_errors.rejected(PI, ["a"])}, "login", "rejected the login of robot", ORDER[7:]),
        (visit(no_root=NO_SUDO), "root", "a password is required", []),
        (visit(FACTS.replace("python=3.11\n", "")), "python", "no python3", []),
        (visit(FACTS.replace("3.11", "3.7")), "python", "3.7 is too old", []),
        (visit(FACTS.replace("free=1000000", "free=1000")), "disk", "is full", []),
    ],
)
def test_a_fault_is_named_once_and_what_needs_it_is_skipped(
    fault: dict[str, Any], name: str, says: str, skipped: list[str]
) -> None:
    verdicts = found(**fault)
    assert says in verdicts[name].message
    assert verdicts[name].hint
    assert [key for key, one in verdicts.items() if one.state is State.BAD] == [name]
    assert [key for key, one in verdicts.items() if one.state is State.SKIPPED] == skipped
    assert all(verdicts[key].message.startswith("needs ") for key in skipped)


@pytest.mark.parametrize(
    ("doubt", "name", "says"),
    [
        ({"route": Route("eth0", "192.0.2.2", "192.0.2.1")}, "route", "no address in its network"),
        ({"ping": False}, "ping", "does not answer"),
        (visit(FACTS.replace("1000\n", "9000\n", 1)), "clock", "8000 s apart"),
        (visit(FACTS.replace("free=1000000", "free=100000")), "disk", "almost full"),
    ],
)
def test_a_doubt_is_a_warning_and_ends_nothing(doubt: dict[str, Any], name: str, says: str) -> None:
    verdicts = found(**doubt)
    assert says in verdicts[name].message
    assert {key for key, one in verdicts.items() if one.state is not State.OK} == {name}
    assert verdicts[name].state is State.WARNING


def test_the_network_is_checked_to_the_jump_host() -> None:
    behind = replace(PI, host="behind", address="172.16.0.1", jump=replace(PI, port=2222))
    assert found(behind)["port"].message.startswith("2222 ")


def test_the_network_is_not_checked_where_a_program_leads_to_the_host() -> None:
    verdicts = found(replace(PI, proxy_command="nc %h %p"), resolve=ssh_errors.unknown_name(PI))
    assert [key for key, one in verdicts.items() if one.state is State.SKIPPED] == ORDER[:5]
    assert verdicts["login"].message == "as robot"
