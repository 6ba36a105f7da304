"""ROS_IP, ROS_HOSTNAME and ROS_MASTER_URI in a form that ROS refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.drafts import data, draft, lab

LAPTOP = "ROS_IP=10.0.0.7\nROS_MASTER_URI=http://{}:11311\n"


@pytest.mark.parametrize("name", ["ROS_IP", "ROS_HOSTNAME"])
@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("http://10.0.0.5", "10.0.0.5"),
        ("http://10.0.0.5:11311/", "10.0.0.5"),
        ("10.0.0.5:11311", "10.0.0.5"),
        ("10.0.0.5/", "10.0.0.5"),
        ("https://rover.local/", "rover.local"),
    ],
)
def test_a_url_is_the_host_in_it(name: str, text: str, address: str, tmp_path: Path) -> None:
    files = {"rover.sh": f"{name}={text}\n", "laptop.sh": LAPTOP.format(address)}
    found = draft(lab(tmp_path, files))
    addresses = {host: one["address"] for host, one in data(found)["hosts"].items()}
    assert addresses == {"laptop": "10.0.0.7", "rover": address}
    assert f'rover.sh:1, "{text}" there, ROS needs {address}\n' in found.text.replace("; check", "")


@pytest.mark.parametrize(
    ("files", "shown"),
    [
        (
            {"a.launch": '<launch><machine name="rover" address="10.0.0.5"/></launch>'},
            'address: 10.0.0.5  # from rover.sh:1, "http://10.0.0.5" there, ROS needs 10.0.0.5',
        ),
        (
            {"rover.sh": "ROS_HOSTNAME=http://10.0.0.5\nROS_IP=10.0.0.5\n"},
            "#   rover.sh:1: ROS_HOSTNAME; ROS needs 10.0.0.5",
        ),
    ],
)
def test_a_wrong_name_is_shown_beside_a_right_one(files: dict[str, str], shown: str, tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"rover.sh": "ROS_HOSTNAME=http://10.0.0.5\n", **files}))
    assert [one["address"] for one in data(found)["hosts"].values()] == ["10.0.0.5"]
    assert shown in found.text


@pytest.mark.parametrize(
    ("uri", "needed"),
    [
        ("10.0.0.5", "http://10.0.0.5:11311"),
        ("10.0.0.5:11312", "http://10.0.0.5:11312"),
        ("http://10.0.0.5", "http://10.0.0.5:11311"),
        ("https://10.0.0.5:11311", "http://10.0.0.5:11311"),
        ("rosmaster://10.0.0.5:11311/", "http://10.0.0.5:11311"),
        ("http://10.0.0.5:11311", ""),
        ("http://10.0.0.5:11311/", ""),
    ],
)
@pytest.mark.parametrize("other", ["10.0.0.5", "10.0.0.7", ""])
def test_what_a_master_uri_lacks_is_shown(uri: str, needed: str, other: str, tmp_path: Path) -> None:
    """In each mode: one master, one a host, one host."""
    files = {"rover.sh": f"ROS_IP=10.0.0.5\nROS_MASTER_URI={uri}\n"}
    found = draft(lab(tmp_path, {**files, **({"laptop.sh": LAPTOP.format(other)} if other else {})}))
    shown = f'"{uri}" there, ROS needs {needed}' if needed else ""
    assert shown in found.text
    assert ("ROS needs" in found.text) is bool(needed)


def test_no_password_of_a_uri_is_shown(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"a.sh": "ROS_IP=10.0.0.5\nROS_MASTER_URI=http://me:hunter2@10.0.0.5\n"}))
    assert "ROS needs http://10.0.0.5:11311" in found.text
    assert "hunter2" not in found.text
