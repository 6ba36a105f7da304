"""Who may command a robot in every mode: declared commanders, the leader, or the robot's own programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.swarm.authority import OWN
from swarmctl.swarm.resolved import Commander, Swarm
from tests.loading import load_swarm
from tests.swarm.test_islands import BODY, COMBINED

LEADER = Commander("laptop", 0, addresses=("192.168.77.10",))
K3, EPUCK, LAPTOP = ("192.168.77.11",), ("192.168.77.12",), ("192.168.77.10",)
OWN_K3 = Commander("k3-pi", OWN, namespace="/k3", hosts=K3, addresses=K3)
OWN_EPUCK = Commander("epuck-pi", OWN, namespace="/epuck", hosts=EPUCK, addresses=EPUCK)
BY_KOALA = Commander("koala", 0, namespace="/koala", hosts=LAPTOP)


def swarm_in(folder: Path, mode: str, control: str) -> Swarm:
    islands = COMBINED if mode == "combined" else ""
    role = {"leader": "leader: laptop", "single-minded": "leader: laptop", "central": "hub: laptop"}.get(
        mode, ""
    )
    body = BODY[: BODY.index("control:")]
    text = f"version: 1\nname: s\nmode: {mode}\n{role}\ntime: {{root: laptop}}\n{body}{control}\n{islands}"
    path = folder / "swarm.yaml"
    path.write_text(text, "utf-8")
    swarm, found = load_swarm(path)
    assert swarm is not None, [one.message for one in found]
    return swarm


@pytest.mark.parametrize(
    ("mode", "robot", "control", "commanders"),
    [
        ("leader", "k3", "", [LEADER]),
        ("leader", "koala", "", [LEADER]),
        ("leader", "k3", "control: [{by: koala, of: [k3]}]", [BY_KOALA]),
        ("central", "k3", "", [OWN_K3]),
        ("central", "k3", "control: [{by: koala, of: [k3]}]", [BY_KOALA, OWN_K3]),
        ("central", "epuck", "control: [{by: koala, of: [k3]}]", [OWN_EPUCK]),
        ("standalone", "epuck", "", [OWN_EPUCK]),
        ("standalone", "epuck", "control: [{by: koala, of: [epuck]}]", [BY_KOALA, OWN_EPUCK]),
        (
            "central",
            "k3",
            "control: [{by: koala, of: [k3]}, {by: laptop, of: [k3], priority: 7}]",
            [Commander("laptop", 7, addresses=("192.168.77.10",)), BY_KOALA, OWN_K3],
        ),
        (
            "central",
            "k3",
            "control: [{by: follow, of: [k3]}]",
            [Commander("follow", 0, nodes=("/k3/follow",), hosts=K3), OWN_K3],
        ),
    ],
)
def test_the_commanders_of_a_robot(
    tmp_path: Path, mode: str, robot: str, control: str, commanders: list[Commander]
) -> None:
    assert list(swarm_in(tmp_path, mode, control).robots[robot].commanders) == commanders


def test_the_mode_of_the_island_decides_who_commands(tmp_path: Path) -> None:
    swarm = swarm_in(tmp_path, "combined", "")
    assert [one.name for one in swarm.robots["k3"].commanders] != []
    by_island = {island.name: island.hub for island in swarm.islands}
    for robot in swarm.robots.values():
        island = swarm.island_of(robot.host)
        assert [one.name for one in robot.commanders] in ([by_island[island.name]], [robot.host])
