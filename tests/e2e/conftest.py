"""One lab for the whole folder: booted once, deployed once, put right after every test, gone at the end."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import NoReturn

import pytest

from swarmctl.lab import paths
from tests.e2e.lab_needs import missing_for_a_lab
from tests.e2e.lab_swarm import LabSwarm, Run, lab_of
from tests.e2e.recovery import lab_of_isles

FAILED = pytest.StashKey[bool]()
HERE = Path(__file__).parent
#: They start first, the longest first: of two labs side by side, none is to be left over with a long file.
LONGEST = (
    "test_recovery.py",
    "test_recovery_of_islands.py",
    "test_recovery_of_relays.py",
    "test_ros1_and_ros2.py",
    "test_migration_page.py",
    "test_rover.py",
    "test_paper.py",
    "test_ros2.py",
    "test_ros2_status.py",
    "test_program_health.py",
    "test_sealed.py",
    "test_lab_page.py",
    "test_faults.py",
    "test_programs.py",
    "test_dead_man.py",
    "test_gate.py",
    "test_change.py",
    "test_lab.py",
    "test_mode_change.py",
    "test_units_come_back.py",
    "test_relay.py",
    "test_containers.py",
    "test_record.py",
    "test_late_hosts.py",
    "test_own_robot_page.py",
    "test_hosts.py",
    "test_driver_table.py",
    "test_lab_fleet.py",
    "test_second_day.py",
)
NOT_LAB = ("test_dead_man_page.py",)


@dataclass(frozen=True)
class FirstTime:
    """The output of the first plan and deploy of the lab, and the plan after them."""

    plan: Run
    deploy: Run
    plan_after: Run


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    missing = missing_for_a_lab()
    for item in items:
        if item.path.parent == HERE and item.path.name not in NOT_LAB:
            item.add_marker(pytest.mark.lab)
            if missing:
                item.add_marker(pytest.mark.skip(reason=f"no lab here: {missing}"))
    items.sort(key=lambda item: LONGEST.index(item.path.name) if item.path.name in LONGEST else len(LONGEST))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    report = yield
    if report.failed:
        item.stash[FAILED] = True
    return report


@pytest.fixture(scope="session")
def workplace() -> Iterator[Path]:
    """A folder for labs, journals and sockets. Its path is short: sockets cannot have long ones."""
    folder = Path(tempfile.mkdtemp(prefix="swarm-e2e-"))
    before = signal.signal(signal.SIGTERM, _interrupted)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.STATE_VARIABLE, str(folder))
        yield folder
    signal.signal(signal.SIGTERM, before)
    shutil.rmtree(folder)


def _interrupted(_number: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


@pytest.fixture(scope="session")
def shared_lab(workplace: Path) -> Iterator[LabSwarm]:
    example = HERE.parent.parent / "examples/paper-leader/swarm.yaml"
    with lab_of(f"e2e-{os.getpid()}", example, workplace) as swarm:
        yield swarm


@pytest.fixture(scope="module")
def isles(workplace: Path) -> Iterator[LabSwarm]:
    """A lab of three hosts and three robots, in whichever mode a test deploys."""
    with lab_of_isles(workplace, "leader") as swarm:
        yield swarm


@pytest.fixture(scope="session")
def first_time(shared_lab: LabSwarm) -> FirstTime:
    plan = shared_lab.plan()
    return FirstTime(plan, shared_lab.timed_deploy(), shared_lab.plan())


@pytest.fixture
def swarm(request: pytest.FixtureRequest, shared_lab: LabSwarm, first_time: FirstTime) -> Iterator[LabSwarm]:
    """The swarm of the first paper, deployed and at rest, and so again afterwards."""
    assert first_time.deploy.status == 0, first_time.deploy.out + first_time.deploy.err
    yield shared_lab
    if request.node.stash.get(FAILED, False):
        shared_lab.deployed = None
    shared_lab.settle()
