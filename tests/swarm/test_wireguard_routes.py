"""Hosts of a sealed swarm that share no network exchange packets through one that shares one with each."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.diagnostics import Severity
from swarmctl.swarm.resolved import Swarm
from swarmctl.swarm.wireguard_routes import ends_of, routes_of
from tests import ROOT
from tests.loading import load_swarm

TWO_NETWORKS = (ROOT / "tests/e2e/two-networks.yaml").read_text("utf-8")
APART = ("hosts: [laptop, epuck-pi]", "hosts: [epuck-pi]")


def swarm_of(folder: Path, *changes: tuple[str, str]) -> tuple[Swarm | None, set[str]]:
    spec, text = folder / "swarm.yaml", TWO_NETWORKS
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    spec.write_text(text, "utf-8")
    swarm, found = load_swarm(spec)
    return swarm, {one.code for one in found if one.severity is Severity.ERROR}


def test_the_hub_relays_for_hosts_that_share_no_network(tmp_path: Path) -> None:
    swarm, errors = swarm_of(tmp_path)
    assert errors == set()
    assert swarm is not None
    assert routes_of(swarm, "k3-pi") == {"laptop": ("epuck-pi",)}
    assert routes_of(swarm, "epuck-pi") == {"laptop": ("k3-pi",)}
    assert routes_of(swarm, "laptop") == {"epuck-pi": (), "k3-pi": ()}
    assert (ends_of(swarm, "laptop"), ends_of(swarm, "k3-pi")) == (["epuck-pi", "k3-pi"], [])


def test_another_host_relays_to_the_hub(tmp_path: Path) -> None:
    behind = ("hosts: [laptop, epuck-pi]", "hosts: [k3-pi, epuck-pi]")
    root = ("security: sealed", "security: sealed\ntime: {root: k3-pi, servers: [pool.ntp.org]}")
    swarm, errors = swarm_of(tmp_path, behind, root)
    assert errors == set()
    assert swarm is not None
    assert routes_of(swarm, "epuck-pi") == {"k3-pi": ("laptop",)}
    assert swarm_of(tmp_path, behind)[1] == {"TIME001"}  # clocks pass through nobody
    assert "NET001" in swarm_of(tmp_path, behind, ("security: sealed", "security: filtered"))[1]


def test_in_one_network_nobody_relays(tmp_path: Path) -> None:
    swarm, _ = swarm_of(tmp_path, ("hosts: [laptop, k3-pi]", "hosts: [laptop, k3-pi, epuck-pi]"))
    assert swarm is not None
    assert swarm.relays == {}
    assert routes_of(swarm, "k3-pi") == {"epuck-pi": (), "laptop": ()}


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ([APART], "NET001"),
        ([("security: sealed", "security: filtered")], "SEC006"),
        ([("security: sealed", "security: filtered")], "NET006"),
        ([("address: 10.42.0.12", "address: 10.43.0.12")], "SEC006"),
    ],
    ids=["nobody shares a network with both", "filtered", "filtered, the hub", "the address is elsewhere"],
)
def test_what_no_host_relays_is_refused(tmp_path: Path, changes: list[tuple[str, str]], rule: str) -> None:
    assert rule in swarm_of(tmp_path, *changes)[1]
