"""``prepare`` shows many hosts as few lines, and never wider than the terminal."""

from __future__ import annotations

import pytest
from rich.cells import cell_len

from swarmctl.plan.host_preparation import HostPreparation, Kind, Step
from swarmctl.plan.plan import Problem
from swarmctl.views.equal_hosts import Names
from swarmctl.views.preparation import PreparationView

LACKS = Problem(
    "lacks", "rare, needed by programs.map; no package source has it", "build it in the workspace"
)
AWAY = Problem("unreachable", "connect timed out", "is it on?")


def bare(number: int, *lacks: Problem) -> HostPreparation:
    steps = (Step(Kind.GROUP, "dialout", f"robots.rover-{number:02}"), Step(Kind.APT, "chrony", "time"))
    return HostPreparation(f"tb-{number:02}", steps, lacks)


def shown(hosts: list[HostPreparation], width: int | None = None) -> str:
    names = {f"tb-{n:02}": Names(f"tb-{n:02}", f"10.1.0.{n}", (f"rover-{n:02}",)) for n in range(1, 41)}
    return PreparationView(names, width).text(hosts).plain


def test_forty_equal_hosts_share_their_steps() -> None:
    assert shown([bare(n) for n in range(1, 41)]).splitlines() == [
        "prepare: 40 groups, 40 Debian packages on 40 hosts",
        "",
        "tb-[01-40]",
        "  + group    dialout  robots.rover-[01-40]",
        "  + apt      chrony   time",
    ]


def test_unfit_and_unreachable_hosts_stand_apart() -> None:
    away = [HostPreparation(f"tb-{n:02}", problem=AWAY) for n in (3, 4)]
    text = shown([bare(1), bare(2, LACKS), *away, HostPreparation("desk")])
    assert text.startswith("prepare: 2 groups, 2 Debian packages on 2 hosts; unfit all the same: tb-[02-04]")
    assert "  ! lacks: rare, needed by programs.map" in text
    assert "tb-[03-04]  unreachable: connect timed out\n  help: is it on?" in text
    assert text.endswith("\nfit: desk")


@pytest.mark.parametrize("width", [40, 80])
def test_no_line_is_wider_than_the_terminal(width: int) -> None:
    text = shown([*(bare(n) for n in range(1, 30)), *(bare(n, LACKS) for n in range(30, 41))], width)
    assert max(map(cell_len, text.splitlines())) <= width


def test_fit_hosts_have_nothing_to_do() -> None:
    assert shown([HostPreparation("desk")]) == "nothing to do"
