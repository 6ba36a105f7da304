"""``swap``: another device takes a robot's place; its role stays, and so does the rest of the text."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from swarmctl.cli.app import run
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.spec.swap import SwapError, swap
from swarmctl.yamltext.edits import apply
from tests import ROOT
from tests.loading import load_checked, load_swarm

HEAD = """version: 1
name: lab
mode: central
hub: desk
hosts:
  desk: {address: 10.0.0.2, user: robot, bluetooth: [hci0]}
  pi-[1-3]: {address: "10.0.0.[11-13]", user: robot, bluetooth: [hci0]}
"""
WLAN = "  - {kind: wlan, name: air, hosts: [desk, pi-1, pi-2, pi-3]}\n"
SPEC = f"""# Monday.
{HEAD}robots:
  epuck3:                        # first of the row
    type: epuck
    host: pi-1
    start: {{x: 1.0, y: 0.0}}
    settings:
      rates: {{odom: 5.0}}
      calibration: {{distance_scale: 1.02}}
  epuck7: {{type: epuck, host: pi-2, optional: true}}      # on the shelf
  k3: {{type: khepera3, host: pi-3}}
links:
{WLAN}  - kind: bluetooth
    host: pi-1
    robot: epuck3
    mac: "10:00:e8:c5:64:37"     # printed below it
    pin: {{secret: pin-3}}
  - {{kind: bluetooth, host: pi-2, robot: epuck7, mac: "10:00:e8:c5:71:0a"}}
  - {{kind: serial, host: pi-3, robot: k3, usb: {{serial: FTDI1}}}}
"""
SWAPPED = (
    SPEC.replace('"10:00:e8:c5:64:37" ', '"MAC" ')
    .replace('"10:00:e8:c5:71:0a"', '"10:00:e8:c5:64:37", pin: {secret: pin-3}')
    .replace('"MAC" ', '"10:00:e8:c5:71:0a" ')
    .replace("    pin: {secret: pin-3}\n", "")
    .replace("      calibration: {distance_scale: 1.02}\n", "")
    .replace("optional: true}", "optional: true, settings: {calibration: {distance_scale: 1.02}}}")
)

#: Two robots and their links, and what is exchanged.
KINDS = {
    "adapters of one host": (
        """  a: {type: khepera3, host: pi-1}
  b: {type: khepera3, host: pi-1}
""",
        """  - {kind: serial, host: pi-1, robot: a, usb: {serial: A1}}
  - {kind: serial, host: pi-1, robot: b, usb: {serial: B1}, baud: 115200}
""",
        {"usb", "baud"},
    ),
    "computers with adapters": (
        """  a: {type: khepera3, host: pi-1}
  b: {type: khepera3, host: pi-2}
""",
        """  - {kind: serial, host: pi-1, robot: a, usb: {serial: A1}}
  - {kind: serial, host: pi-2, robot: b, device: /dev/ttyS0}
""",
        {"host", "usb", "device"},
    ),
    "computers of a range": (
        "  a-[1-3]: {type: khepera3, host: 'pi-[1-3]'}\n",
        "  - {kind: serial, host: 'pi-[1-3]', robot: 'a-[1-3]', usb: {serial: 'S[1-3]'}}\n",
        {"host", "usb"},
    ),
    "computers without a link": (
        """  a: {type: turtlebot3-burger, host: pi-1}
  b: {type: turtlebot3-burger, host: pi-2}
""",
        "",
        {"host"},
    ),
    "radio addresses": (
        """  a: {type: crazyflie, host: pi-1}
  b: {type: crazyflie, host: pi-2}
""",
        """  - {kind: radio, host: pi-1, robot: a, uri: radio://0/80/2M/E7E7E7E701}
  - {kind: radio, host: pi-2, robot: b, uri: radio://1/90/2M/E7E7E7E702}
""",
        {"uri"},
    ),
}


def spec_at(folder: Path, text: str) -> Path:
    (folder / "swarm.yaml").write_text(text)
    return folder / "swarm.yaml"


def swapped(file: Path, robot: str, other: str) -> str:
    document, found = load_checked(file)
    assert document is not None, found
    made = swap(document, robot, other)
    return apply(file.read_text(), made.edits[str(file)])


def rendered(file: Path) -> dict[str, Bundle]:
    swarm, found = load_swarm(file)
    assert swarm is not None, found
    return dict(bundles(swarm))


def test_a_swap_moves_the_device_only(tmp_path: Path) -> None:
    assert swapped(spec_at(tmp_path, SPEC), "epuck3", "epuck7") == SWAPPED


def test_only_the_hosts_of_the_two_change(tmp_path: Path) -> None:
    before = rendered(spec_at(tmp_path, SPEC))
    after = rendered(spec_at(tmp_path, SWAPPED))
    changed = {host: {one.path for one in {*after[host].files} ^ {*before[host].files}} for host in before}
    assert changed == {"desk": set(), "pi-1": of_device("epuck3"), "pi-2": of_device("epuck7"), "pi-3": set()}


def of_device(robot: str) -> set[str]:
    """The files with its MAC, whether it is paired by a PIN, and its calibration."""
    units = {f"units/swarm-lab.{robot}.{unit}.service" for unit in ("pair", "rfcomm")}
    return {
        *units,
        "units/swarm-lab.target",
        "bin/bluetooth-pair",
        f"params/{robot}.yaml",
        f"urdf/{robot}.urdf",
    }


@pytest.mark.parametrize("kind", KINDS)
def test_twice_is_as_before(kind: str, tmp_path: Path) -> None:
    robots, links, moved = KINDS[kind]
    names = ("a-1", "a-3") if "a-[1-3]" in robots else ("a", "b")
    text = f"{HEAD}robots:\n{robots}links:\n{WLAN}{links}"
    file = spec_at(tmp_path, text)
    document, found = load_checked(file)
    assert document is not None, found
    assert set(swap(document, *names).moved) == moved
    once = swapped(file, *names)
    assert once != text
    spec_at(tmp_path, once)
    spec_at(tmp_path, swapped(file, *reversed(names)))
    again, _ = load_checked(file)
    assert again is not None
    assert again.spec == document.spec


def test_a_dongle_stays_with_its_host(tmp_path: Path) -> None:
    robots, links, _ = KINDS["radio addresses"]
    once = swapped(spec_at(tmp_path, f"{HEAD}robots:\n{robots}links:\n{WLAN}{links}"), "a", "b")
    assert 'robot: a, uri: "radio://0/90/2M/E7E7E7E702"' in once
    assert 'robot: b, uri: "radio://1/80/2M/E7E7E7E701"' in once


@pytest.mark.parametrize(
    ("names", "words"),
    {
        ("epuck3", "k3"): "`epuck3` is of type `epuck`, and `k3` of type `khepera3`",
        ("epuck3", "epuck3"): "`epuck3` is to be exchanged with itself",
        ("epuk3", "epuck7"): "there is no robot `epuk3`",
    }.items(),
)
def test_robots_that_cannot_take_each_others_place(
    names: tuple[str, str], words: str, tmp_path: Path
) -> None:
    with pytest.raises(SwapError, match=re.escape(words)):
        swapped(spec_at(tmp_path, SPEC), *names)


def test_several_keys_that_move_out_of_one_line_are_an_error(tmp_path: Path) -> None:
    plain = "kind: bluetooth, host: pi-2, robot: epuck7,"
    spec = SPEC.replace("    pin: {secret: pin-3}\n", "").replace(
        plain, f"{plain} pin: {{secret: p}}, channel: 2,"
    )
    at_the_end = re.sub(r'(pin: .*, channel: 2), (mac: ".*")}', r"\2, \1}", spec)
    with pytest.raises(SwapError, match="cannot be exchanged in one line"):
        swapped(spec_at(tmp_path, at_the_end), "epuck3", "epuck7")


def test_a_fleet_in_several_files_changes_in_each_of_them() -> None:
    document, found = load_checked(ROOT / "examples/lab-fleet/swarm.yaml")
    assert document is not None, found
    made = swap(document, "rover-1", "rover-2")
    texts = {Path(file).name: [edit.text for edit in edits] for file, edits in made.edits.items()}
    assert texts == {
        "links.yaml": ['"rover-pi-[2,1,3-6]"', '"7583030393435[02,01,03-06]"'],
        "robots.yaml": ['"rover-pi-[2,1,3-6]"'],
    }


def test_the_verb_shows_the_edit_or_writes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = spec_at(tmp_path, SPEC)
    monkeypatch.chdir(tmp_path)
    assert run(["swap", "epuck3", "--with", "epuck7"]) == 0
    assert '+    mac: "10:00:e8:c5:71:0a"     # printed below it\n' in capsys.readouterr().out
    assert file.read_text() == SPEC
    assert run(["swap", "epuck3", "--with", "epuck7", "--write"]) == 0
    assert file.read_text() == SWAPPED
    assert run(["swap", "epuck3", "--with", "k3"]) == 1
    assert "only robots of one type" in capsys.readouterr().err
    assert file.read_text() == SWAPPED
