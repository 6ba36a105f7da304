"""Settings of fkie's nodes: each has its key in the draft, or a line that shows why not."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.importing.drafts import data, draft, lab

ENV = "export ROS_IP=10.0.0.{0}\nexport ROS_MASTER_URI=http://10.0.0.{0}:11311\n"
HOSTS = {"a.sh": ENV.format(1), "b.sh": ENV.format(2)}
SYNC = [
    ("master_sync_fkie", "master_sync", "multimaster_fkie"),
    ("fkie_master_sync", "master_sync", "fkie_multimaster"),
    ("fkie_mas_sync", "mas-sync", "fkie_mas"),
]


def node(inner: str, args: str = "", package: str = "fkie_master_sync", kind: str = "master_sync") -> str:
    return f'<launch><node pkg="{package}" type="{kind}" name="n" args="{args}">{inner}</node></launch>'


@pytest.mark.parametrize("names", SYNC)
@pytest.mark.parametrize(
    ("inner", "args"),
    [
        ('<param name="mcast_group" value="239.0.0.1"/>', ""),
        ('<param name="~mcast_group" value="239.0.0.1"/>', ""),
        ('<rosparam param="_mcast_group">239.0.0.1</rosparam>', ""),
        ("<rosparam>\nmcast_group: 239.0.0.1\n</rosparam>", ""),
        ('<rosparam subst_value="true">mcast_group: $(arg g)</rosparam>', ""),
        ('<rosparam file="$(dirname)/g.yaml"/>', ""),
        ("", "_mcast_group:=239.0.0.1 --screen"),
    ],
)
def test_a_parameter_is_read_in_each_form(
    names: tuple[str, str, str], inner: str, args: str, tmp_path: Path
) -> None:
    package, kind, packages = names
    text = node(inner, args, package, kind).replace("<launch>", '<launch><arg name="g" value="239.0.0.1"/>')
    found = draft(lab(tmp_path, {**HOSTS, "m.launch": text, "g.yaml": "mcast_group: 239.0.0.1\n"}))
    assert data(found)["multimaster"] == {"packages": packages, "group": "239.0.0.1"}


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("mcast_port: 11999", {"port": 11999}),
        ("{heartbeat_hz: 0.5, active_request_after: 5, remove_after: 50}",
         {"heartbeat_hz": 0.5, "active_request_after": 5, "remove_after": 50}),
        ("robot_hosts: [10.0.0.1, b]", {"robot_hosts": {"a": ["b"], "b": ["a"]}}),
        ("robot_hosts: []", {}),
        ("sync_hosts: [a, b]", {"sync_hosts": ["a", "b"]}),
        ("ignore_hosts: b", {"ignore_hosts": ["b"]}),
        ("sync_topics: [/x, y/z]",
         {"topics": [{"topic": "/x", "to": ["a", "b"]}, {"topic": "y/z", "to": ["a", "b"]}]}),
        ("sync_topics: [{a: [/x]}, /x, {b: /y}]",
         {"topics": [{"topic": "/x", "to": ["b", "a"]}, {"topic": "/y", "to": ["a"]}]}),
    ],
)  # fmt: skip
def test_a_setting_has_its_key(setting: str, expected: object, tmp_path: Path) -> None:
    text = node(f"<rosparam>{setting}</rosparam>")
    found = data(draft(lab(tmp_path, {**HOSTS, "m.launch": text})))
    assert found["mode"] == "standalone"
    assert found["multimaster"] == {"packages": "fkie_multimaster", **expected}  # type: ignore[dict-item]


@pytest.mark.parametrize(
    ("setting", "shown"),
    [
        ("ignore_nodes: [/n]", "#   m.launch:1: a spec has no key for ignore_nodes"),
        ("sync_hosts: [a, ghost]", "#   m.launch:1: sync_hosts: no host is called ghost"),
        ("mcast_group: [", "#   m.launch:1: its rosparam cannot be read"),
        ("sync_topics:", "#   m.launch:1: sync_topics cannot be read"),
        ("mcast_group: 2020-01-01", 'group: "2020-01-01"  # from m.launch:1; fill in: '),
        (
            "sync_topics: ['/*/odom', /x]",
            '  # topics: [{topic: "/*/odom", to: [a, b]}]  # fill in: m.launch:1: sync_topics has a pattern',
        ),
    ],
)
def test_what_has_no_key_is_shown(setting: str, shown: str, tmp_path: Path) -> None:
    text = node(f"<rosparam>{setting}</rosparam>")
    assert shown in draft(lab(tmp_path, {**HOSTS, "m.launch": text})).text


def test_a_setting_of_one_host_is_not_for_all(tmp_path: Path) -> None:
    """A launch file called like a host is started there."""
    files = {
        "a.launch": node("<rosparam>{robot_hosts: [b], sync_topics: [/x], mcast_port: 1}</rosparam>"),
        "b.launch": node("<rosparam>{sync_topics: [/y], mcast_port: 2}</rosparam>"),
    }
    found = draft(lab(tmp_path, {**HOSTS, **files}))
    settings = data(found)["multimaster"]
    assert settings["robot_hosts"] == {"a": ["b"]}
    assert settings["topics"] == [{"topic": "/x", "to": ["a"]}, {"topic": "/y", "to": ["b"]}]
    assert "#   b.launch:1: port; a.launch:1 has another value" in found.text


def test_peers_are_hosts(tmp_path: Path) -> None:
    text = node("<rosparam>robot_hosts: [10.0.0.1, rover.local, localhost]</rosparam>")
    found = data(draft(lab(tmp_path, {"m.launch": text})))
    assert {one["address"] for one in found["hosts"].values()} == {"10.0.0.1", "rover.local"}
    assert found["multimaster"]["robot_hosts"] == {"master": ["rover"], "rover": ["master"]}


@pytest.mark.parametrize(
    "outside",
    [
        '<param name="/n/mcast_group" value="239.0.0.1"/>',
        '<param name="n/mcast_group" value="239.0.0.1"/>',
        '<rosparam param="n/mcast_group">239.0.0.1</rosparam>',
        '<rosparam ns="n">mcast_group: 239.0.0.1</rosparam>',
        '<rosparam ns="n" param="mcast_group">239.0.0.1</rosparam>',
        "<rosparam>n: {mcast_group: 239.0.0.1}</rosparam>",
    ],
)
def test_a_parameter_may_stand_outside_its_node(outside: str, tmp_path: Path) -> None:
    text = node("").replace("<launch>", f"<launch>{outside}")
    found = data(draft(lab(tmp_path, {**HOSTS, "m.launch": text})))
    assert found["multimaster"] == {"packages": "fkie_multimaster", "group": "239.0.0.1"}
