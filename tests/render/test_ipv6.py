"""`ros.ipv6`: all that starts ROS on a host has ROS_IPV6=on, containers too."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm

SPEC = """\
version: 1
name: six
mode: central
hub: desk
ros: {ipv6: %s}
hosts:
  desk: {address: desk.lab}
  pi: {address: pi.lab}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [desk, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs:
  see: {host: pi, container: {image: docker.io/library/see@sha256:%s, engine: podman}}
"""


@pytest.mark.parametrize("used", [True, False])
def test_everything_that_starts_ros_has_the_variable(used: bool, tmp_path: Path) -> None:
    (tmp_path / "six.yaml").write_text(SPEC % (str(used).lower(), "0" * 64))
    swarm, found = load_swarm(tmp_path / "six.yaml")
    assert swarm is not None, found
    made = {
        host: {one.path: one.content.decode() for one in bundles(swarm)[host].files} for host in swarm.hosts
    }
    for files in made.values():
        assert ("ROS_IPV6=on" in files["env/ros.env"].splitlines()) is used
        assert ("export ROS_IPV6=on" in files["setup.bash"].splitlines()) is used
    assert ("--env ROS_IPV6 " in made["pi"]["units/swarm-six.see.service"]) is used
