"""A driver that runs takes its new parameter file in a change, and the old one again if that is undone."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path

import pytest
from swarm_onboard.agent import live_parameters, systemd
from swarm_onboard.agent.errors import FailedError
from swarm_onboard.agent.release_store import home_of
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.stop_latch import StopLatch

from swarmctl.render.bundle import Bundle, File, Unit
from tests.onboard.agent.fakehost import FakeHost, bundle

UNIT = "koala.service"
RELOAD = {"start": [], "reload_unit": [UNIT]}


def release(params: str, *more: str) -> Bundle:
    """A driver whose parameter file is ``params``, and units without one."""
    plain = bundle("1", units=("koala", *more))
    others = (file for file in plain.files if file.path != "params/koala.yaml")
    files = (File("params/koala.yaml", params.encode(), fixed=b"fixed"), *others)
    units = (Unit(UNIT, ("params/koala.yaml",), robot="koala"), *plain.units[1:])
    return replace(plain, files=files, units=units)


OLD, NEW = release("limit: 1"), release("limit: 2")


@dataclass
class Driver:
    """Answers as a driver does. ``refuses``: the text of a file that it does not take."""

    file: Path
    refuses: str = ""
    text: str = ""
    answers: dict[str, str] = field(default_factory=dict)

    def requested(self, words: str) -> None:
        if not words.startswith("reload"):
            return
        text = self.file.read_text()
        refused = bool(self.refuses) and text == self.refuses
        self.text = self.text if refused else text
        digest = sha256(self.text.encode()).hexdigest()
        self.answers = {"params": digest, "reloaded": words, "refusal": "no" if refused else ""}


@contextmanager
def driving(host: FakeHost, refuses: str = "") -> Iterator[Driver]:
    """The driver of `koala`, which has read the file of the present release."""
    file = host.prefix / "opt/swarm/new/current/params/koala.yaml"
    driver = Driver(file, refuses, file.read_text())
    folder = host.prefix / "run/koala"
    folder.mkdir()
    commands = CommandMailbox()
    latch = StopLatch("", commands, str(folder))

    def loop() -> None:
        while not commands.stopped:
            latch.answer(lambda: driver.answers, driver.requested)
            commands.wait(30.0, latch.listens_to())

    thread = threading.Thread(target=loop)
    thread.start()
    try:
        yield driver
    finally:
        commands.stop()
        thread.join()


@pytest.fixture
def host(host: FakeHost) -> FakeHost:
    assert not host.apply(OLD).error
    host.calls()
    return host


def test_a_running_driver_takes_its_file_and_no_unit_stops(host: FakeHost) -> None:
    with driving(host) as driver:
        reply = host.apply(NEW, previous=OLD.digest, **RELOAD)
    assert reply.answer["release"] == NEW.digest, reply.error
    assert "reloading koala.service" in reply.notes
    assert driver.text == "limit: 2"
    assert host.calls() == []
    assert host.units() == {UNIT: OLD.digest}


def test_a_file_that_a_driver_refuses_is_undone(host: FakeHost) -> None:
    with driving(host, refuses="limit: 2") as driver:
        reply = host.apply(NEW, previous=OLD.digest, **RELOAD)
    assert "koala.service keeps its parameters: no; undone" in reply.error["message"]
    assert driver.text == "limit: 1"
    assert host.observe().release == OLD.digest
    assert host.units() == {UNIT: OLD.digest}


def test_a_driver_takes_its_old_file_if_the_change_is_undone(host: FakeHost) -> None:
    later = release("limit: 2", "web")
    (host.prefix / f"broken-web.service-{later.digest}").touch()
    with driving(host) as driver:
        reply = host.apply(later, previous=OLD.digest, **{**RELOAD, "start": ["web.service"]})
    assert "undone" in reply.error["message"]
    assert driver.text == "limit: 1"
    assert host.units() == {UNIT: OLD.digest}


def test_what_a_dead_agent_had_reloaded_is_reloaded_again(host: FakeHost) -> None:
    with driving(host) as driver:
        assert host.apply(NEW, "after:live", previous=OLD.digest, **RELOAD).status == 137
        assert driver.text == "limit: 2"
        assert host.recover() == 0
        assert driver.text == "limit: 1"
    assert host.observe().release == OLD.digest


def test_a_rollback_reloads_what_a_deploy_has_reloaded(host: FakeHost) -> None:
    with driving(host) as driver:
        host.apply(NEW, previous=OLD.digest, **RELOAD)
        reply = host.ask({
            "verb": "rollback", "swarm": "new", "txid": "0" * 16, "who": "someone@laptop",
            "previous": NEW.digest, "next": OLD.digest, "secrets": "", "wait": 0.3,
        })  # fmt: skip
    assert reply.answer["release"] == OLD.digest, reply.error
    assert driver.text == "limit: 1"
    assert host.units() == {UNIT: OLD.digest}


def test_a_driver_that_does_not_run_reads_its_file_later(host: FakeHost) -> None:
    (host.prefix / "units" / UNIT).unlink()
    reply = host.apply(NEW, previous=OLD.digest, **RELOAD)
    assert reply.answer["release"] == NEW.digest, reply.error
    assert host.units() == {}


def test_only_units_of_the_release_are_reloaded(host: FakeHost) -> None:
    reply = host.apply(NEW, previous=OLD.digest, start=[], reload_unit=["other.service"])
    assert "other.service is not a unit of release" in reply.error["message"]


def test_a_driver_that_keeps_silent_fails_the_change(host: FakeHost, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWARM_PREFIX", str(host.prefix))
    monkeypatch.setattr(live_parameters, "_PATIENCE", 0.1)
    monkeypatch.setattr(live_parameters, "_LOOK", 0.1)
    monkeypatch.setattr(systemd, "running", list)
    with pytest.raises(FailedError, match="did not take its new file within"):
        live_parameters.take(home_of("new"), [UNIT])
