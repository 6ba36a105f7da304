"""The order of runs comes from the logs of hosts, and not from their clocks."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.audit import ChangeEntry
from swarm_onboard.agent.verbs.history import Answer

from swarmctl.plan.history import before_last, runs
from swarmctl.plan.history import state_of as state

YEAR = 365.25 * 86400  # s
HOSTS = ("hub", "k3", "epuck")


def entry(run: str, time: float, previous: str | None = None) -> ChangeEntry:
    return ChangeEntry(time, run * 2, run, "ann", previous, run, "", "", "applied", "")


@given(
    st.lists(st.sets(st.sampled_from(HOSTS), min_size=1), min_size=1, max_size=8),
    st.fixed_dictionaries({host: st.floats(-50 * YEAR, 10 * YEAR) for host in HOSTS}),
)
def test_runs_with_a_common_host_are_in_order_whatever_its_clock(
    took_part: list[set[str]], ahead: dict[str, float]
) -> None:
    logs: dict[str, list[ChangeEntry]] = {host: [] for host in HOSTS}
    for number, hosts in enumerate(took_part):
        for host in hosts:
            logs[host].append(entry(f"{number:016x}", 1e9 + 60 * number + ahead[host]))
    found = runs(logs)
    assert sorted(run.name for run in found) == [f"{number:016x}" for number in range(len(took_part))]
    for host, entries in logs.items():
        assert [run.name for run in found if host in run.changes] == [one.run for one in entries]


def test_a_clock_that_lost_its_battery_does_not_mislead_a_rollback() -> None:
    first, second = "a" * 16, "b" * 16
    logs = {"hub": [entry(first, 2e9), entry(second, 0.0, previous=first)], "k3": [entry(first, 2e9)]}
    answer = Answer([], second, "", [], [], "")
    current = {"hub": state(answer), "k3": state(answer._replace(release=first))}
    assert [run.name for run in runs(logs)] == [first, second]
    back = before_last(runs(logs), current)
    assert {host: one.release for host, one in back.items()} == {"hub": first}


def test_logs_that_contradict_each_other_lose_no_run() -> None:
    one, other = entry("a" * 16, 5.0), entry("b" * 16, 4.0)
    found = runs({"hub": [one, other], "k3": [other, one]})
    assert [run.name for run in found] == ["b" * 16, "a" * 16]
