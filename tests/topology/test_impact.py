"""What dies if something dies: said on paper, and found by taking the part away and looking again."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from random_swarms import Data, spec_of, swarms

from swarmctl.topology.impact import Impact, impacts, single_points

Part = tuple[str, str]


class Life:
    """A swarm in plain words, with one part dead: who lives, who is heard, who can be commanded."""

    def __init__(self, data: Data, dead: Part | None) -> None:
        self.data, self.dead = data, dead
        if data["mode"] == "standalone":
            self.islands = {host: (host, [host]) for host in data["hosts"]}
        elif data["mode"] == "combined":
            self.islands = {name: (one["hub"], one["hosts"]) for name, one in data["islands"].items()}
        else:
            hub = data.get("leader") or data["hub"]
            members = [hub] if data["mode"] == "single-minded" else list(data["hosts"])
            self.islands = {data["name"]: (hub, members)}

    def lives(self, kind: str, name: str) -> bool:
        return self.dead != (kind, name)

    def driver(self, robot: str) -> bool:
        host = self.data["robots"][robot]["host"]
        line = next(one for one in self.data["links"] if one.get("robot") == robot)
        air = line["kind"] != "bluetooth" or self.lives("adapter", f"{host}/hci0")
        return air and self.lives("robot", robot) and self.lives("line", robot) and self.lives("host", host)

    def program(self, name: str) -> bool:
        return self.lives("program", name) and self.lives("host", self.data["programs"][name]["host"])

    def master(self, island: str) -> bool:
        return self.lives("master", island) and self.lives("host", self.islands[island][0])

    def wire(self, one: str, other: str) -> bool:
        if not self.lives("host", one) or not self.lives("host", other):
            return False
        return one == other or any(
            {one, other} <= set(link["hosts"])
            for link in self.data["links"]
            if link["kind"] == "wlan" and self.lives("network", link["name"])
        )

    def hear(self, one: str, other: str) -> bool:
        homes = [self.home(one), self.home(other)]
        if None in homes or not all(self.master(home) for home in homes if home is not None):
            return False
        first, second = (self.islands[home][0] for home in homes if home is not None)
        pairs = ((one, other), (one, first), (other, second), (first, second))
        return all(self.wire(*pair) for pair in pairs)

    def home(self, host: str) -> str | None:
        return next((name for name, (_, members) in self.islands.items() if host in members), None)

    def commanded(self, robot: str) -> bool:
        return self.driver(robot) and any(
            self.commands(control["by"], robot) for control in self.data["control"] if robot in control["of"]
        )

    def commands(self, by: str, robot: str) -> bool:
        if by in self.data["programs"]:
            host = self.data["programs"][by]["host"]
            there = self.program(by)
        else:
            host = self.data["robots"][by]["host"] if by in self.data["robots"] else by
            there = self.lives("host", host)
        return there and self.hear(host, self.data["robots"][robot]["host"])

    def heard(self) -> Iterator[tuple[str, str]]:
        for name, program in self.data["programs"].items():
            for topic in program["subscribes"]:
                if self.program(name) and self.published(topic["topic"], program["host"]):
                    yield topic["topic"], name

    def published(self, topic: str, to: str) -> bool:
        robot = topic.split("/")[1]
        if topic.endswith("/odom"):
            return self.driver(robot) and self.hear(self.data["robots"][robot]["host"], to)
        return any(
            self.program(name) and self.hear(one["host"], to)
            for name, one in self.data["programs"].items()
            if topic in [each["topic"] for each in one["publishes"]]
        )


def losses(data: Data, part: Part) -> tuple[set[object], ...]:
    """What is there with everything alive and is not there with ``part`` dead."""
    before, after = Life(data, None), Life(data, part)
    robots, programs = data["robots"], data["programs"]
    drivers = {one for one in robots if before.driver(one) and not after.driver(one)}
    command = {
        one for one in robots if after.driver(one) and before.commanded(one) and not after.commanded(one)
    }
    masters = {one for one in before.islands if not after.master(one)}
    ended = {one for one in programs if not after.program(one)} - {part[1] if part[0] == "program" else ""}
    silent = {(topic, one) for topic, one in set(before.heard()) - set(after.heard()) if after.program(one)}
    return drivers, command, masters, ended, silent


@settings(max_examples=150, deadline=None)
@given(swarms())
def test_killing_on_paper_is_killing(data: Data) -> None:
    found = impacts(spec_of(data))
    assert len({(one.kind, one.name) for one in found}) == len(found)
    for one in found:
        said = tuple(map(set, (one.drivers, one.command, one.masters, one.programs, one.data)))
        assert said == losses(data, (one.kind, one.name)), (one.kind, one.name)


@settings(max_examples=50, deadline=None)
@given(swarms())
def test_the_worst_stands_first_and_optional_robots_weigh_less(data: Data) -> None:
    found = impacts(spec_of(data))
    missed = [len(one.missed) for one in found]
    assert missed == sorted(missed, reverse=True)
    optional = {name for name, robot in data["robots"].items() if robot["optional"]}
    assert all(set(one.missed) == set(one.robots) - optional for one in found)


THREE: Data = {
    "version": 1,
    "name": "three",
    "hosts": {
        "laptop": {"address": "10.0.0.1"},
        "k3-pi": {"address": "10.0.0.2"},
        "epuck-pi": {"address": "10.0.0.3", "bluetooth": ["hci0"]},
    },
    "robots": {
        "koala": {"type": "koala", "host": "laptop"},
        "k3": {"type": "khepera3", "host": "k3-pi"},
        "epuck": {"type": "epuck", "host": "epuck-pi"},
    },
    "links": [
        {"kind": "wlan", "name": "lab", "hosts": ["laptop", "k3-pi", "epuck-pi"]},
        {"kind": "serial", "host": "laptop", "robot": "koala", "usb": {"serial": "A1"}},
        {"kind": "serial", "host": "k3-pi", "robot": "k3", "usb": {"serial": "A2"}},
        {"kind": "bluetooth", "host": "epuck-pi", "robot": "epuck", "mac": "10:00:00:00:00:01"},
    ],
}
LED: Data = {"control": [{"by": "laptop", "of": ["koala", "k3", "epuck"]}]}
EACH: Data = {"control": [{"by": name, "of": [name]} for name in THREE["robots"]]}
COMBINED: Data = {
    "islands": {
        "big": {"mode": "leader", "leader": "laptop", "hosts": ["laptop", "epuck-pi"]},
        "small": {"mode": "central", "hub": "k3-pi", "hosts": ["k3-pi"]},
    }
}


def hanging_on(host: str) -> list[Data]:
    """All robots on one host, as mode single-minded has it."""
    return [one if one["kind"] == "wlan" else {**one, "host": host} for one in THREE["links"]]


@pytest.mark.parametrize(
    ("mode", "more", "part", "lost"),
    [
        # The leader takes everything with it, whether it drives the others or orders them about.
        ("single-minded", {"leader": "laptop", "links": hanging_on("laptop"), **LED}, ("host", "laptop"),
         (("koala", "k3", "epuck"), (), ("three",))),
        ("leader", {"leader": "laptop", **LED}, ("host", "laptop"),
         (("koala",), ("k3", "epuck"), ("three",))),
        ("leader", {"leader": "laptop", **LED}, ("host", "k3-pi"), (("k3",), (), ())),
        ("leader", {"leader": "laptop", **LED}, ("network", "lab"), ((), ("k3", "epuck"), ())),
        # A hub takes the masterless with it, though each robot has its own commander.
        ("central", {"hub": "k3-pi", **EACH}, ("host", "k3-pi"), (("k3",), ("koala", "epuck"), ("three",))),
        ("central", {"hub": "k3-pi", **EACH}, ("master", "three"),
         ((), ("koala", "k3", "epuck"), ("three",))),
        # Standing alone, each host takes its own only, and the air between them takes nobody.
        ("standalone", EACH, ("host", "laptop"), (("koala",), (), ("laptop",))),
        ("standalone", EACH, ("network", "lab"), ((), (), ())),
        ("standalone", LED, ("network", "lab"), ((), ("k3", "epuck"), ())),
        # Islands fall one by one.
        ("combined", {**COMBINED, **EACH}, ("host", "laptop"), (("koala",), ("epuck",), ("big",))),
        ("combined", {**COMBINED, **EACH}, ("master", "small"), ((), ("k3",), ("small",))),
        ("combined", {**COMBINED, **LED}, ("master", "small"), ((), ("k3",), ("small",))),
    ],
)  # fmt: skip
def test_each_mode_falls_in_its_own_way(
    mode: str, more: Data, part: Part, lost: tuple[tuple[str, ...], ...]
) -> None:
    """Which robots lose their driver, which lose command, which islands their master."""
    found = {(one.kind, one.name): one for one in impacts(spec_of({**THREE, "mode": mode, **more}))}
    one = found[part]
    assert (one.drivers, one.command, one.masters) == lost


def test_a_second_network_is_a_second_way() -> None:
    wire = {"kind": "ethernet", "name": "wire", "hosts": ["laptop", "k3-pi", "epuck-pi"]}
    spec = spec_of({**THREE, "mode": "leader", "leader": "laptop", **LED, "links": [*THREE["links"], wire]})
    found = {one.name: one for one in impacts(spec) if one.kind == "network"}
    assert found["lab"].harmless
    assert found["wire"].harmless


def test_a_second_commander_is_a_second_way() -> None:
    """The pilot's program may die: the host may command as well. The host itself is the pilot's."""
    more: Data = {
        "programs": {"pilot": {"host": "epuck-pi", "use": "teleop-joy"}},
        "control": [{"by": "pilot", "of": ["k3"]}, {"by": "laptop", "of": ["k3"]}],
    }
    found = {
        (one.kind, one.name): one
        for one in impacts(spec_of({**THREE, "mode": "central", "hub": "k3-pi", **more}))
    }
    assert found["program", "pilot"].harmless
    assert found["host", "epuck-pi"].command == ()
    assert found["host", "laptop"].command == ()


def test_single_points_leave_out_what_serves_one_robot() -> None:
    spec = spec_of({**THREE, "mode": "leader", "leader": "laptop", **LED})
    assert [(one.kind, one.name) for one in single_points(impacts(spec))] == [
        ("host", "laptop"),
        ("master", "three"),
        ("network", "lab"),
    ]


def test_a_master_of_one_host_is_no_single_point() -> None:
    """It dies with its host, and takes nobody else along."""
    hosts = {name: {"address": f"10.0.0.{number}"} for number, name in enumerate("abc", 1)}
    robots = {f"k{name}": {"type": "koala", "host": name} for name in hosts}
    lines = [
        {"kind": "serial", "host": f"{name}", "robot": f"k{name}", "device": "/dev/ttyS0"} for name in hosts
    ]
    data: Data = {
        "version": 1, "name": "three", "mode": "standalone", "hosts": hosts, "robots": robots, "links": lines,
    }  # fmt: skip
    assert single_points(impacts(spec_of(data))) == ()


def test_optional_robots_are_counted_apart() -> None:
    robots = {**THREE["robots"], "epuck": {**THREE["robots"]["epuck"], "optional": True}}
    spec = spec_of({**THREE, "robots": robots, "mode": "leader", "leader": "laptop", **LED})
    worst: Impact = impacts(spec)[0]
    assert worst.robots == ("koala", "k3", "epuck")
    assert worst.missed == ("koala", "k3")
    assert worst.to_json()["optional"] == ["epuck"]
