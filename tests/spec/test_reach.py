"""What `swarmctl stop` reads of a spec is what the checked spec says, and errors elsewhere do not hide it."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.spec.reach import Reach, reach_of
from tests import ROOT
from tests.loading import load_swarm

SPECS = sorted((ROOT / "examples").glob("*/swarm.yaml"))
BROKEN = """\
name: lab
mode: nonsense
defaults: {host: {user: pi, port: 2222}}
hosts:
  pi-[1-3]: {address: "10.0.0.[1-3]", via: desk, unknown: key}
  desk: {address: 10.0.0.9, user: me, port: 22}
  lost: {}
robots:
  k[1-3]: {type: no-such-type, host: "pi-[1-3]"}
groups: {few: [k1, k3]}
programs: {p: {host: nowhere}}
links: [{kind: teleport}]
"""


def read(path: Path, *over: Path) -> Reach:
    found, _ = reach_of([path, *over])
    assert found is not None
    return found


@pytest.mark.parametrize("path", SPECS, ids=lambda one: one.parent.name)
def test_hosts_and_robots_are_those_of_the_checked_spec(path: Path) -> None:
    (swarm, _), reach = load_swarm(path), read(path)
    assert swarm is not None
    keys = ("address", "user", "port", "via", "declared")
    assert reach.name == swarm.name
    assert {name: [getattr(one, key) for key in keys] for name, one in reach.hosts.items()} == {
        name: [getattr(one, key) for key in keys] for name, one in swarm.hosts.items()
    }
    driven = {name: one.host for name, one in swarm.robots.items()}
    assert {name: one.host for name, one in reach.candidates.robots.items()} == driven


def test_a_spec_with_errors_still_says_where_its_robots_are(tmp_path: Path) -> None:
    path, over = tmp_path / "swarm.yaml", tmp_path / "over.yaml"
    path.write_text(BROKEN)
    over.write_text("hosts: {pi-2: {address: 10.0.1.2}}\n")
    reach = read(path, over)
    assert {name: one.host for name, one in reach.candidates.robots.items()} == {
        "k1": "pi-1", "k2": "pi-2", "k3": "pi-3"
    }  # fmt: skip
    pi, desk = reach.hosts["pi-2"], reach.hosts["desk"]
    assert (pi.address, pi.user, pi.port, pi.via) == ("10.0.1.2", "pi", 2222, "desk")
    assert (desk.user, desk.port, desk.declared) == ("me", 22, {"user", "port"})
    assert "lost" not in reach.hosts


@pytest.mark.parametrize("text", ["", "hosts: {a: {address: 1.2.3.4}}\n", "{", "- a\n", "name: [a]\n"])
def test_a_file_that_names_no_swarm_gives_nothing(tmp_path: Path, text: str) -> None:
    path = tmp_path / "swarm.yaml"
    path.write_text(text)
    assert reach_of([path])[0] is None
    assert reach_of([tmp_path / "missing.yaml"])[0] is None
