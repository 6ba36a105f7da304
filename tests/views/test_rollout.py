"""The report of a rollout: failures first, equal hosts as one, no line wider than the terminal."""

from __future__ import annotations

import io
from itertools import product

import pytest
from rich.cells import cell_len
from rich.console import Console
from swarm_onboard.agent.steps import Kind as StepKind
from swarm_onboard.agent.steps import Step

from swarmctl.deploy.outcome import Outcome, Result
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.parallel_hosts import Finished, Note, Started
from swarmctl.remote.transport import HostError, Kind
from swarmctl.views.equal_hosts import Names
from swarmctl.views.progress import Board, line
from swarmctl.views.rollout import RolloutView
from tests.views import fleets

UNIT = "swarm-fleet.rover-001.service"
AGAIN = "run the same command again when these hosts are reachable"


def away(number: int) -> HostError:
    return HostError(Kind.UNREACHABLE, f"tb-{number:03} (10.1.0.{number}, port 22): timed out", "is it on?")


def found(count: int, failed: tuple[int, ...] = ()) -> dict[str, Result]:
    deployed = {host.host: Outcome(host) for host in fleets.planned(count).hosts}
    return {**deployed, **{f"tb-{number:03}": away(number) for number in failed}}


def lines(results: dict[str, Result], *, details: bool = False, width: int | None = None) -> list[str]:
    view = RolloutView(fleets.names(len(results)), details=details, width=width)
    return view.text(results).plain.splitlines()


def test_failures_come_first_and_equal_hosts_are_one() -> None:
    assert lines(found(40, (3, 4, 5, 9))) == [
        "tb-[003-005,009]  unreachable: each (port 22): timed out",
        "  help: is it on?",
        f"tb-[001-002,006-008,010-040]  36 hosts like tb-001: deployed {1:016}, started {UNIT}",
        f"36 of 40 hosts changed; failed: tb-[003-005,009]; {AGAIN}",
    ]


def test_a_host_names_what_became_of_its_units() -> None:
    kinds = (StepKind.START, StepKind.RESTART, StepKind.RELOAD_UNIT, StepKind.STOP)
    steps = tuple(Step(kind, f"{number}.service", "") for number, kind in enumerate(kinds))
    assert lines({"tb-001": Outcome(HostPlan("tb-001", "a", "b", steps))})[0] == (
        "tb-001  deployed b, started 0.service; restarted 1.service; reloaded 2.service; stopped 3.service"
    )


def test_hosts_with_another_failure_are_not_hidden() -> None:
    results = found(12, (3, 4, 5))
    results["tb-007"] = HostError(Kind.REFUSED, "the disk of tb-007 is full")
    assert lines(results)[2] == "tb-007  refused: the disk of tb-007 is full"


def test_hosts_with_nothing_to_do_are_one_line() -> None:
    idle: dict[str, Result] = {f"tb-{n:03}": Outcome(HostPlan(f"tb-{n:03}", "a", "a")) for n in range(1, 41)}
    assert lines(idle) == ["tb-[001-040]  nothing to do", "0 of 40 hosts changed"]


def test_notes_are_written_once_with_their_hosts() -> None:
    noted: dict[str, Result] = {
        name: Outcome(HostPlan(name, "a", "a", notes=("its clock is 3 s ahead",))) for name in ("k3", "koala")
    }
    view = RolloutView({name: Names(name) for name in noted})
    assert "\nnote: k3, koala: its clock is 3 s ahead\n" in view.text(noted).plain


def test_notes_on_each_robot_of_a_host_are_one() -> None:
    notes = tuple(
        f"swarm-fleet.ep-{n}.pair.service is skipped; then run swarmctl deploy" for n in range(1, 7)
    )
    results: dict[str, Result] = {"pi": Outcome(HostPlan("pi", "a", "a", notes=notes))}
    names = {"pi": Names("pi", robots=tuple(f"ep-{n}" for n in range(1, 7)))}
    once = "note: pi: swarm-fleet.ep-[1-6].pair.service is skipped; then run swarmctl deploy fleet.yaml"
    for details, count in ((False, 1), (True, 6)):
        view = RolloutView(names, details, None, lambda hint: f"{hint} fleet.yaml")
        noted = [line for line in view.text(results).plain.splitlines() if line.startswith("note: ")]
        assert len(noted) == count
        assert (once in noted) is not details


def test_details_show_every_host() -> None:
    shown = lines(found(40, (3, 4)), details=True)
    assert all(any(line.startswith(f"tb-{n:03}  ") for line in shown) for n in range(1, 41))


@pytest.mark.parametrize("details", [False, True])
def test_no_line_is_wider_than_the_terminal(details: bool) -> None:
    for count, width in product((1, 12, 200), (40, 60, 80)):
        shown = lines(found(count, (1, 3, 9)[: count // 4]), details=details, width=width)
        assert max(map(cell_len, shown)) <= width


def test_the_board_of_many_hosts_drops_those_that_are_done() -> None:
    board = Board([f"tb-{n:03}" for n in range(1, 41)])
    for event in (Started("tb-001"), Started("tb-002"), Started("tb-003")):
        board.take(event)
    board.take(Finished("tb-001", Outcome(HostPlan("tb-001", "a", "a")), 0.1))
    board.take(Finished("tb-002", away(2), 10.0))
    console = Console(file=io.StringIO(), width=80)
    console.print(board)
    assert isinstance(console.file, io.StringIO)
    shown = [line.split()[0] for line in console.file.getvalue().splitlines()]
    assert shown == ["1", "tb-002", "tb-003"]


@pytest.mark.parametrize(("width", "height"), [(80, 24), (50, 24), (80, 8)])
def test_the_board_fits_the_screen_and_leaves_space_for_an_echo(width: int, height: int) -> None:
    board = Board([f"tb-{n:03}" for n in range(1, 41)])
    for n in range(1, 41):
        board.take(Note(f"tb-{n:03}", f"starting {', '.join([UNIT] * 5)}"))
    console = Console(file=io.StringIO(), width=width, height=height, soft_wrap=True)
    shown = "".join(segment.text for segment in console.render(board)).splitlines()
    assert len(shown) < height
    assert max(map(cell_len, shown)) <= width - 3
    assert shown[0] == "0 of 40 hosts done"
    assert shown[1].startswith("tb-001  starting swarm-fleet.")
    assert shown[-1] == f"... and {40 - (len(shown) - 2)} more"


def test_units_are_named_once_in_the_report_and_not_in_the_progress() -> None:
    units = [f"swarm-fleet.{name}.service" for name in ("master", "k3", "gate")]
    for names, done in ((units[:1], f"started {units[0]}"), (units, "started 3 units")):
        plan = HostPlan("k3", None, "b", steps=tuple(Step(StepKind.START, unit, "new") for unit in names))
        event = Finished("k3", Outcome(plan), 2.64)
        assert str(line(event)) == "k3: deployed  (2.6 s)"
        assert lines({"k3": Outcome(plan)})[0] == f"k3  deployed b, {done}"
        assert lines({"k3": Outcome(plan)}, details=True)[0] == f"k3  deployed b, started {', '.join(names)}"


def test_a_failure_of_several_hosts_does_not_name_them_twice() -> None:
    silent = "did not answer within 5 s"
    results: dict[str, Result] = {
        **{one: HostError(Kind.LOST, f"{one}: the connection was lost") for one in ("k3", "koala")},
        "desk": HostError(Kind.LOST, "desk: the connection was lost (closed)"),
        **{one: HostError(Kind.UNREACHABLE, f"{one} ({one}.lan, port 22) {silent}") for one in ("ep", "tb")},
    }
    view = RolloutView({name: Names(name, f"{name}.lan") for name in results})
    assert view.text(results).plain.splitlines()[:3] == [
        "k3, koala  lost: the connection was lost",
        "desk  lost: the connection was lost (closed)",
        f"ep, tb  unreachable: each (port 22) {silent}",
    ]
