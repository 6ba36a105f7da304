"""What somebody edited on a host comes home into the spec, exactly or not at all."""

from __future__ import annotations

import difflib
import shutil
from pathlib import Path

import pytest

from swarmctl.adoption.adopt import ContradictionError, adopt
from swarmctl.adoption.changes import EditedFile
from swarmctl.render.rendered_values import same_meaning
from tests import ROOT
from tests.adoption.adopting import adopted, edited, reader, rendered

LEADER = ROOT / "examples/paper-2-leader/swarm.yaml"
FLEET = ROOT / "examples/lab-fleet/swarm.yaml"


def changed_lines(spec: Path, texts: dict[str, str]) -> list[str]:
    """The lines that the new texts have in place of others."""
    lines: list[str] = []
    for file, text in texts.items():
        before = Path(file).read_text().splitlines() if Path(file).exists() else []
        lines += [
            line[1:].strip()
            for line in difflib.unified_diff(before, text.splitlines(), n=0)
            if line.startswith("+") and not line.startswith("+++")
        ]
    return lines


@pytest.mark.parametrize(
    ("spec", "file", "old", "new", "line"),
    [
        pytest.param(
            LEADER, "k3-pi:params/k3.yaml", "command_timeout: 0.5", "command_timeout: 0.4  # carpet",
            "k3: {type: khepera3, host: k3-pi, settings: {command_timeout: 0.4}}",
            id="a setting of a robot, with a comment",
        ),
        pytest.param(
            LEADER, "k3-pi:params/k3.yaml", "diagnostics_rate: 1.0", "diagnostics_rate: 2",
            "k3: {type: khepera3, host: k3-pi, settings: {rates: {diagnostics: 2}}}",
            id="a rate",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/rtabmap.yaml", "subscribe_depth: true", "subscribe_depth: false",
            "params: {frame_id: koala/base_link, subscribe_depth: false}",
            id="a parameter of a program",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/rtabmap.yaml", "true}", "true, map_size: [4, 5]}",
            "params: {frame_id: koala/base_link, subscribe_depth: true, map_size: [4, 5]}",
            id="a parameter that is new",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/rtabmap.yaml", ", subscribe_depth: true", "",
            "params: {frame_id: koala/base_link}",
            id="a parameter that is gone",
        ),
        pytest.param(
            LEADER, "koala-laptop:udev/90-swarm.rules", "A600dXyz", "A601dXyz",
            "- {kind: serial, host: koala-laptop, robot: koala, usb: {serial: A601dXyz}, baud: 115200}",
            id="the serial number of an adapter in a udev rule",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/koala.yaml", "baud: 115200", "baud: 38400",
            "- {kind: serial, host: koala-laptop, robot: koala, usb: {serial: A600dXyz}, baud: 38400}",
            id="the baud rate of a link",
        ),
        pytest.param(
            FLEET, "desk:hosts/block", "192.168.77.171 uav-pi", "192.168.77.172 uav-pi",
            "uav-pi: {address: 192.168.77.172, computer: raspberry-pi-4b}"
            "                    # on the UAV, beside its autopilot",
            id="an address in /etc/hosts",
        ),
        pytest.param(
            FLEET, "desk:params/cart.yaml", "speed_units_per_mps: 1000.0", "speed_units_per_mps: 990.0",
            "- {speed_units_per_mps: 990.0, metres_per_count: 0.0005}"
            "   # speeds in mm/s, counters of half a millimetre",
            id="a value of a robot type beside the spec",
        ),
        pytest.param(
            FLEET, "desk:packages/fleet_moves/scripts/circle.py", "import rospy", "import  rospy",
            "import  rospy",
            id="a delivered program",
        ),
    ],
)  # fmt: skip
def test_an_edit_becomes_the_smallest_edit_of_the_spec(
    spec: Path, file: str, old: str, new: str, line: str
) -> None:
    host, _, path = file.partition(":")
    found = adopted(spec, host, path, (old, new))
    assert found.refused == ()
    assert {f"{one.host}:{one.path}" for one in found.adopted} == {file}
    assert changed_lines(spec, dict(found.texts)) == [line]


@pytest.mark.parametrize(
    ("spec", "file", "old", "new", "reason"),
    [
        pytest.param(
            LEADER, "koala-laptop:env/ros.env", "11311", "11312",
            "it follows from several values of the spec", id="the URI of the master",
        ),
        pytest.param(
            LEADER, "k3-pi:env/ros.env", "SWARM=", "ROS_DEBUG=1\nSWARM=",
            "it follows from several values of the spec", id="a new variable",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/koala.yaml", "title: K-Team Koala", "title: Bear",
            "it may come from the type `koala`, which swarmctl ships", id="a value of a shipped type",
        ),
        pytest.param(
            LEADER, "koala-laptop:params/koala.yaml", "wheel_separation: 0.29", "wheel_separation: 0.3",
            "makes it, and would change kinematics.angular_max too", id="one of which another one follows",
        ),
        pytest.param(
            LEADER, "k3-pi:params/k3.yaml", "command_timeout: 0.5", "command_timeout: 5000",
            "is not valid", id="a value that no spec may have",
        ),
        pytest.param(
            LEADER, "koala-laptop:bin/ros-client", "env python3", "env python3 -I",
            "it is swarmctl's own, and the spec does not decide it", id="a script of swarmctl",
        ),
        pytest.param(
            LEADER, "k3-pi:launch/k3.launch", "</launch>", "<!-- mine -->\n</launch>",
            "lines were added or removed", id="a new line of a launch file",
        ),
        pytest.param(
            LEADER, "k3-pi:params/k3.yaml", "command_timeout: 0.5", "command_timeout: [0.5",
            "it cannot be read any more", id="no YAML any more",
        ),
        pytest.param(
            FLEET, "tb3-07:params/tb3-07.gate.yaml", "linear_max: 0.15", "linear_max: 0.1",
            "is written for several entries at once", id="one of a range",
        ),
    ],
)  # fmt: skip
def test_what_the_spec_cannot_say_alone_stays_with_the_reason(
    spec: Path, file: str, old: str, new: str, reason: str
) -> None:
    host, _, path = file.partition(":")
    found = adopted(spec, host, path, (old, new))
    assert (found.texts, found.adopted) == ({}, ())
    assert reason in found.refused[0].reason, found.refused


@pytest.mark.parametrize("before", ["", "# night shift\nrobots:\n  tb3-08: {optional: true}\n"])
def test_an_overlay_takes_the_edit_of_one_robot_of_a_range(before: str) -> None:
    into = str(FLEET.with_name("night.yaml"))
    found = adopted(
        FLEET, "tb3-07", "params/tb3-07.gate.yaml", ("linear_max: 0.15", "linear_max: 0.1"),
        into=into, text=before,
    )  # fmt: skip
    assert found.refused == ()
    assert list(found.texts) == [into]
    assert found.texts[into].startswith(before)
    assert found.texts[into][len(before) :].strip() == (
        "tb3-07: {settings: {limits: {linear: 0.1}}}"
        if before
        else "robots:\n  tb3-07: {settings: {limits: {linear: 0.1}}}"
    )


def test_an_edit_of_all_robots_of_a_range_changes_their_one_entry() -> None:
    read = reader(FLEET)
    hosts = rendered(read)
    range_of = [name for name in hosts if name.startswith("tb3-")]

    def slowed(limits: dict[str, str]) -> list[EditedFile]:
        return [
            edited(hosts, one, f"params/{one}.gate.yaml", ("linear_max: 0.15", f"linear_max: {limit}"))
            for one, limit in limits.items()
        ]

    found = adopt(read, slowed(dict.fromkeys(range_of, "0.1")))
    assert found.refused == ()
    assert len(found.adopted) == len(range_of) > 1
    (line,) = changed_lines(FLEET, dict(found.texts))
    assert "linear: 0.1" in line

    for some in (dict.fromkeys(range_of[1:], "0.1"), {**dict.fromkeys(range_of, "0.1"), range_of[1]: "0.12"}):
        found = adopt(read, slowed(some))
        assert (found.texts, found.adopted) == ({}, ())
        assert "not all of them were edited so" in found.refused[0].reason


def test_an_overlay_takes_the_edit_of_a_link() -> None:
    into = str(LEADER.with_name("night.yaml"))
    found = adopted(LEADER, "koala-laptop", "udev/90-swarm.rules", ("A600dXyz", "A601dXyz"), into=into)
    assert found.refused == ()
    assert found.texts[into] == "links:\n  - {robot: koala, usb: {serial: A601dXyz}}\n"


def test_equal_edits_of_two_hosts_are_one_and_others_name_both() -> None:
    read = reader(FLEET)
    hosts = rendered(read)

    def by(host: str, address: str) -> EditedFile:
        return edited(hosts, host, "hosts/block", ("192.168.77.171", address), place="/etc/hosts")

    found = adopt(read, [by("desk", "192.168.77.181"), by("tb3-01", "192.168.77.181")])
    assert (len(found.adopted), found.refused) == (2, ())
    with pytest.raises(ContradictionError, match=r"desk and tb3-01 have different edits of one value"):
        adopt(read, [by("desk", "192.168.77.181"), by("tb3-01", "192.168.77.182")])


def test_only_what_can_be_brought_home_is(tmp_path: Path) -> None:
    found = adopted(
        LEADER, "k3-pi", "params/k3.yaml", ("command_timeout: 0.5", "command_timeout: 0.4"),
        ("bytesize: 8", "bytesize: 7"),
    )  # fmt: skip
    assert [one.what for one in found.adopted] == ["command_timeout: 0.5 -> 0.4"]
    assert [one.what for one in found.refused] == ["serial.bytesize: 8 -> 7"]


def test_an_edit_of_what_the_spec_has_changed_since_stays() -> None:
    read = reader(LEADER)
    file = edited(rendered(read), "k3-pi", "params/k3.yaml", ("timeout: 0.5", "timeout: 0.4"))
    found = adopt(read, [EditedFile(file.host, file.path, file.place, file.text, "0" * 64)])
    assert found.texts == {}
    assert found.refused[0].reason == "the spec has changed the file, too, since it was deployed"


@pytest.mark.parametrize(
    "text",
    [
        None,
        "",
        "\0\x1b[2J",
        "a: &a [x, x, x, x]\nb: &b [*a, *a, *a, *a]\n" + "c: [*b, *b, *b, *b]\n" * 3,
        "[" * 5000,
        "command_timeout: !!python/object/apply:os.system [true]\n",
        "command_timeout: 2026-01-01\n",
        "? {a: b}\n: c\n",
        "command_timeout: .nan\n",
        "../../x: 1\n" * 3,
    ],
)
def test_a_hostile_answer_changes_nothing(text: str | None) -> None:
    read = reader(LEADER)
    file = edited(rendered(read), "k3-pi", "params/k3.yaml")
    found = adopt(read, [EditedFile("k3-pi", file.path, file.path, text, file.deployed)])
    assert found.texts == {}
    assert found.refused
    outside = EditedFile("k3-pi", "../../etc/passwd", "../../etc/passwd", "x", "")
    assert adopt(read, [outside]).texts == {}


def test_a_file_beside_the_spec_gets_the_text_of_the_host(tmp_path: Path) -> None:
    shutil.copytree(FLEET.parent, tmp_path / "fleet")
    spec = tmp_path / "fleet/swarm.yaml"
    found = adopted(spec, "desk", "urdf/cart.urdf", ("</robot>", "  <!-- a hook -->\n</robot>"))
    urdf = tmp_path / "fleet/urdf/cart.urdf"
    assert found.texts == {str(urdf): urdf.read_text().replace("</robot>", "  <!-- a hook -->\n</robot>")}


def test_meaning_is_values_not_layout() -> None:
    assert same_meaning("params/a.yaml", "{a: 1, b: [x]}", "b:\n- x\na: 1.0  # one\n")
    assert not same_meaning("params/a.yaml", "a: 1", "a: true")
    assert not same_meaning("params/a.yaml", "a: 'on'", "a: on")
    assert same_meaning("env/ros.env", 'A="1"\n', "# mine\nA=1\n")
    assert same_meaning("hosts/block", "10.0.0.1 a\n", "10.0.0.1\ta  # mine\n")
    assert not same_meaning("launch/a.launch", "<a/>", "<a />")
