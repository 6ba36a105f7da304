"""Budgets are arithmetic on facts: each number here was worked out by hand from a manual or a source file."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.checks.check import check
from swarmctl.spec.boards import boards
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.edits import apply
from swarmctl.spec.load import load_text
from swarmctl.spec.messages import known_types, size_of
from swarmctl.spec.model import Program
from swarmctl.spec.tuning import rates_of
from swarmctl.topology.boards import board_budgets, program_budget
from swarmctl.topology.budgets import budgets_of
from swarmctl.topology.capacity import host_budgets, network_budgets, on_the_wire
from swarmctl.topology.interfaces import program_endpoints
from swarmctl.topology.lines import Exchange, Load, line_budgets, load_of
from swarmctl.topology.modes import islands_of
from swarmctl.topology.radios import MOST, STABLE, RadioBudget, spread

TYPES = load_catalog().types
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
def test_a_text_or_a_list_may_have_any_size(type_name: str) -> None:
    found = size_of(type_name)
    assert found is not None
    assert found.open


def test_every_type_of_the_catalog_has_a_size() -> None:
    assert all(size_of(name) is not None for name in known_types())
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


def test_the_koalas_longest_reply_takes_as_long_as_its_manual_says() -> None:
    """85 bytes with two stop bits: 96 ms at 9600 baud, 24 ms at 38400."""
    for baud, seconds in ((9600, 0.0974), (38400, 0.0243)):
        load = load_of(TYPES["koala"], "uart", baud, 10.0, alone("koala", DEFAULT))
        assert load.exchanges[2].bytes / load.available == pytest.approx(seconds, rel=0.01)


def koala(baud: int, kind: str = "usb", odom: float = 10.0, proximity: float = 5.0) -> Load:
    return load_of(TYPES["koala"], kind, baud, 10.0, alone("koala", {"odom": odom, "proximity": proximity}))


def test_an_ftdi_adapter_bounds_the_requests_whatever_the_baud_rate() -> None:
    fast, faster = koala(115200, odom=50.0), koala(4_000_000, odom=50.0)
    assert fast.share > 1 > fast.least_share
    assert faster.share > 1


@given(st.floats(0.5, 50), st.floats(0.5, 50), st.sampled_from([9600, 38400, 115200]))
def test_the_rates_that_are_said_to_fit_do_fit(odom: float, proximity: float, baud: int) -> None:
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
def test_robots_are_spread_with_the_fewest_moves(counts: list[int], most: int) -> None:
    adapters = [f"hci{number}" for number in range(len(counts))]
    budgets = [
        RadioBudget("pi", adapter, tuple(f"{adapter}-{one}" for one in range(count)), (), 0.0)
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
    assert len(moves) == sum(max(0, count - most) for count in counts)  # nobody can do with fewer


ROVER = (Path(__file__).parents[2] / "examples/arduino-rover/swarm.yaml").read_text("utf-8")


def program(**fields: object) -> Program:
    return Program.model_validate({"host": "pi", "board": "arduino-uno", **fields})


def test_a_board_sends_what_fits_beside_the_frame_and_receives_what_fits_alone() -> None:
    budget = program_budget(
        "wheels",
        program(
            publishes=({"topic": "a", "type": "std_msgs/Int32", "rate": 100.0},),
            subscribes=({"topic": "cmd_vel", "type": "geometry_msgs/Twist", "rate": 10.0},),
        ),
    )
    sent, received = budget.topics
    assert (budget.room(sent), budget.room(received)) == (272, 280)
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


def test_a_robots_sketch_is_counted_like_a_programs() -> None:
    document, found = load_text(ROVER, "swarm.yaml", load_catalog())
    assert document is not None, found
    [budget] = board_budgets(document.spec, document.types)
    assert (budget.kind, budget.owner, budget.name, budget.baud) == ("robot", "rover", "arduino-uno", 57600)
    assert (budget.published, budget.subscribed, budget.needed) == (2, 1, 2 * 10 * (4 + 8))
    assert not list(line_budgets(document.spec, document.types, ()))  # nobody asks a sketch


def test_every_board_has_room_for_a_twist() -> None:
    assert all(board.receives >= 48 and board.sends >= 48 + 8 for board in boards().values())


@pytest.mark.parametrize(("size", "wire"), [(48, 118), (1444, 1514), (1445, 1581), (921600, 963646)])
def test_bytes_on_the_wire(size: int, wire: int) -> None:
    assert on_the_wire(size) == wire


def test_a_host_bears_its_system_its_masters_its_drivers_and_what_programs_say() -> None:
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
    islands = islands_of(document.spec)
    [budget] = host_budgets(document.spec, document.computers, islands, ())  # nothing is known of b
    assert dict(budget.parts) == {"system": 200, "master": 100, "multimaster": 120, "1 driver": 60, "map": 30}
    assert (budget.needed_mb, budget.served, budget.small) == (510, 3, True)


def test_what_crosses_by_name_loads_the_network_and_the_hub_that_hears_it() -> None:
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
    counted = budgets_of(document)
    [network] = counted.networks
    assert [(one.topic, one.origin, one.to) for one in network.flows] == [("/k/odom", "a", "b")]
    assert [one.host for one in counted.hosts if "multimaster" in dict(one.parts)] == ["b"]


def test_what_is_heard_where_it_is_made_crosses_no_network() -> None:
    text = (BROKEN / "camera-over-wlan.yaml").read_text("utf-8")
    for host, crossing in (("laptop", 963646 * 30), ("pi", 0)):
        written = text.replace("  watch:\n    host: laptop", f"  watch:\n    host: {host}")
        document, found = load_text(written, "watch.yaml", load_catalog())
        assert document is not None, found
        endpoints = tuple(program_endpoints(document.spec))
        [budget] = network_budgets(document.spec, document.types, endpoints, islands_of(document.spec))
        assert sum(flow.bytes_per_second for flow in budget.flows) == crossing


BROKEN = Path(__file__).parents[1] / "spec/broken"
DOUBTFUL = Path(__file__).parents[1] / "spec/doubtful"


@pytest.mark.parametrize(
    ("spec", "code"),
    [
        (BROKEN / "line-too-slow.yaml", "LINE001"),
        (BROKEN / "radio-eight-robots-two-adapters.yaml", "RADIO001"),
        (BROKEN / "board-baud-typo.yaml", "BOARD009"),
        (DOUBTFUL / "line-almost-full.yaml", "LINE002"),
        (DOUBTFUL / "images-fill-line.yaml", "LINE002"),
        (DOUBTFUL / "radio-five-robots.yaml", "RADIO002"),
        (DOUBTFUL / "baud-odd.yaml", "LINE004"),
    ],
)
def test_the_mend_that_is_offered_mends(spec: Path, code: str) -> None:
    text = spec.read_text("utf-8")
    [finding] = [one for one in found_in(text) if one.code == code]
    assert finding.fix is not None
    assert code not in {one.code for one in found_in(apply(text, finding.fix.edits))}


@pytest.mark.parametrize(("vendor", "kind", "warned"), [("0403", "usb-ftdi", False), ("10c4", "usb", True)])
def test_an_adapter_of_ftdi_has_the_timer_that_a_deploy_sets(vendor: str, kind: str, warned: bool) -> None:
    text = (DOUBTFUL / "line-almost-full.yaml").read_text("utf-8")
    said = text.replace("serial: A600dXyz", f'serial: A600dXyz, vendor: "{vendor}"')
    assert ("LINE002" in {one.code for one in found_in(said)}) is warned
    document, _ = load_text(said, "swarm.yaml", load_catalog())
    assert document is not None
    [budget] = budgets_of(document).lines
    assert (budget.load.kind, budget.load.seconds(Exchange("odom", 1.0, 0, 0))) == (
        kind,
        0.016 if warned else 0.002,
    )


def found_in(text: str) -> tuple:
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    return check(document)


def test_defaults_fit_every_robot_of_the_catalog_on_every_line_it_has() -> None:
    for name, robot_type in TYPES.items():
        for kind in robot_type.link.kinds if robot_type.asked else ():
            line = "usb" if kind == "serial" else kind
            rates = rates_of(robot_type, robot_type.settings)
            assert load_of(robot_type, line, robot_type.link.baud, 10.0, rates).share < 0.7, (name, kind)
