"""Faults of hosts: an absent one, another release, a probe that finds nothing, a wrong clock."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.deployed import Transaction
from swarm_onboard.agent.edits import Drift
from swarm_onboard.agent.observations import LoadSeen
from swarm_onboard.host_checks import disk, memory, wireguard

from swarmctl.health.diagnosis import diagnose
from swarmctl.health.verdict import State
from swarmctl.remote.transport import HostError, Kind
from tests.health.faults import AWAY, UNIT_K3, UNIT_WLAN, Fault, check, shape, spoilt
from tests.health.swarm_values import (
    EPUCK_PI,
    K3_PI,
    LAPTOP,
    TARGET,
    UNIT,
    WLAN,
    all_well,
    both,
    changed,
    graph,
    nothing_deployed,
    with_device,
    with_optional,
    with_topic,
    with_unit,
)

LOST = HostError(Kind.LOST, "the connection died")
WRONG_KEY = HostError(Kind.HOST_KEY, "the key is not the pinned one")

NO_HANDSHAKE = wireguard.Seen(LAPTOP, -1.0)
AT_BOOT = "/etc/systemd/system/multi-user.target.wants"
CHANGE = Transaction("t", "applying", "anna", None, None, 0.0, "")
DISK = disk.Seen("/", "/opt/swarm", 4 << 30, 16 << 30, 100_000, read_only=False)

FAULTS = {
    "nothing deployed": Fault(
        K3_PI,
        nothing_deployed,
        {
            f"release {K3_PI}": (
                "bad",
                [UNIT_WLAN, f"unit swarm-newswarm.target on {K3_PI}", "device k3", UNIT_K3, "driver k3"],
            )
        },
        message="nothing is deployed",
    ),
    "old release that works": Fault(
        K3_PI,
        changed(release="0" * 16),
        {f"release {K3_PI}": ("warning", [])},
        healthy=True,
        message=f"runs {'0' * 16}, the spec renders {'b' * 16}",
    ),
    "old release that publishes more slowly": Fault(
        K3_PI,
        both(changed(release="0" * 16), with_topic("k3", "/k3/odom", rate=5.0)),
        {f"release {K3_PI}": ("warning", ["topic /k3/odom of k3"])},
    ),
    "systemd that does not answer": Fault(
        K3_PI,
        changed(units={}, troubles={"systemd": "does not answer"}),
        {f"systemd {K3_PI}": ("bad", [UNIT_WLAN, f"unit swarm-newswarm.target on {K3_PI}", UNIT_K3])},
        message="does not answer: it restarts no unit that ends",
    ),
    "pyserial was removed while a driver runs": Fault(
        K3_PI,
        changed(lacks=("pyserial", "package:tf2_ros")),
        {f"requirement {K3_PI}": ("bad", [])},
        message="the next start of its units fails: it lacks pyserial, the ROS package tf2_ros",
    ),
    "pyserial was removed, and the driver was started again": Fault(
        K3_PI,
        both(changed(lacks=("pyserial",)), with_unit(UNIT["k3"], active="failed", pid=0)),
        {f"requirement {K3_PI}": ("bad", [UNIT_K3])},
    ),
    "another release, of which it is not known what it requires": Fault(
        K3_PI,
        changed(release="0" * 16, lacks=("pyserial",)),
        {f"release {K3_PI}": ("warning", [])},
        healthy=True,
    ),
    "states of units that cannot be read": Fault(
        K3_PI,
        changed(units={}, troubles={"units": "systemctl failed"}),
        {f"probe {K3_PI} units": ("unknown", [UNIT_WLAN, f"unit swarm-newswarm.target on {K3_PI}", UNIT_K3])},
    ),
    "graph that took too long": Fault(
        K3_PI,
        changed(nodes={}, troubles={"ros": "master and nodes took too long to answer"}),
        {f"probe {K3_PI} ros": ("unknown", ["driver k3"])},
    ),
    "empty answer": Fault(
        K3_PI,
        changed(release="b" * 16, units={}, nodes={}, devices={}, master=None),
        {
            UNIT_WLAN: ("unknown", []),
            f"unit swarm-newswarm.target on {K3_PI}": ("unknown", []),
            f"master {K3_PI}": ("unknown", ["driver k3"]),
            "device k3": ("unknown", []),
            UNIT_K3: ("unknown", []),
        },
    ),
    "edited file": Fault(
        K3_PI,
        changed(drift=Drift({"params/k3.yaml": "changed", "bin/__pycache__/x.pyc": "extra"}, {}, {})),
        {f"files {K3_PI}": ("bad", [])},
        message="params/k3.yaml was changed on the host",
    ),
    "edited block": Fault(
        K3_PI,
        changed(drift=Drift({}, {}, {"/etc/hosts": "changed"})),
        {f"files {K3_PI}": ("bad", [])},
        message="/etc/hosts: the swarm's block was changed on the host",
    ),
    "link of the boot that is missing": Fault(
        K3_PI,
        changed(drift=Drift({}, {f"{AT_BOOT}/{TARGET}": "missing"}, {})),
        {f"files {K3_PI}": ("bad", [])},
        message=f"{TARGET} does not start at boot: its link is missing",
    ),
    "files that somebody added": Fault(
        K3_PI,
        changed(drift=Drift({"params/notes.txt": "extra"}, {}, {})),
        {f"files {K3_PI}": ("warning", [])},
        healthy=True,
        message="params/notes.txt is not part of the release",
    ),
    "change that was interrupted": Fault(
        K3_PI,
        changed(change=CHANGE, drift=Drift({"params/k3.yaml": "missing"}, {}, {})),
        {f"change {K3_PI}": ("bad", [f"files {K3_PI}"])},
        message="of anna was interrupted, and is neither finished nor undone",
    ),
    "change under way": Fault(
        K3_PI,
        changed(change=CHANGE, holder="anna (process 7)", drift=Drift({"a": "missing"}, {}, {})),
        {f"change {K3_PI}": ("warning", [])},
        healthy=True,
        message="is under way: anna (process 7)",
    ),
    "change that waits for its confirmation": Fault(
        K3_PI,
        changed(change=CHANGE._replace(state="pending", left=41.2)),
        {f"change {K3_PI}": ("warning", [])},
        healthy=True,
        message="waits for its confirmation, and is undone in 41 s without it",
    ),
    "change whose confirmation is overdue": Fault(
        K3_PI,
        changed(change=CHANGE._replace(state="pending")),
        {f"change {K3_PI}": ("bad", [])},
    ),
    "full disk": Fault(
        K3_PI,
        changed(checks={"disk": (DISK._replace(free=12 << 10),)}),
        {f"disk {K3_PI} /": ("bad", [])},
        message="is full: 12 KiB free; /opt/swarm is on it",
    ),
    "kernel that filters no addresses": Fault(
        K3_PI,
        both(with_unit(WLAN, unenforced=True), with_unit(UNIT["k3"], unenforced=True)),
        {f"filter {K3_PI}": ("bad", [])},
        message=f"systemd does not enforce the IP addresses of {UNIT['k3']}, {WLAN}: ",
    ),
    "little memory": Fault(
        K3_PI,
        changed(checks={"memory": (memory.Seen(512 << 20, 20 << 20),)}),
        {f"memory {K3_PI}": ("warning", [])},
        healthy=True,
        message="20 MiB available of 512 MiB",
    ),
    "processors without a rest": Fault(
        K3_PI,
        changed(load=LoadSeen(1.0, 0.67, ("sh (41)", "sh (42)"))),
        {f"load {K3_PI}": ("warning", [])},
        healthy=True,
        message="its processes take 67% of the time of its processors, most of it sh (41), sh (42)",
    ),
    "processors that work for others": Fault(K3_PI, changed(load=LoadSeen(1.0, 0.2)), {}, healthy=True),
    "slow topic on a busy host": Fault(
        K3_PI,
        both(changed(load=LoadSeen(0.97)), with_topic("k3", "/k3/odom", rate=4.0)),
        {"topic /k3/odom of k3": ("warning", [])},
        healthy=True,
        message="measured 4.0 Hz of 10, while the processors of its host were busy (97%)",
    ),
    "slow topic on a host that rests": Fault(
        K3_PI,
        both(changed(load=LoadSeen(0.5)), with_topic("k3", "/k3/odom", rate=4.0)),
        {"topic /k3/odom of k3": ("bad", [])},
        message="measured 4.0 Hz of 10",
    ),
    "topic that stops on a busy host": Fault(
        K3_PI,
        both(changed(load=LoadSeen(0.97)), with_topic("k3", "/k3/odom", rate=4.0, age=1.5)),
        {"topic /k3/odom of k3": ("bad", [])},
        message="the last message 1.5 s ago",
    ),
    "silent topic on a busy host": Fault(
        K3_PI,
        both(changed(load=LoadSeen(0.97)), with_topic("k3", "/k3/odom", count=0, rate=None)),
        {"topic /k3/odom of k3": ("bad", [])},
        message="no message in 2 s",
    ),
    "an edited file that ends the driver": Fault(
        K3_PI,
        both(
            changed(drift=Drift({"params/k3.yaml": "changed"}, {}, {})),
            with_unit(UNIT["k3"], active="activating", sub="auto-restart", restarts=4),
        ),
        {f"files {K3_PI}": ("bad", [UNIT_K3])},
        message="params/k3.yaml was changed on the host",
    ),
    "an edited file, and a driver that was stopped": Fault(
        K3_PI,
        both(
            changed(drift=Drift({"params/k3.yaml": "changed"}, {}, {})),
            with_unit(UNIT["k3"], active="inactive", sub="dead"),
        ),
        {f"files {K3_PI}": ("bad", []), UNIT_K3: ("bad", [])},
    ),
    "clock astray": Fault(
        K3_PI,
        changed(clock_ahead=-61.0),
        {f"clock {K3_PI}": ("warning", [])},
        healthy=True,
        message="61.1 s behind the hub's clock",
    ),
    "clock of the hub astray": Fault(
        LAPTOP,
        changed(clock_ahead=-61.0),
        {f"clock {LAPTOP}": ("warning", [])},
        healthy=True,
        message="61.1 s behind the other hosts' clock",
    ),
    "clock of an old time, whose handshakes WireGuard refuses": Fault(
        K3_PI,
        changed(clock_ahead=-61.0, checks={"wireguard": (NO_HANDSHAKE,)}),
        {f"clock {K3_PI}": ("warning", [f"wireguard {K3_PI} {LAPTOP}"])},
        message="61.1 s behind the hub's clock",
    ),
}


@pytest.mark.parametrize(
    ("drift", "hint"),
    [
        (Drift({"a": "missing", "b/__pycache__/c.pyc": "extra"}, {"/l": "missing"}, {}), "run swarmctl"),
        (Drift({"a": "changed"}, {}, {}), "`swarmctl adopt`"),
        (Drift({}, {}, {"/etc/hosts": "changed"}), "`swarmctl adopt`"),
    ],
)
def test_only_edits_have_something_to_lose(drift: Drift, hint: str) -> None:
    found = diagnose(graph(), spoilt(K3_PI, changed(drift=drift)))
    assert next(one.hint for one in found.findings if one.key == f"files {K3_PI}").startswith(hint)


@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS.keys())
def test_a_fault_is_reported_with_its_symptoms(fault: Fault) -> None:
    check(fault)


@pytest.mark.parametrize(("ahead", "below"), [(-61.0, True), (61.0, False)])
def test_an_old_clock_explains_what_peers_lack(ahead: float, below: bool) -> None:
    """WireGuard accepts a handshake of a later time."""
    answers = spoilt(K3_PI, changed(clock_ahead=ahead))
    answers[LAPTOP] = answers[LAPTOP]._replace(checks={"wireguard": (wireguard.Seen(K3_PI, -1.0),)})
    lacks = f"wireguard {LAPTOP} {K3_PI}"
    alone: dict[str, tuple[str, list[str]]] = {} if below else {lacks: ("bad", [])}
    assert shape(diagnose(graph(), answers)) == {f"clock {K3_PI}": ("warning", [lacks] * below), **alone}


def test_a_host_that_accepts_an_expelled_one_is_unhealthy() -> None:
    """The one that was expelled does not answer: swarmctl does not log in to it."""
    answers = spoilt(K3_PI, changed(checks={"wireguard": (wireguard.Seen(LAPTOP, 5.0),)}))
    answers[LAPTOP] = AWAY
    found = diagnose(replace(graph(), expelled=frozenset({LAPTOP})), answers)
    accepts = next(one for one in found.findings if one.key == f"wireguard {K3_PI} {LAPTOP}")
    assert (accepts.state, accepts.message.startswith("its WireGuard accepts")) == (State.BAD, True)


def test_a_dead_host_costs_only_its_row() -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: AWAY})
    assert shape(found) == {f"host {K3_PI}": ("bad", ["robot k3"])}
    assert {one.state for one in found.findings if one.robot == "k3"} == {State.UNKNOWN}
    assert found.only_unreachable


@pytest.mark.parametrize(
    ("error", "key", "only_unreachable"),
    [(AWAY, "host", True), (LOST, "host", True), (WRONG_KEY, "host-key", False)]
    + [
        (HostError(kind, "no"), kind.value, False)
        for kind in (Kind.AUTH, Kind.PRIVILEGE, Kind.PROTOCOL, Kind.FAILED)
    ],
)
def test_an_unreachable_host_has_its_reason(error: HostError, key: str, only_unreachable: bool) -> None:
    found = diagnose(graph(), {**all_well(), K3_PI: error})
    assert shape(found) == {f"{key} {K3_PI}": ("bad", ["robot k3"])}
    assert not found.healthy
    assert found.only_unreachable is only_unreachable


def test_another_fault_beside_a_dead_host_is_unhealthy() -> None:
    found = diagnose(graph(), {**spoilt(EPUCK_PI, with_device("epuck", exists=False)), K3_PI: AWAY})
    assert not found.only_unreachable


def test_an_optional_host_may_be_absent() -> None:
    found = diagnose(with_optional(K3_PI), {**all_well(), K3_PI: AWAY})
    assert found.healthy
    assert shape(found) == {f"host {K3_PI}": ("warning", ["robot k3"])}


def test_a_host_that_was_not_probed_is_unknown() -> None:
    found = diagnose(graph(), {name: one for name, one in all_well().items() if name != K3_PI})
    assert shape(found) == {f"probed {K3_PI}": ("unknown", ["robot k3"])}
    assert not found.healthy
    assert not found.only_unreachable


def test_a_part_of_the_swarm_can_be_looked_at_alone() -> None:
    alone = graph((K3_PI,))
    assert diagnose(alone, all_well(alone)).healthy
