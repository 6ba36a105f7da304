"""The guard of the master of a filtered island: what it knows follows from the spec."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from swarm_onboard.guard import config

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of

PARAMS = "guard/config.yaml"
MASTER = "units/swarm-newswarm.master.service"
LAPTOP, K3, EPUCK = "koala-laptop", "k3-pi", "epuck-pi"


def rendered(folder: Path, example: str, more: str = "security: filtered\n") -> Mapping[str, Bundle]:
    overlay = folder / "overlay.yaml"
    overlay.write_text(more, "utf-8")
    swarm, found = load_swarm(ROOT / "examples" / example / "swarm.yaml", overlay)
    assert swarm is not None, found
    return bundles(swarm)


def params(bundle: Bundle) -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(text_of(bundle, PARAMS))
    assert config.parse(data)
    return data


def test_with_security_off_nothing_of_it_is_rendered(tmp_path: Path) -> None:
    for bundle in rendered(tmp_path, "paper-leader", "security: 'off'\n").values():
        assert not [file.path for file in bundle.files if "guard" in file.path or "rosmaster" in file.path]
    assert "guard" not in text_of(rendered(tmp_path, "paper-leader", "security: 'off'\n")[LAPTOP], MASTER)


def test_only_the_host_of_the_master_has_it(tmp_path: Path) -> None:
    found = rendered(tmp_path, "paper-leader")
    guarded = [host for host, one in found.items() if any(file.path == PARAMS for file in one.files)]
    assert guarded == [LAPTOP]


def test_hosts_of_the_island_may_call(tmp_path: Path) -> None:
    found = params(rendered(tmp_path, "paper-leader")[LAPTOP])
    assert found["hosts"] == {
        LAPTOP: ["192.168.77.10", LAPTOP],
        K3: ["192.168.77.11", K3],
        EPUCK: ["192.168.77.12", EPUCK],
    }
    assert (found["hub"], found["places"], found["others"]) == (LAPTOP, ["192.168.77.10", "127.0.0.1"], {})


def test_a_robot_belongs_to_its_host(tmp_path: Path) -> None:
    found = params(rendered(tmp_path, "paper-leader")[LAPTOP])
    assert found["names"]["/k3"] == found["names"]["/k3/driver"] == found["topics"]["/k3/odom"] == [K3]
    assert "/diagnostics" not in found["topics"]
    assert "/tf" not in found["topics"]


def test_its_commanders_may_command_it(tmp_path: Path) -> None:
    assert params(rendered(tmp_path, "paper-leader")[LAPTOP])["topics"]["/k3/cmd_vel"] == [LAPTOP]


def test_a_program_in_its_namespace_may_run_elsewhere(tmp_path: Path) -> None:
    more = """
security: filtered
programs:
  follow:
    host: epuck-pi
    namespace: k3
    package: demo
    executable: follow
    publishes: [{topic: /goal, type: geometry_msgs/PoseStamped}]
"""
    found = params(rendered(tmp_path, "paper-leader", more)[LAPTOP])
    assert found["names"]["/k3"] == [K3, EPUCK]
    assert found["names"]["/k3/follow"] == found["topics"]["/goal"] == [EPUCK]
    assert found["names"]["/k3/driver"] == [K3]


def test_other_islands_get_what_crosses(tmp_path: Path) -> None:
    """The laptop's teleop commands the K3, whose island has its own master."""
    found = rendered(tmp_path, "paper-4-standalone")
    assert params(found[LAPTOP])["others"] == {
        K3: {"at": ["192.168.77.11", K3], "receives": ["/k3/cmd_vel"], "sends": []},
        EPUCK: {"at": ["192.168.77.12", EPUCK], "receives": ["/epuck/cmd_vel"], "sends": []},
    }
    assert params(found[K3])["joined"] == ["192.168.77.10", LAPTOP]
    assert params(found[K3])["others"] == {}
    assert params(found[K3])["names"]["/joystick"] == [LAPTOP]


def test_masters_that_discover_each_other_may_call(tmp_path: Path) -> None:
    more = "security: filtered\nmultimaster: {provider: fkie}\n"
    found = params(rendered(tmp_path, "paper-4-standalone", more)[K3])
    assert found["others"][EPUCK] == {"at": ["192.168.77.12", EPUCK], "receives": [], "sends": []}


def test_a_change_of_its_parameters_restarts_no_master(tmp_path: Path) -> None:
    more = "security: filtered\nprograms: {own: {host: k3-pi, package: demo, executable: own}}\n"
    before, after = (rendered(tmp_path, "paper-leader", *one)[LAPTOP] for one in ((), (more,)))
    assert params(before) != params(after)
    units = ([one for one in host.manifest["units"] if "master" in one["name"]] for host in (before, after))
    assert next(units) == next(units)


@pytest.mark.parametrize("address", ["192.168.77.10", "127.0.0.1", "::1"])
def test_the_master_is_called_from_its_own_host(address: str, tmp_path: Path) -> None:
    found = config.parse(params(rendered(tmp_path, "paper-leader")[LAPTOP]))
    assert found.callers[address].host == LAPTOP
