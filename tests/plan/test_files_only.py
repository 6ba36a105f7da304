"""Which changes are of files alone that nothing on the host uses, so that they need no confirmation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from swarm_onboard.agent.deployed import Transaction

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.reconcile import reconcile
from swarmctl.render.bundle import Bundle, File
from tests.onboard.agent import fakehost
from tests.onboard.agent.fakehost import bundle

OLD = bundle("1")
RUNS = dict.fromkeys((unit.name for unit in OLD.units), fakehost.RUNS)
SEEN = Observed(OLD.digest, OLD.manifest, units=RUNS)
LOGIN = replace(OLD, files=(*OLD.files, File("setup.bash", b"export A=1\n")))
OPEN = Transaction("a" * 16, "pending", "x", None, None, 5.0, "")


def with_file(old: Bundle, path: str, content: bytes = b"new\n") -> Bundle:
    return replace(old, files=(*(one for one in old.files if one.path != path), File(path, content)))


@pytest.mark.parametrize(
    ("following", "is_it"),
    [
        (with_file(OLD, "rviz/swarm.rviz"), True),
        (with_file(OLD, "params/koala.yaml"), False),  # its unit restarts
        (with_file(OLD, "hosts"), False),  # a block shows it
        (with_file(OLD, "udev/90-swarm.rules"), False),  # a link shows it
        (with_file(OLD, "units/koala.service"), False),
        (with_file(OLD, "setup.bash"), False),  # a login may read it
        (replace(with_file(OLD, "data"), secrets=("pin",)), False),
        (bundle("1", units=("master",)), False),
        (replace(with_file(OLD, "data"), units=OLD.units[::-1]), False),
        (replace(with_file(OLD, "data"), links={}), False),
        (OLD, False),  # nothing to do
    ],
)
def test_a_change_is_of_files_alone_if_nothing_uses_them(following: Bundle, is_it: bool) -> None:
    plan = reconcile(following, SEEN)
    assert plan.files_only is is_it


@pytest.mark.parametrize(
    "worse",
    [
        lambda seen: replace(seen, units={**RUNS, "koala.service": fakehost.RUNS._replace(active="failed")}),
        lambda seen: replace(seen, drift={"params/koala.yaml": "changed"}),
        lambda seen: replace(seen, drift={"hosts": "missing"}),
        lambda seen: replace(seen, links={"/etc/udev/rules.d/90-swarm-new.rules": "missing"}),
        lambda seen: replace(seen, blocks={"/etc/hosts": "changed"}),
        lambda seen: replace(seen, secrets={"pin": "other"}),
        lambda seen: replace(seen, transaction=OPEN),
        lambda _: Observed(),
    ],
)
def test_it_is_not_on_a_host_that_needs_more(worse: Callable[[Observed], Observed]) -> None:
    following = with_file(OLD, "data")
    assert reconcile(following, SEEN).files_only
    assert not reconcile(following, worse(SEEN)).files_only


def test_a_damaged_release_is_not_made_whole_by_a_rename() -> None:
    whole = with_file(OLD, "data")
    seen = Observed(whole.digest, whole.manifest, units=RUNS, drift={"data": "damaged"})
    plan = reconcile(whole, seen)
    assert plan.steps
    assert not plan.files_only


def test_a_file_that_goes_counts_as_well() -> None:
    seen = Observed(LOGIN.digest, LOGIN.manifest, units=RUNS)
    assert not reconcile(OLD, seen).files_only
    more = with_file(OLD, "data")
    assert reconcile(OLD, Observed(more.digest, more.manifest, units=RUNS)).files_only
