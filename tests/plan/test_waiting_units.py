"""Units that do not run, in a plan: which are started, and which wait for something, with a note what for."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.agent.paths import trial_file
from swarm_onboard.agent.systemd import UnitState

from swarmctl.plan.reconcile import reconcile
from swarmctl.render.bundle import Bundle, Unit, package
from tests.onboard.agent.fakehost import RUNS
from tests.plan.test_reconcile import FIT, bundle, lines, running


@pytest.mark.parametrize("state", ["failed", "inactive", "deactivating"])
def test_a_unit_that_does_not_run_is_started(state: str) -> None:
    units = {"a.service": RUNS._replace(active=state), "b.service": RUNS, "s.target": RUNS}
    assert lines(reconcile(bundle(), running(bundle(), units=units))) == [f"start a.service: is {state}"]


@pytest.mark.parametrize(
    ("place", "note"),
    [
        ("PathExists=/sys/class/bluetooth/hci1", "pi has no Bluetooth adapter hci1; connect it, or"),
        ("FileIsExecutable=/usr/bin/rfcomm", "pi lacks /usr/bin/rfcomm; `swarmctl prepare` installs"),
        ("PathExists=/etc/swarm/s/secrets/pin", "the secret pin is not on pi; write it to `secrets/pin`"),
        ("PathExists=/dev/other", "/dev/other does not exist on pi; create it; then run swarmctl"),
    ],
)
def test_a_condition_that_is_not_met_is_a_note(place: str, note: str) -> None:
    skipped = RUNS._replace(active="inactive", skipped=True, unmet=(f"Condition{place}",))
    units = {"a.service": skipped, "b.service": RUNS, "s.target": RUNS}
    plan = reconcile(bundle(), running(bundle(), units=units))
    assert plan.steps == ()
    (shown,) = plan.notes
    assert shown.startswith(f"a.service is skipped: {note}")


@pytest.mark.parametrize("packages", [(), ("tf",)])
@pytest.mark.parametrize(
    "state",
    [
        RUNS._replace(active="inactive"),
        RUNS._replace(active="failed"),
        RUNS._replace(active="inactive", skipped=True),
        RUNS._replace(
            active="inactive", skipped=True, unmet=(f"ConditionPathExists={trial_file('a.service')}",)
        ),
    ],
)
def test_no_deploy_starts_what_runs_in_trials_alone(state: UnitState, packages: tuple[str, ...]) -> None:
    a, *others = bundle().units
    wanted = replace(bundle(), units=(replace(a, in_trials=True, packages=packages), *others))
    units = {"a.service": state, "b.service": RUNS, "s.target": RUNS}
    facts = FIT._replace(has={package("tf"): "/usr/share/tf"})
    plan = reconcile(wanted, running(wanted, units=units, facts=facts))
    assert (plan.steps, plan.notes) == ((), ())


def test_a_unit_whose_conditions_are_met_now_is_started() -> None:
    units = {"a.service": RUNS._replace(active="inactive", skipped=True), "b.service": RUNS, "s.target": RUNS}
    plan = reconcile(bundle(), running(bundle(), units=units))
    assert lines(plan) == ["start a.service: its conditions are met now"]
    assert plan.notes == ()


def with_optional_program() -> Bundle:
    plain = bundle()
    maps = Unit("map.service", ("params/a.yaml",), program="map", packages=("gmapping", "tf"))
    return replace(plain, units=(*plain.units, maps))


def test_an_optional_program_without_its_package_is_a_note() -> None:
    wanted, has = with_optional_program(), {package("tf"): "/usr/share/tf", package("gmapping"): None}
    skipped = running(wanted).units | {
        "map.service": RUNS._replace(active="inactive", sub="dead", skipped=True)
    }
    plan = reconcile(wanted, running(wanted, units=skipped, facts=FIT._replace(has=has)))
    assert plan.problem is None
    assert plan.steps == ()
    (note,) = plan.notes
    assert note.startswith("program `map` is skipped: the host lacks the ROS package gmapping; ")
    assert "`apt install ros-noetic-gmapping`" in note
    assert "tf" not in note


def test_an_optional_program_starts_once_its_packages_exist() -> None:
    wanted = with_optional_program()
    has = dict.fromkeys((package("tf"), package("gmapping")), "/usr/share")
    skipped = running(wanted).units | {
        "map.service": RUNS._replace(active="inactive", sub="dead", skipped=True)
    }
    plan = reconcile(wanted, running(wanted, units=skipped, facts=FIT._replace(has=has)))
    assert lines(plan) == ["start map.service: the host now has its ROS packages"]
    assert plan.notes == ()
