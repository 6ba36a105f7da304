"""How the nodes of an island of ROS 2 find each other, without a word of it in the spec and with some."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.spec.load import load
from swarmctl.swarm.discovery import Discovery, domains
from swarmctl.swarm.modes import islands_of
from swarmctl.swarm.resolved import Island
from tests import ROOT

MODES = ROOT / "tests/mode_conversion/modes"


def islands(folder: Path, mode: str, ros: str = "{}") -> tuple[Island, ...]:
    spec = folder / "swarm.yaml"
    spec.write_text((MODES / f"{mode}.yaml").read_text("utf-8") + f"ros: {ros}\n", "utf-8")
    document, found = load([spec])
    assert document is not None, found
    return islands_of(document.spec)


@pytest.mark.parametrize(
    ("mode", "ros", "expected"),
    [
        ("leader", "{}", ("fastrtps", "peers", ())),
        ("leader", "{discovery: server}", ("fastrtps", "server", ("koala-laptop",))),
        ("leader", "{servers: [k3-pi, koala-laptop]}", ("fastrtps", "server", ("k3-pi", "koala-laptop"))),
        ("leader", "{rmw: cyclonedds}", ("cyclonedds", "peers", ())),
        ("leader", "{rmw: zenoh}", ("zenoh", "zenoh", ("koala-laptop",))),
        ("leader", "{discovery: multicast}", ("fastrtps", "multicast", ())),
        ("single-minded", "{}", ("fastrtps", "local", ())),
        ("single-minded", "{rmw: cyclonedds}", ("cyclonedds", "local", ())),
        ("single-minded", "{rmw: zenoh}", ("zenoh", "zenoh", ("koala-laptop",))),
        ("single-minded", "{servers: [koala-laptop]}", ("fastrtps", "server", ("koala-laptop",))),
    ],
)
def test_the_spec_or_the_mode_decides(
    tmp_path: Path, mode: str, ros: str, expected: tuple[str, str, tuple[str, ...]]
) -> None:
    [island] = islands(tmp_path, mode, ros)
    found = island.discovery
    assert (found.rmw, found.method, found.servers) == expected


def test_each_island_has_its_own_domain_and_hub(tmp_path: Path) -> None:
    found = islands(tmp_path, "standalone", "{distro: jazzy, domain: 101}")
    assert [one.discovery.domain for one in found] == [101, 1, 2]
    assert [one.hub for one in found] == ["koala-laptop", "k3-pi", "epuck-pi"]
    assert isinstance(found[0].discovery, Discovery)


@pytest.mark.parametrize("first", [None, 0, 1, 50, 101])
def test_no_two_islands_have_the_same_domain(first: int | None) -> None:
    count = 102 if first == 0 else 101
    found = list(domains("newswarm", first, count))
    assert len(set(found)) == len(found) == count
    assert set(found) - {0} == set(range(1, 102))


def test_the_name_of_a_swarm_decides_its_domain() -> None:
    assert [next(domains(name, None, 1)) for name in ("newswarm", "newswarm", "lab")] == [11, 11, 85]
