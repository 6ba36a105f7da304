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


def test_the_platform_is_no_robot_type(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"robot.yaml": HUMBLE}))
    assert data(found)["robots"] == {"j100-0001": {"host": "cpr-j100-0001"}}
    assert "# type: my-robot  # fill in: swarmctl has no type for j100; `swarmctl driver new`" in found.text


def test_a_file_without_hosts_is_refused(tmp_path: Path) -> None:
    files = {"robot.yaml": "serial_number: j100-0001\nsystem: {ros2: {namespace: j}}\n"}
    with pytest.raises(DraftError, match="names no host"):
        draft(lab(tmp_path, files))
