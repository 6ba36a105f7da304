"""Clearpath's robot.yaml, as files of Humble and of Jazzy have it."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.importing.drafting import DraftError
from tests.importing.drafts import data, draft, lab

HUMBLE = """serial_number: j100-0001
system:
  hosts:
    self: cpr-j100-0001
    platform: {cpr-j100-0001: 192.168.131.1}
    onboard: {gpu: 192.168.131.2}
    remote: {}
  ros2: {username: administrator, namespace: j100_0001}
"""


def test_hosts_by_group_are_read(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"robot.yaml": HUMBLE})))
    assert found["hosts"] == {
        "cpr-j100-0001": {"address": "192.168.131.1", "user": "administrator"},
        "gpu": {"address": "192.168.131.2", "user": "administrator"},
    }


def test_a_known_platform_is_a_robot_type(tmp_path: Path) -> None:
    found = data(draft(lab(tmp_path, {"robot.yaml": HUMBLE})))
    assert found["robots"] == {"j100-0001": {"type": "clearpath-j100", "host": "cpr-j100-0001"}}
    assert (found["mode"], found["hub"], found["ros"]) == ("central", "cpr-j100-0001", {"distro": "humble"})


def test_another_platform_is_to_fill_in(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"robot.yaml": HUMBLE.replace("j100-", "r100-")}))
    assert data(found)["robots"] == {"j100-0001": {"host": "cpr-r100-0001"}}
    assert "# type: my-robot  # fill in: swarmctl has no type for r100; `swarmctl driver new`" in found.text


def test_the_domain_is_kept(tmp_path: Path) -> None:
    text = "serial_number: a\nsystem: {hosts: [{hostname: pi, ip: 192.168.131.1}], ros2: {domain_id: 7}}\n"
    assert data(draft(lab(tmp_path, {"robot.yaml": text})))["ros"] == {"distro": "jazzy", "domain": 7}


def test_several_files_are_one_fleet(tmp_path: Path) -> None:
    """Computers of robots have the same address as delivered; one that both files name is one host."""
    base = "  hosts: [{hostname: NAME, ip: 192.168.131.1}, {hostname: base, ip: 192.168.131.5}]"
    files = {
        f"{name}/robot.yaml": f"serial_number: {name}\nsystem:\n{base.replace('NAME', f'cpr-{name}')}\n"
        for name in ("a200-0001", "j100-0002")
    }
    found = draft(lab(tmp_path, files))
    assert list(data(found)["hosts"]) == ["cpr-a200-0001", "base", "cpr-j100-0002"]
    robots = {
        name: {"type": f"clearpath-{name[:4]}", "host": f"cpr-{name}"} for name in ("a200-0001", "j100-0002")
    }
    assert data(found)["robots"] == robots
    line = next(one for one in found.text.split("\n") if "  cpr-j100-0002:" in one)
    assert "fill in: " in line


def test_robots_that_name_one_computer_as_theirs_are_named(tmp_path: Path) -> None:
    text = (
        "serial_number: a\nsystem:\n  hosts: [{hostname: pi, ip: 192.168.131.1}]\n  ros2: {namespace: NAME}\n"
    )
    found = draft(lab(tmp_path, {f"{one}/robot.yaml": text.replace("NAME", one) for one in ("r1", "r2")}))
    assert data(found)["robots"] == {"r1": {"host": "pi"}, "r2": {"host": "pi"}}
    assert "own computer, and r1 names the same one (r2/robot.yaml:3); check" in found.text


def test_a_file_without_hosts_is_refused(tmp_path: Path) -> None:
    files = {"robot.yaml": "serial_number: j100-0001\nsystem: {ros2: {namespace: j}}\n"}
    with pytest.raises(DraftError, match="names no host"):
        draft(lab(tmp_path, files))
