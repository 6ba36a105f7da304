"""``plan`` and ``status`` of swarms of 1 to 200 hosts on terminals of 40 to 120 columns."""

from __future__ import annotations

import io
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from rich.cells import cell_len
from rich.console import Console
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.cli.next_command import completing
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.views import lab
from swarmctl.views.plan import PlanView
from swarmctl.views.status import status
from tests.health.swarm_values import nothing_deployed, with_unit
from tests.views import fleets

COUNTS, WIDTHS = (1, 12, 40, 200), (40, 80, 120)
FITS = pytest.mark.parametrize(("count", "width"), list(product(COUNTS, WIDTHS)))
AWAY = {f"tb-{n:03}": fleets.away(n) for n in (3, 4, 5, 9)}


def longest(text: str) -> int:
    return max(map(cell_len, text.splitlines()))


@FITS
@pytest.mark.parametrize("details", [False, True])
def test_no_line_of_a_status_is_wider_than_the_terminal(count: int, width: int, details: bool) -> None:
    some = {name: error for name, error in AWAY.items() if count > 1}
    text = status(fleets.seen(count, some), details=details, width=width).plain
    assert longest(text) <= width
    if not details:
        assert len(text.splitlines()) < 60


@FITS
@pytest.mark.parametrize("details", [False, True])
def test_no_line_of_a_plan_is_wider_than_the_terminal(count: int, width: int, details: bool) -> None:
    shown = fleets.planned(count, *(fleets.stuck(n) for n in (3, 4, 5, 9) if count > 1))
    text = PlanView(fleets.names(count), details=details, width=width).text(shown).plain
    assert longest(text) <= width
    if not details:
        assert len(text.splitlines()) < 30


def test_forty_equal_hosts_are_planned_as_one() -> None:
    text = PlanView(fleets.names(40)).text(fleets.planned(40)).plain
    assert text.splitlines() == [
        "plan: 320 files, 40 starts on 40 hosts",
        "",
        "tb-[001-040]  40 hosts like tb-001: 8 files, 1 unit",
        "  + create      8 files                        new, from robots.rover-001",
        "  ▶ start       swarm-fleet.rover-001.service  new",
    ]


def test_a_host_with_another_difference_is_planned_apart() -> None:
    other = fleets.host_plan(7, Step(Kind.RESTART, "swarm-fleet.rover-007.service", "params/a.yaml changes"))
    text = PlanView(fleets.names(12)).text(fleets.planned(12, other, fleets.stuck(2), fleets.stuck(3))).plain
    assert "tb-[001,004-006,008-012]  9 hosts like tb-001: 8 files, 1 unit\n" in text
    assert "tb-007  nothing -> 0000000000000007: 8 files, 2 units\n" in text
    assert "tb-[002-003]  unreachable: each (port 22): timed out\n" in text


def test_units_that_start_for_one_cause_are_ranges() -> None:
    units = [f"ep-{number}{part}.service" for number in (1, 2, 3) for part in (".pair", "")]
    steps = (*(Step(Kind.START, unit, "new") for unit in units), Step(Kind.START, "ep-4.service", "changes"))
    shown = fleets.planned(1, fleets.host_plan(1, *steps))
    lines = PlanView(fleets.names(1)).text(shown).plain.splitlines()
    starts = [line.split()[2:] for line in lines if "▶" in line]
    assert starts == [
        ["swarm-fleet.rover-001.service", "new"],
        ["ep-[1-3].pair.service", "new"],
        ["ep-[1-3].service", "new"],
        ["ep-4.service", "changes"],
    ]
    details = PlanView(fleets.names(1), details=True).text(shown).plain
    assert all(f"start       {unit} " in details for unit in units)


def test_details_show_every_host_and_every_file() -> None:
    text = PlanView(fleets.names(12), details=True).text(fleets.planned(12)).plain
    assert all(f"tb-{number:03}  nothing -> " in text for number in range(1, 13))
    assert text.count("+ create ") == 12 * len(fleets.CREATED)


def test_equal_healthy_hosts_share_a_row_with_their_extremes() -> None:
    lines = status(fleets.seen(40)).plain.splitlines()
    assert lines[0] == "fleet is healthy: 41 hosts, 40 robots"
    assert len(lines) == 5 + 1
    row, robot = lines[-2:]
    assert row.split()[:2] == ["tb-[001-040]", "ok"]
    assert "1.1-5.0 ms" in row
    assert robot.split()[:3] == ["rover-[001-040]", "ok", "running"]
    assert "odom 10.0-10.4" in robot
    assert "/dev/swarm/rover-[001-040]" in robot


def test_equal_causes_name_all_of_their_hosts() -> None:
    text = status(fleets.seen(40, AWAY)).plain
    assert text.startswith("fleet is unhealthy: 4 causes, 4 symptoms; 41 hosts, 40 robots\n")
    assert "✗ host tb-[003-005,009]: no answer from 10.1.0.[3-5,9]\n    help: is it switched on?\n" in text
    assert "? robot rover-[003-005,009]: its host could not be probed\n" in text


def test_units_of_equal_causes_are_one_sentence() -> None:
    well = fleets.answers(12)
    failed = {
        f"tb-{n:03}": with_unit(
            f"swarm-fleet.rover-{n:03}.service", active="failed", sub="failed", result="exit-code"
        )(well[f"tb-{n:03}"])
        for n in (1, 2)
    }
    text = status(fleets.seen(12, failed)).plain
    assert "swarm-fleet.rover-[001-002].service on tb-[001-002]: " in text
    assert "help: on tb-001: sudo journalctl -u swarm-fleet.rover-001.service -n 50\n" in text


def test_a_list_too_long_for_a_sentence_follows_it() -> None:
    away = {f"tb-{n:03}": replace(fleets.away(n), message=f"tb-{n:03} is off") for n in range(1, 40, 2)}
    text = status(fleets.seen(40, away)).plain
    odd = ",".join(f"{n:03}" for n in range(1, 40, 2))
    assert f"✗ host tb-[{odd}]: each is off\n" in text


def test_an_unhealthy_host_never_shares_a_row_with_healthy_ones() -> None:
    text = status(fleets.seen(12, {"tb-005": AWAY["tb-005"]})).plain
    assert "tb-[001-004,006-012]" in text
    assert "tb-005 " in text


def test_details_show_a_row_for_every_host() -> None:
    text = status(fleets.seen(40, AWAY), details=True).plain
    assert all(f"\ntb-{number:03} " in text for number in range(1, 41))
    assert text.count("✗ host tb-") == 4


def test_hosts_without_a_release_are_one_cause_in_front() -> None:
    bare = {name: nothing_deployed(one) for name, one in fleets.answers(40).items()}
    complete = completing(SpecFiles((Path("fleet.yaml"),)), ["--lab"])
    lines = status(fleets.seen(40, bare | AWAY), complete=complete).plain.splitlines()
    assert lines[2:5] == [
        "✗ release desk, tb-[001-002,006-008,010-040]: nothing is deployed",
        "    help: run swarmctl deploy fleet.yaml --lab",
        "    183 symptoms of that: --details lists them",
    ]
    assert [line for line in lines if line.split() == ["37", "hosts", "like", "desk", "bad", "none"]]
    assert not [line for line in lines if "rover-001" in line]


def test_symptoms_on_hosts_with_a_release_stay_shown() -> None:
    answers = fleets.answers(3)
    unheard = answers["tb-001"]._replace(master=answers["tb-001"].master._replace(reachable=False))
    bare = {name: nothing_deployed(answers[name]) for name in ("desk", "tb-002")}
    text = status(fleets.seen(3, bare | {"tb-001": unheard})).plain
    assert "nothing is deployed\n" in text
    assert "✗ master tb-001: http://10.1.0.250:11311 does not answer" in text
    assert "\n  rover-001 " in text


def test_equal_hosts_of_a_lab_share_a_row() -> None:
    booted = [
        {"name": f"tb-{n:02}", "state": "running", "address": f"10.1.0.{n}", "user": "robot", "boots": 1}
        for n in range(1, 13)
    ]
    networks = [{"name": "wlan", "hosts": {host["name"]: host["name"] != "tb-05" for host in booted}}]
    screen = io.StringIO()
    Console(file=screen, width=120).print(lab.hosts({"hosts": booted, "networks": networks}))
    rows = [line.split() for line in screen.getvalue().splitlines()[1:]]
    assert rows == [
        ["tb-[01-04,06-12]", "running", "10.1.0.[1-4,6-12]", "robot", "1", "wlan"],
        ["tb-05", "running", "10.1.0.5", "robot", "1", "wlan", "(cut)"],
    ]
