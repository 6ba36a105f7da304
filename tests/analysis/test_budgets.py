"""Budgets: each number here was computed by hand from a manual or a source file."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.analysis.budgets import budgets_of
from swarmctl.analysis.host_load import host_budgets
from swarmctl.analysis.network_load import network_budgets, on_the_wire
from swarmctl.analysis.radio_load import MOST, STABLE, BluetoothBudget, spread
from swarmctl.analysis.rosserial_load import program_budget, rosserial_budgets
from swarmctl.analysis.serial_load import Exchange, SerialLoad, load_of, serial_budgets
from swarmctl.linter.runner import lint
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.driver_params import rates_of
from swarmctl.robot_types.sketch_settings import boards, size_of
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from swarmctl.spec.program_model import Program
from swarmctl.swarm.index import SwarmIndex
from swarmctl.yamltext.edits import apply
from tests import ROOT
from tests.rules.specs import BROKEN, DOUBTFUL, spec

TYPES = with_protocol(load_catalog().types)
FIELDS = yaml.safe_load((ROOT / "templates/data/message_sizes.yaml").read_text("utf-8"))
DEFAULT = {"odom": 10.0, "proximity": 5.0}


def alone(type_name: str, rates: dict[str, float]) -> dict[str, float]:
    """These sensors on, all others off."""
    return {**dict.fromkeys(TYPES[type_name].sensors, 0.0), **rates}


@pytest.mark.parametrize(
    ("type_name", "size"),
    [
        ("geometry_msgs/Twist", 48),
        ("std_msgs/Int16", 2),
        ("std_msgs/Int32", 4),
        ("geometry_msgs/Vector3", 24),
        ("std_msgs/Header", 16 + 16),  # its frame's name counts as 16 characters
        ("sensor_msgs/Range", 33 + 16),
        ("nav_msgs/Odometry", 700 + 2 * 16),
        ("sensor_msgs/Imu", 312 + 16),
    ],
)
def test_sizes_of_messages_as_they_are_sent(type_name: str, size: int) -> None:
    found = size_of(type_name)
    assert found is not None
    assert (found.bytes, found.open) == (size, False)


@pytest.mark.parametrize("type_name", ["std_msgs/String", "std_msgs/Int32MultiArray", "sensor_msgs/Image"])
def test_a_string_or_a_list_has_no_fixed_size(type_name: str) -> None:
    found = size_of(type_name)
    assert found is not None
    assert found.open


def test_every_type_of_the_catalog_has_a_size() -> None:
    assert all(size_of(name) is not None for name in FIELDS)
    assert size_of("wheel_msgs/Ticks") is None


@pytest.mark.parametrize(
    ("robot", "exchanges"),
    [
        # D,-100,-100 LF and d CR LF; H LF and h,-2147483648,-2147483648 CR LF; N LF and n,1023 times 16 CR LF
        ("koala", {"cmd_vel": (12, 3), "odom": (2, 27), "proximity": (2, 83)}),
        # D,l-65179,l-65179 CR; N brings eleven readings, counted as 16 bits each, and a time stamp
        ("khepera3", {"cmd_vel": (18, 3), "odom": (2, 27), "proximity": (2, 91)}),
        # D,-1000,-1000 CR; counters of 16 bits; eight readings, and two more on the second serial line
        ("epuck", {"cmd_vel": (14, 3), "odom": (2, 17), "proximity": (2, 65)}),
    ],
)
def test_requests_and_replies_at_their_longest(robot: str, exchanges: dict[str, tuple[int, int]]) -> None:
    load = load_of(TYPES[robot], "usb", 115200, 10.0, alone(robot, DEFAULT))
    assert {one.name: (one.request, one.reply) for one in load.exchanges} == exchanges


def test_the_koalas_longest_reply_takes_the_time_of_its_manual() -> None:
    """85 bytes with two stop bits: 96 ms at 9600 baud, 24 ms at 38400."""
    for baud, seconds in ((9600, 0.0974), (38400, 0.0243)):
        load = load_of(TYPES["koala"], "uart", baud, 10.0, alone("koala", DEFAULT))
        assert load.exchanges[2].bytes / load.available == pytest.approx(seconds, rel=0.01)


def koala(baud: int, kind: str = "usb", odom: float = 10.0, proximity: float = 5.0) -> SerialLoad:
    return load_of(TYPES["koala"], kind, baud, 10.0, alone("koala", {"odom": odom, "proximity": proximity}))


def test_an_ftdi_adapter_limits_requests_at_any_baud_rate() -> None:
    fast, faster = koala(115200, odom=50.0), koala(4_000_000, odom=50.0)
    assert fast.share > 1 > fast.least_share
    assert faster.share > 1


@given(st.floats(0.5, 50), st.floats(0.5, 50), st.sampled_from([9600, 38400, 115200]))
def test_suggested_rates_fit(odom: float, proximity: float, baud: int) -> None:
    fitting = koala(baud, odom=odom, proximity=proximity).fitting()
    if fitting:
        rates = {"odom": odom, "proximity": proximity, **fitting}
        assert rates["odom"] <= odom
        assert rates["proximity"] <= proximity
        assert koala(baud, **rates).share <= 0.7 + 1e-9


@given(
    st.lists(st.integers(0, 12), min_size=1, max_size=4),
    st.sampled_from([STABLE, MOST]),
)
def test_robots_are_spread_over_adapters_with_fewest_moves(counts: list[int], most: int) -> None:
    adapters = [f"hci{number}" for number in range(len(counts))]
    budgets = [
        BluetoothBudget("pi", adapter, tuple(f"{adapter}-{one}" for one in range(count)), (), 0.0)
        for adapter, count in zip(adapters, counts, strict=True)
        if count
    ]
    moves = spread(budgets, adapters, most)
    if sum(counts) > most * len(counts):
        assert moves is None
        return
    assert moves is not None
    at = {robot: moves.get(robot, one.adapter) for one in budgets for robot in one.members}
    assert all(list(at.values()).count(adapter) <= most for adapter in adapters)
    assert len(moves) == sum(max(0, count - most) for count in counts)  # no solution has fewer


ROVER = (ROOT / "examples/arduino-rover/swarm.yaml").read_text("utf-8")


def program(**fields: object) -> Program:
    return Program.model_validate({"host": "pi", "board": "arduino-uno", **fields})


def test_message_limits_of_a_board_with_and_without_framing() -> None:
    budget = program_budget(
        "wheels",
        program(
            publishes=({"topic": "a", "type": "std_msgs/Int32", "rate": 100.0},),
            subscribes=({"topic": "cmd_vel", "type": "geometry_msgs/Twist", "rate": 10.0},),
        ),
    )
    sent, received = budget.topics
    assert (budget.largest_message(sent), budget.largest_message(received)) == (272, 280)
    assert budget.needed == 100 * (4 + 8)  # the busier direction alone: the line carries both at once
    assert budget.available == 5760
    # rosserial's own `pub info` of lwheel takes 78 bytes (research with the compiled client): 8 + 50 + 6 + 14
    assert (
        program_budget(
            "w",
            program(publishes=({"topic": "lwheel", "type": "std_msgs/Int32"},)),
        )
        .topics[0]
        .announcement
        == 0x46 + 8
    )


def test_a_robots_sketch_is_counted_like_a_programs_board() -> None:
    document, found = load_text(ROVER, "swarm.yaml", load_catalog())
    assert document is not None, found
    [budget] = rosserial_budgets(SwarmIndex(document))
    assert (budget.kind, budget.owner, budget.name, budget.baud) == ("robot", "rover", "arduino-uno", 57600)
    assert (budget.published, budget.subscribed, budget.needed) == (2, 1, 2 * 10 * (4 + 8))
    assert not list(serial_budgets(SwarmIndex(document)))  # a sketch is not polled


def test_every_board_can_send_and_receive_a_twist() -> None:
    assert all(board.receives >= 48 and board.sends >= 48 + 8 for board in boards().values())


@pytest.mark.parametrize(("size", "wire"), [(48, 118), (1444, 1514), (1445, 1581), (921600, 963646)])
def test_bytes_on_the_wire(size: int, wire: int) -> None:
    assert on_the_wire(size) == wire


def test_memory_of_system_master_drivers_and_programs() -> None:
    text = """
version: 1
name: two
mode: standalone
computers: {tiny: {cores: 1, memory_mb: 512}}
hosts:
  a: {address: 10.0.0.1, computer: tiny}
  b: {address: 10.0.0.2}
robots: {k: {type: koala, host: a}}
links:
  - {kind: ethernet, name: wire, hosts: [a, b]}
  - {kind: serial, host: a, robot: k, usb: {serial: A1}}
programs:
  map: {host: a, package: maps, executable: map, memory_mb: 30}
  plan: {robot: k, package: plans, executable: plan}
"""
    document, found = load_text(text, "two.yaml", load_catalog())
    assert document is not None, found
    [budget] = host_budgets(SwarmIndex(document), ())  # the computer of b is not declared
    assert dict(budget.parts) == {"system": 200, "master": 100, "multimaster": 120, "1 driver": 60, "map": 30}
    assert (budget.needed_mb, budget.served, budget.small) == (510, 3, True)


def test_a_gate_takes_memory_beside_the_driver_behind_it() -> None:
    text = """version: 1
name: gated
mode: single-minded
leader: a
hosts: {a: {address: 10.0.0.1, computer: raspberry-pi-3b}}
types:
  vendor:
    title: a vendor's robot
    driver: {package: vendor_driver, executable: node}
    kinematics: {kind: differential, linear_max: 0.2, angular_max: 2.0}
robots:
  k: {type: vendor, host: a}
  u: {type: vendor, host: a, driver: {package: v, executable: n, ungated: true, reason: its own mux}}
"""
    document, found = load_text(text, "gated.yaml", load_catalog())
    assert document is not None, found
    [budget] = host_budgets(SwarmIndex(document), ())
    assert dict(budget.parts) == {"system": 200, "master": 100, "2 drivers": 120, "1 gate": 40}
    assert budget.served == 3


def test_a_declared_bridge_loads_the_network_and_the_receiving_hub() -> None:
    text = """version: 1
name: three
mode: standalone
defaults: {host: {computer: laptop}}
hosts: {a: {address: 10.0.0.1}, b: {address: 10.0.0.2}, c: {address: 10.0.0.3}}
robots: {k: {type: koala, host: a, settings: {rates: {odom: 10.0}}}}
links:
  - {kind: wlan, name: air, hosts: [a, b, c]}
  - {kind: serial, host: a, robot: k, usb: {serial: A1}}
multimaster: {provider: static, topics: [{topic: /k/odom, to: [b]}]}
"""
    document, found = load_text(text, "three.yaml", load_catalog())
    assert document is not None, found
    counted = budgets_of(SwarmIndex(document))
    [network] = counted.networks
    assert [(one.topic, one.origin, one.to) for one in network.flows] == [("/k/odom", "a", "b")]
    assert [one.host for one in counted.hosts if "multimaster" in dict(one.parts)] == ["b"]


RECORDED = """version: 1
name: taped
mode: {mode}
{hub}
hosts: {{a: {{address: 10.0.0.1}}, b: {{address: 10.0.0.2}}, c: {{address: 10.0.0.3}}}}
robots: {{k: {{type: khepera3, host: a, settings: {{rates: {{odom: 10.0}}}}}}}}
links:
  - {{kind: wlan, name: air, hosts: [a, b, c]}}
  - {{kind: serial, host: a, robot: k, usb: {{serial: A1}}}}
control: [{{by: go, of: [k]}}]
programs:
  go: {{host: c, command: [python3, go.py]}}
  record: {{host: b, robot: k, {words}}}
"""


@pytest.mark.parametrize(
    ("words", "topics"),
    [
        ("command: [rosbag, record, -a, --split, --size=1024, -o, /home/robot/x]", None),
        ('command: [/usr/bin/rosbag, record, --size, "9", odom, -O/tmp/odom, /k/joint_states]',
         {"/k/odom", "/k/joint_states"}),
        ('command: [rosbag, record, -e, "/.*/od.*m", "/{robot}/cmd_vel"]', {"/k/odom", "/k/cmd_vel"}),
        ('command: [rosbag, record, -ax, "/k/(odom|joint.*|prox.*|infra.*|cmd_vel|batt.*)"]', {"/k/ground"}),
        ("package: rosbag, executable: record, args: [/k/odom]", {"/k/odom"}),
        ("package: rosbag, executable: play, args: [/k/odom]", set()),
        ('command: [rosbag, record, -e, "(/.*)*odom"]', set()),  # matching may take for ever: left out
        ('command: [rosbag, record, -e, "*("]', set()),
    ],
)  # fmt: skip
def test_a_recording_loads_the_network_with_what_it_selects(words: str, topics: set[str] | None) -> None:
    flows = recorded("central", "hub: a", words)
    assert all(size > 0 for size in flows.values())
    if topics is None:
        topics = {"/k/odom", "/k/joint_states", "/k/cmd_vel"}
        assert topics < set(flows)
        odom = 10 * on_the_wire(7 * 8 + 6 * 8 + 2 * 36 * 8 + 12 + 12 + len("k/odom") + len("k/base_link"))
        assert flows["/k/odom"] == pytest.approx(odom, rel=0.1)
    else:
        assert {one for one in flows if "ground/" not in one} == topics


def test_a_recording_has_what_reaches_its_island() -> None:
    words = "command: [rosbag, record, -a, -o, x]"
    assert recorded("standalone", "", words) == {}
    bridge = "multimaster: {provider: static, topics: [{topic: /k/odom, to: [b]}]}"
    assert set(recorded("standalone", bridge, words)) == {"/k/odom"}


def recorded(mode: str, more: str, words: str) -> dict[str, float]:
    """Bytes per second to the host of the recording, by topic."""
    document, found = load_text(RECORDED.format(mode=mode, hub=more, words=words), "x.yaml", load_catalog())
    assert document is not None, found
    [network] = network_budgets(SwarmIndex(document))
    return {flow.topic: flow.bytes_per_second for flow in network.flows if flow.to == "b"}


def test_a_topic_used_on_its_own_host_loads_no_network() -> None:
    text = (spec(BROKEN, "camera-over-wlan")).read_text("utf-8")
    for host, crossing in (("laptop", 963646 * 30), ("pi", 0)):
        written = text.replace("  watch:\n    host: laptop", f"  watch:\n    host: {host}")
        document, found = load_text(written, "watch.yaml", load_catalog())
        assert document is not None, found
        [budget] = network_budgets(SwarmIndex(document))
        assert sum(flow.bytes_per_second for flow in budget.flows) == crossing


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        (spec(BROKEN, "link-overloaded"), "LINE001"),
        (spec(BROKEN, "eight-robots-two-adapters"), "RADIO001"),
        (spec(BROKEN, "board-baud-typo"), "BOARD009"),
        (spec(DOUBTFUL, "link-almost-full"), "LINE002"),
        (spec(DOUBTFUL, "images-fill-link"), "LINE002"),
        (spec(DOUBTFUL, "five-robots"), "RADIO002"),
        (spec(BROKEN, "non-standard-baud"), "LINE004"),
    ],
)
def test_an_offered_fix_resolves_the_finding(spec: Path, code: str) -> None:
    text = spec.read_text("utf-8")
    [finding] = [one for one in found_in(text) if one.code == code]
    assert finding.fix is not None
    assert code not in {one.code for one in found_in(apply(text, finding.fix.edits))}


@pytest.mark.parametrize(("vendor", "kind", "warned"), [("0403", "usb-ftdi", False), ("10c4", "usb", True)])
def test_an_ftdi_adapter_has_the_latency_timer_that_udev_sets(vendor: str, kind: str, warned: bool) -> None:
    text = (spec(DOUBTFUL, "link-almost-full")).read_text("utf-8")
    changed = text.replace("serial: A600dXyz", f'serial: A600dXyz, vendor: "{vendor}"')
    assert ("LINE002" in {one.code for one in found_in(changed)}) is warned
    document, _ = load_text(changed, "swarm.yaml", load_catalog())
    assert document is not None
    [budget] = budgets_of(SwarmIndex(document)).lines
    assert (budget.load.kind, budget.load.seconds(Exchange("odom", 1.0, 0, 0))) == (
        kind,
        0.016 if warned else 0.002,
    )


def found_in(text: str) -> tuple:
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    return lint(document)


def test_default_rates_fit_every_line_of_every_catalog_robot() -> None:
    for name, robot_type in TYPES.items():
        for kind in robot_type.link.kinds if robot_type.driver_protocol else ():
            line = "usb" if kind == "serial" else kind
            rates = rates_of(robot_type, robot_type.settings)
            assert load_of(robot_type, line, robot_type.link.baud, 10.0, rates).share < 0.7, (name, kind)
