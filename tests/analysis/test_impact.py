"""What is lost if a part fails: known cases, and a comparison with a brute-force model."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from hypothesis import given, settings

from swarmctl.analysis.impact import Impact, impacts, single_points
from tests.swarm.random_swarms import Data, index_of, swarms

Part = tuple[str, str]


class Life:
    """A brute-force model of a swarm with one failed part: what runs, what is received and commanded."""

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

    def connected(self, one: str, other: str) -> bool:
        homes = [self.home(one), self.home(other)]
        if None in homes or not all(self.master(home) for home in homes if home is not None):
            return False
        first, second = (self.islands[home][0] for home in homes if home is not None)
        pairs = ((one, other), (one, first), (other, second), (first, second))
        return all(self.wire(*pair) for pair in pairs)

    def carried(self, origin: str, to: str) -> bool:
        """Between islands the multimaster is needed: fkie's on both, ours on the one that receives."""
        first, second = self.home(origin), self.home(to)
        provider = self.data.get("multimaster", {}).get("provider", "fkie")
        ends = () if first == second else (second,) if provider == "static" else (first, second)
        return all(self.lives("multimaster", end or "") for end in ends) and self.connected(origin, to)

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
        return there and self.carried(host, self.data["robots"][robot]["host"])

    def received(self) -> Iterator[tuple[str, str]]:
        for name, program in self.data["programs"].items():
            for topic in program["subscribes"]:
                if self.program(name) and self.published(topic["topic"], program["host"]):
                    yield topic["topic"], name

    def published(self, topic: str, to: str) -> bool:
        robot = topic.split("/")[1]
        if topic.endswith("/odom"):
            return self.driver(robot) and self.carried(self.data["robots"][robot]["host"], to)
        return any(
            self.program(name) and self.carried(one["host"], to)
            for name, one in self.data["programs"].items()
            if topic in [each["topic"] for each in one["publishes"]]
        )


def losses(data: Data, part: Part) -> tuple[set[object], ...]:
    """What works with all parts, and does not work without ``part``."""
    before, after = Life(data, None), Life(data, part)
    robots, programs = data["robots"], data["programs"]
    drivers = {one for one in robots if before.driver(one) and not after.driver(one)}
    command = {
        one for one in robots if after.driver(one) and before.commanded(one) and not after.commanded(one)
    }
    masters = {one for one in before.islands if not after.master(one)}
    ended = {one for one in programs if not after.program(one)} - {part[1] if part[0] == "program" else ""}
    silent = {
        (topic, one) for topic, one in set(before.received()) - set(after.received()) if after.program(one)
    }
    return drivers, command, masters, ended, silent


@settings(max_examples=150)
@given(swarms())
def test_impact_equals_the_brute_force_model(data: Data) -> None:
    found = impacts(index_of(data))
    assert len({(one.kind, one.name) for one in found}) == len(found)
    for one in found:
        found_losses = tuple(map(set, (one.drivers, one.command, one.masters, one.programs, one.data)))
        assert found_losses == losses(data, (one.kind, one.name)), (one.kind, one.name)


@settings(max_examples=50)
@given(swarms())
def test_the_worst_is_first_and_optional_robots_weigh_less(data: Data) -> None:
    found = impacts(index_of(data))
    missed = [len(one.missed) + len(one.missed_programs) for one in found]
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

FKIE: Data = {"multimaster": {"provider": "fkie"}}


def hanging_on(host: str) -> list[Data]:
    """All lines connected to one host, as in mode single-minded."""
    return [one if one["kind"] == "wlan" else {**one, "host": host} for one in THREE["links"]]


@pytest.mark.parametrize(
    ("mode", "more", "part", "lost"),
    [
        # The leader takes everything with it, whether it drives the others or commands them.
        ("single-minded", {"leader": "laptop", "links": hanging_on("laptop"), **LED}, ("host", "laptop"),
         (("koala", "k3", "epuck"), (), ("three",))),
        ("leader", {"leader": "laptop", **LED}, ("host", "laptop"),
         (("koala",), ("k3", "epuck"), ("three",))),
        ("leader", {"leader": "laptop", **LED}, ("host", "k3-pi"), (("k3",), (), ())),
        ("leader", {"leader": "laptop", **LED}, ("network", "lab"), ((), ("k3", "epuck"), ())),
        # Without the hub there is no master, though each robot has its own commander.
        ("central", {"hub": "k3-pi", **EACH}, ("host", "k3-pi"), (("k3",), ("koala", "epuck"), ("three",))),
        ("central", {"hub": "k3-pi", **EACH}, ("master", "three"),
         ((), ("koala", "k3", "epuck"), ("three",))),
        # In mode standalone a host takes only its own robots, and the network between them none.
        ("standalone", EACH, ("host", "laptop"), (("koala",), (), ("laptop",))),
        ("standalone", EACH, ("network", "lab"), ((), (), ())),
        ("standalone", LED, ("network", "lab"), ((), ("k3", "epuck"), ())),
        # Each island fails alone.
        ("combined", {**COMBINED, **EACH}, ("host", "laptop"), (("koala",), ("epuck",), ("big",))),
        ("combined", {**COMBINED, **EACH}, ("master", "small"), ((), ("k3",), ("small",))),
        ("combined", {**COMBINED, **LED}, ("master", "small"), ((), ("k3",), ("small",))),
        # Commands from the other island pass the multimaster of both with fkie, of the receiver with ours.
        ("combined", {**COMBINED, **LED}, ("multimaster", "small"), ((), ("k3",), ())),
        ("combined", {**COMBINED, **LED}, ("multimaster", "big"), ((), ("k3",), ())),
        ("combined", {**COMBINED, **EACH, **FKIE}, ("multimaster", "small"), ((), (), ())),
    ],
)  # fmt: skip
def test_what_is_lost_in_each_mode(
    mode: str, more: Data, part: Part, lost: tuple[tuple[str, ...], ...]
) -> None:
    """Which robots lose their driver, which lose command, which islands their master."""
    found = {(one.kind, one.name): one for one in impacts(index_of({**THREE, "mode": mode, **more}))}
    one = found[part]
    assert (one.drivers, one.command, one.masters) == lost


def test_our_multimaster_fails_only_where_it_runs() -> None:
    static: Data = {"multimaster": {"provider": "static"}, **COMBINED, **LED}
    found = {one.name: one for one in impacts(index_of({**THREE, "mode": "combined", **static}))
             if one.kind == "multimaster"}  # fmt: skip
    assert {name: one.command for name, one in found.items()} == {"small": ("k3",)}


def test_with_a_second_network_the_first_is_not_needed() -> None:
    wire = {"kind": "ethernet", "name": "wire", "hosts": ["laptop", "k3-pi", "epuck-pi"]}
    index = index_of({**THREE, "mode": "leader", "leader": "laptop", **LED, "links": [*THREE["links"], wire]})
    found = {one.name: one for one in impacts(index) if one.kind == "network"}
    assert found["lab"].harmless
    assert found["wire"].harmless


def test_with_a_second_commander_the_first_is_not_needed() -> None:
    """The pilot's program or its host may fail, as the laptop may command too."""
    more: Data = {
        "programs": {"pilot": {"host": "epuck-pi", "use": "teleop-joy"}},
        "control": [{"by": "pilot", "of": ["k3"]}, {"by": "laptop", "of": ["k3"]}],
    }
    found = {
        (one.kind, one.name): one
        for one in impacts(index_of({**THREE, "mode": "central", "hub": "k3-pi", **more}))
    }
    assert found["program", "pilot"].harmless
    assert found["host", "epuck-pi"].command == ()
    assert found["host", "laptop"].command == ()


def test_single_points_exclude_parts_that_serve_one_robot() -> None:
    index = index_of({**THREE, "mode": "leader", "leader": "laptop", **LED})
    assert [(one.kind, one.name) for one in single_points(impacts(index))] == [
        ("host", "laptop"),
        ("master", "three"),
        ("network", "lab"),
    ]


def test_a_master_of_one_host_is_no_single_point() -> None:
    """It fails with its host, and nothing else is lost."""
    hosts = {name: {"address": f"10.0.0.{number}"} for number, name in enumerate("abc", 1)}
    robots = {f"k{name}": {"type": "koala", "host": name} for name in hosts}
    lines = [
        {"kind": "serial", "host": f"{name}", "robot": f"k{name}", "device": "/dev/ttyS0"} for name in hosts
    ]
    data: Data = {
        "version": 1, "name": "three", "mode": "standalone", "hosts": hosts, "robots": robots, "links": lines,
    }  # fmt: skip
    assert single_points(impacts(index_of(data))) == ()


def test_optional_robots_are_counted_separately() -> None:
    robots = {**THREE["robots"], "epuck": {**THREE["robots"]["epuck"], "optional": True}}
    index = index_of({**THREE, "robots": robots, "mode": "leader", "leader": "laptop", **LED})
    worst: Impact = impacts(index)[0]
    assert worst.robots == ("koala", "k3", "epuck")
    assert worst.missed == ("koala", "k3")
    assert worst.to_json()["optional"] == ["epuck"]


def test_a_server_of_many_programs_is_worse_than_one_robot() -> None:
    hosts = {**THREE["hosts"], "server": {"address": "10.0.0.4"}}
    programs = {
        f"map-{number}": {"host": "server", "package": "gmapping", "executable": "slam_gmapping"}
        for number in range(3)
    }
    lab = {**THREE["links"][0], "hosts": [*hosts]}
    more: Data = {"hosts": hosts, "programs": programs, "links": [lab, *THREE["links"][1:]], **LED}
    found = impacts(index_of({**THREE, "mode": "leader", "leader": "laptop", **more}))
    ranked = [(one.kind, one.name) for one in found if one.kind == "host"]
    assert ranked[:2] == [("host", "laptop"), ("host", "server")]
    assert ("host", "server") in [(one.kind, one.name) for one in single_points(found)]
