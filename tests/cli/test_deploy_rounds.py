"""``deploy --when-seen``: which hosts it waits for, and what it prints of the rounds."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from swarmctl.cli.deploy_rounds import Rounds
from swarmctl.deploy import journal
from swarmctl.deploy.outcome import Outcome, Rules
from swarmctl.plan.plan import HostPlan
from swarmctl.remote.parallel_hosts import Stop
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.bundle import Bundle, Unit

OFF = HostError(Kind.UNREACHABLE, "connect timed out")
HELD = HostError(Kind.HELD, "nothing was changed, since pi does not answer")
BUSY = HostError(Kind.BUSY, "k3 drives")
FAILED = HostError(Kind.FAILED, "its unit does not start")
LOCKED = HostError(Kind.REFUSED, "locked by ben@desk (7)")
BOOTING = HostError(Kind.AUTH, "no key was accepted")
SAME = Outcome(HostPlan("pi", "b", "b"))
CHANGED = Outcome(HostPlan("pi", "a", "b"), recovered=True)


@dataclass
class Scripted:
    """The results of each round, and what was printed of them."""

    script: list[dict[str, Any]]
    shown: list[dict[str, Any]] = field(default_factory=list)

    def until_all_are_seen(self, monkeypatch: pytest.MonkeyPatch) -> Any:
        where: Any = SimpleNamespace(in_lab=True)
        view: Any = SimpleNamespace(json=False, swarm=SimpleNamespace(name="new", hosts={}))
        rounds = Rounds(where, SimpleNamespace(), view, {}, Rules(), [], None, Stop())  # type: ignore[arg-type]
        left = iter(self.script)
        monkeypatch.setattr(Rounds, "_deployed", lambda *_, **__: next(left))
        monkeypatch.setattr(Rounds, "report", lambda _, found: self.shown.append(dict(found)))
        monkeypatch.setattr(Rounds, "await_one", lambda *_: None)
        monkeypatch.setattr(Rounds, "remember_awaited", lambda *_: None)
        found = rounds.until_all_are_seen(rounds.first(dry_run=False, yes=True))
        assert next(left, None) is None
        return found


@pytest.mark.parametrize("later", [OFF, BUSY, HostError(Kind.LOST, "died"), LOCKED, BOOTING])
def test_a_host_that_was_off_is_waited_for_whatever_keeps_it(
    later: HostError, monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Scripted([{"pi": OFF}, {"pi": later}, {"pi": CHANGED}])
    assert rounds.until_all_are_seen(monkeypatch) == {"pi": CHANGED}


@pytest.mark.parametrize("last", [FAILED, BOOTING, HostError(Kind.NEWER, "by ben")])
def test_what_a_person_must_repair_ends_the_wait(last: HostError, monkeypatch: pytest.MonkeyPatch) -> None:
    script = [{"pi": OFF}, {"pi": BOOTING}, {"pi": last}]
    rounds = Scripted(script[:2] + script[2:])
    assert rounds.until_all_are_seen(monkeypatch) == {"pi": last}


def test_the_report_has_what_is_new_of_every_host(monkeypatch: pytest.MonkeyPatch) -> None:
    first = {"pi": OFF, "desk": HELD, "laptop": CHANGED}
    rounds = Scripted(
        [first, {**first, "pi": BUSY, "laptop": SAME}, {"pi": CHANGED, "desk": FAILED, "laptop": SAME}]
    )
    found = rounds.until_all_are_seen(monkeypatch)
    assert rounds.shown == [first, {"pi": BUSY}, {"pi": CHANGED, "desk": FAILED}]
    assert found == {"pi": CHANGED, "desk": FAILED, "laptop": CHANGED}


def bundle(host: str, *units: str) -> Bundle:
    return Bundle(swarm="new", host=host, units=tuple(Unit(name, ()) for name in units))


def test_a_robot_of_a_host_that_is_off_starts_on_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal, "folder", lambda _: tmp_path)
    before, after = (
        bundle("pi", "swarm-new.k3.service"),
        {"pi": bundle("pi"), "desk": bundle("desk", "swarm-new.k3.service")},
    )
    view: Any = SimpleNamespace(swarm=SimpleNamespace(name="new"))
    rounds = Rounds(SimpleNamespace(in_lab=False), None, view, after, Rules(), [], None, Stop())  # type: ignore[arg-type]
    assert not rounds._have_moved({"pi": OFF})
    journal.remember(tmp_path, "pi", before.digest, before.manifest)
    assert rounds._have_moved({"pi": OFF})
    assert not rounds._have_moved({})


def test_a_release_that_failed_rests_until_it_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    desk, other = bundle("desk"), bundle("desk", "swarm-new.k3.service")
    failed = {("desk", desk.digest): time.monotonic(), ("a host that is gone", desk.digest): time.monotonic()}

    def rounds(wanted: Bundle) -> Rounds:
        return Rounds(None, None, None, {"desk": wanted}, Rules(), [], None, Stop(), failed)  # type: ignore[arg-type]

    assert rounds(desk).failed_before() == ["desk"]
    assert rounds(other).failed_before() == []
    hour = time.monotonic() + 3601
    monkeypatch.setattr(time, "monotonic", lambda: hour)
    assert rounds(desk).failed_before() == []


def test_status_knows_what_processes_wait_for(tmp_path: Path) -> None:
    assert journal.awaited(tmp_path, lab=False) == {}
    journal.remember_awaited(tmp_path, {"pi": "off"}, lab=False)
    assert journal.awaited(tmp_path, lab=False) == {"pi": "off"}
    assert journal.awaited(tmp_path, lab=True) == {}
    (tmp_path / ".awaited-1").write_text("{")
    assert journal.awaited(tmp_path, lab=False) == {"pi": "off"}
    journal.remember_awaited(tmp_path, {}, lab=False)
    assert journal.awaited(tmp_path, lab=False) == {}
