"""``swarmctl mode infer`` and ``mode convert``, as people type them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from tests import ROOT

MODES = ROOT / "tests/mode_conversion/modes"


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    place = tmp_path / "swarm.yaml"
    place.write_bytes((MODES / "leader.yaml").read_bytes())
    return Path("swarm.yaml")


def test_it_says_what_the_wiring_is_and_why(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "infer", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().out.splitlines() == [
        "the mode is leader",
        "  one master, on `koala-laptop`; robots or programs are also on `epuck-pi`, `k3-pi`",
        "  `koala-laptop` alone commands the robots of other hosts: `epuck`, `k3`",
    ]


def test_a_wiring_that_is_not_what_it_says(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (
        (MODES / "single-minded.yaml")
        .read_text("utf-8")
        .replace("type: koala", "type: koala, host: koala-laptop")
    )
    text = text.replace("type: khepera3", "type: khepera3, host: koala-laptop")
    text = text.replace("    type: epuck", "    type: epuck\n    host: koala-laptop")
    spec.write_text(text.replace("mode: single-minded\nleader:", "mode: central\nhub:"), "utf-8")
    assert run(["mode", "infer", str(spec)]) == exit_codes.ERROR
    out = capsys.readouterr().out
    assert out.startswith("the mode is single-minded, but central is declared\n")
    assert "-  k3: {type: khepera3, host: koala-laptop}\n" in out
    assert "+  k3: {type: khepera3, host: k3-pi}\n" in out
    assert run(["mode", "infer", str(spec), "--json"]) == exit_codes.ERROR
    report = json.loads(capsys.readouterr().out)
    assert (report["mode"], report["declared"], report["hub"]) == ("single-minded", "central", "koala-laptop")


def test_all_hosts_and_robots_are_named(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = spec.read_text("utf-8")
    more = "".join(f"  pi-{n}: {{address: 192.168.77.2{n}}}\n" for n in range(5))
    robots = "".join(f"  r{n}: {{type: khepera3, host: pi-{n}}}\n" for n in range(5))
    lines = "".join(
        f"  - {{kind: serial, host: pi-{n}, robot: r{n}, usb: {{serial: S{n}}}}}\n" for n in range(5)
    )
    text = text.replace("hosts:\n", f"hosts:\n{more}", 1).replace("robots:\n", f"robots:\n{robots}", 1)
    text = text.replace("epuck-pi], multicast: true}\n", f"epuck-pi, 'pi-[0-4]'], multicast: true}}\n{lines}")
    spec.write_text(text.replace("epuck]}", "epuck, 'r[0-4]']}"), "utf-8")
    run(["mode", "infer", str(spec)])
    out = capsys.readouterr().out
    assert "`pi-[0-4]`" in out
    assert "`r[0-4]`" in out


def test_the_edit_is_shown_and_nothing_written(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = spec.read_bytes()
    assert run(["mode", "convert", str(spec), "--to", "single-minded"]) == exit_codes.OK
    printed = capsys.readouterr()
    assert "-mode: leader\n+mode: single-minded\n" in printed.out
    assert "by hand: plug the line of `k3` into `koala-laptop` instead of `k3-pi`" in printed.err
    assert spec.read_bytes() == before


@pytest.mark.parametrize("to", ["single-minded", "leader", "central", "standalone", "combined"])
def test_what_is_written_is_that_mode(spec: Path, to: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", to, "--write"]) == exit_codes.OK
    capsys.readouterr()
    assert run(["mode", "infer", str(spec)]) == exit_codes.OK
    assert capsys.readouterr().out.startswith(f"the mode is {to}\n")
    assert run(["validate", "-q", str(spec)]) == exit_codes.OK


def test_a_mode_that_does_not_exist(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--to", "centrall"]) == exit_codes.USAGE
    assert "did you mean `central`?" in capsys.readouterr().err


def test_a_commander_is_never_dropped(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for mode in ("central", "standalone", "combined"):
        assert run(["mode", "convert", str(spec), "--to", mode, "--write"]) == exit_codes.OK
        assert "- {by: koala-laptop, of: [koala, k3, epuck]}\n" in spec.read_text("utf-8")
    text = spec.read_text("utf-8").replace(
        "of: [koala, k3, epuck]}", "of: [koala, k3]}\n  - {by: k3-pi, of: [epuck]}"
    )
    spec.write_text(text, "utf-8")
    capsys.readouterr()
    for mode in ("leader", "single-minded"):
        assert run(["mode", "convert", str(spec), "--to", mode, "--write"]) == exit_codes.ERROR
        assert "take authority from others: {by: k3-pi, of: [epuck]}" in capsys.readouterr().err
    assert spec.read_text("utf-8") == text


def test_what_a_leader_commands_without_an_entry_becomes_one(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = spec.read_text("utf-8")
    spec.write_text(text[: text.index("control:")], "utf-8")
    assert run(["mode", "convert", str(spec), "--to", "central", "--write"]) == exit_codes.OK
    assert "new in `control`: `koala-laptop` commands `koala`, `k3`, `epuck`" in capsys.readouterr().err
    assert "control:\n  - {by: koala-laptop, of: [koala, k3, epuck]}\n" in spec.read_text("utf-8")


def test_an_include_survives_and_a_change_in_its_file_is_refused(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = spec.read_text("utf-8")
    control = text.index("\ncontrol:")
    Path("control.yaml").write_text(text[control:], "utf-8")
    spec.write_text(f"include: control.yaml\n{text[:control]}", "utf-8")
    assert run(["mode", "convert", str(spec), "--to", "central", "--write"]) == exit_codes.OK
    assert spec.read_text("utf-8").startswith("include: control.yaml\n")
    assert "hub: koala-laptop" in spec.read_text("utf-8")
    links, robots = text.index("\nlinks:"), text.index("\n# the robots")
    Path("robots.yaml").write_text(text[robots:links], "utf-8")
    whole = f"include: robots.yaml\n{text[:robots]}{text[links:]}"
    spec.write_text(whole, "utf-8")
    capsys.readouterr()
    assert run(["mode", "convert", str(spec), "--to", "single-minded", "--write"]) == exit_codes.ERROR
    assert "swarmctl spec --expanded" in capsys.readouterr().err
    assert spec.read_text("utf-8") == whole


def test_the_mode_is_inferred_where_no_edit_is_possible(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "version: 1\nname: alone\nmode: central\nhub: pc\nhosts: {pc: {address: 10.0.0.1}}\n"
    line = "links: [{kind: serial, host: pc, robot: koala, usb: {serial: A1}}]\n"
    spec.write_text(f"{text}robots: {{koala: {{type: koala, host: pc}}}}\n{line}", "utf-8")
    assert run(["mode", "infer", str(spec)]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert printed.out.startswith("the mode is single-minded, but central is declared\n")
    assert "no edit makes it central: mode `central` needs a second computer" in printed.err
    assert run(["mode", "infer", str(spec), "--json"]) == exit_codes.ERROR
    assert json.loads(capsys.readouterr().out)["edit"] == ""


ROS_1 = """\
version: 1
name: lab
mode: leader
leader: big
ros: {distro: noetic, master_port: 11411, naming: hosts}   # stays
hosts:
  big: {address: 192.168.77.10, master_port: 11500}
  pi: {address: 192.168.77.11}
robots: {k3: {type: khepera3, host: pi}}
links:
  - {kind: ethernet, name: lab, hosts: [big, pi]}
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
programs: {joystick: {host: big, use: teleop-joy, params: {device: /dev/input/js0}}}
control: [{by: joystick, of: [k3]}]
"""


def test_a_spec_for_ros_2_differs_in_what_ros_2_does_not_read(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec.write_text(ROS_1, "utf-8")
    assert run(["mode", "convert", str(spec), "--ros", "jazzy", "--write"]) == exit_codes.OK
    assert "swarm.yaml: ROS jazzy, 4 changes" in capsys.readouterr().err
    changed = ROS_1.replace("{distro: noetic, master_port: 11411, naming: hosts}", "{distro: jazzy}")
    assert spec.read_text("utf-8") == changed.replace(", master_port: 11500", "")
    assert run(["validate", str(spec)]) == exit_codes.OK


def test_a_spec_without_ros_gets_the_distribution(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = ROS_1.replace(", master_port: 11500", "").splitlines(keepends=True)
    spec.write_text("".join(line for line in lines if not line.startswith("ros:")), "utf-8")
    assert run(["mode", "convert", str(spec), "--ros", "kilted"]) == exit_codes.OK
    assert "+  distro: kilted\n" in capsys.readouterr().out


def test_what_has_no_counterpart_in_ros_2_is_named(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`packages` are built by catkin: no edit makes them packages of ROS 2."""
    fleet = ROOT / "examples/lab-fleet/swarm.yaml"
    assert run(["mode", "convert", str(fleet), "--ros", "jazzy"]) == exit_codes.ERROR
    err = capsys.readouterr().err
    assert "cannot be converted to ROS jazzy automatically" in err
    assert "ROS003: package `fleet_moves` is not delivered" in err


@pytest.mark.parametrize("words", [[], ["--to", "leader", "--ros", "jazzy"]])
def test_a_conversion_has_one_aim(spec: Path, words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), *words]) == exit_codes.USAGE
    assert "by --to, or the new ROS by --ros" in capsys.readouterr().err


def test_an_unknown_distribution_gets_a_suggestion(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["mode", "convert", str(spec), "--ros", "jazy"]) == exit_codes.USAGE
    assert "did you mean `jazzy`?" in capsys.readouterr().err
