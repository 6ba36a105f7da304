"""The operator's secrets: where they are looked for, what is refused, and that only who needs one gets it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.steps import Kind

from swarmctl.deploy.host_records import histories
from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome, Rules
from swarmctl.deploy.rollback import Rollback
from swarmctl.deploy.rollout import observe
from swarmctl.deploy.secrets import SecretError, found, variable
from swarmctl.plan.history import runs
from swarmctl.plan.waves import order
from swarmctl.remote import parallel_hosts
from swarmctl.remote.transport import HostError, Session, Target
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.views.history import history_text
from tests.deploy.deploying import after_the_change, deploy, fails
from tests.onboard.agent.fakehost import FakeHost
from tests.onboard.agent.local_session import LocalSession

PIN = "4971"
TERMS = Terms(healthy_for=0.1, healthy_within=5)


def write(folder: Path, text: str, mode: int = 0o600) -> Path:
    (folder / "secrets").mkdir()
    file = folder / "secrets/epuck-pin"
    file.write_text(text)
    file.chmod(mode)
    return file


def test_a_variable_comes_before_a_file(tmp_path: Path) -> None:
    write(tmp_path, "1111\n")
    assert found(["epuck-pin"], tmp_path, {}) == {"epuck-pin": "1111"}
    assert found(["epuck-pin"], tmp_path, {variable("epuck-pin"): PIN}) == {"epuck-pin": PIN}
    assert variable("epuck-pin") == "SWARMCTL_SECRET_EPUCK_PIN"


def test_secrets_of_programs_are_lines_and_texts(tmp_path: Path) -> None:
    key = "-----BEGIN KEY-----\nabc\n-----END KEY-----\n"
    write(tmp_path, key)
    assert found(["epuck-pin"], tmp_path, {}, {"epuck-pin": "text"}) == {"epuck-pin": key}
    with pytest.raises(SecretError, match="cannot be an environment variable"):
        found(["epuck-pin"], tmp_path, {}, {"epuck-pin": "line"})
    (tmp_path / "secrets/epuck-pin").write_text("a long token of more than sixteen\n")
    assert found(["epuck-pin"], tmp_path, {}, {"epuck-pin": "line"}) == {
        "epuck-pin": "a long token of more than sixteen"
    }


def test_one_that_is_nowhere_is_left_out(tmp_path: Path) -> None:
    assert found(["epuck-pin"], tmp_path, {}) == {}


@pytest.mark.parametrize(
    ("text", "mode", "complaint"),
    [
        (PIN, 0o644, "is readable for other users"),
        (f"{PIN}\n\n", 0o600, "is not a PIN"),
        ("", 0o600, "is not a PIN"),
        ("12 34", 0o600, "is not a PIN"),
        ("1" * 17, 0o600, "is not a PIN"),
    ],
)
def test_what_cannot_be_one_is_refused_without_being_shown(
    tmp_path: Path, text: str, mode: int, complaint: str
) -> None:
    write(tmp_path, text, mode)
    with pytest.raises(SecretError) as caught:
        found(["epuck-pin"], tmp_path, {})
    assert complaint in str(caught.value)
    assert caught.value.fix
    assert not text.strip() or text.strip() not in f"{caught.value}{caught.value.fix}"


@pytest.fixture
def host(tmp_path: Path) -> FakeHost:
    made = FakeHost(tmp_path / "pi")
    (made.prefix / "bin/sudo").write_text('#!/bin/sh\nshift\nexec "$@"\n')
    (made.prefix / "bin/sudo").chmod(0o755)
    return made


class Way:
    """The way to the host."""

    def __init__(self, host: FakeHost) -> None:
        self.host = host

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        yield LocalSession(self.host.environment())


def wanted() -> dict[str, Bundle]:
    pair = File("units/new.epuck.pair.service", b"[Service]\n")
    unit = Unit("new.epuck.pair.service", (pair.path,), secrets=("epuck-pin",))
    plain = Bundle((pair,), (unit,), {f"/etc/systemd/system/{unit.name}": pair.path}, swarm="new", host="pi")
    return {"pi": replace(plain, secrets=("epuck-pin",))}


TARGETS = {"pi": Target("pi", "192.0.2.1", "robot")}


def rolled(host: FakeHost, **secrets: str) -> Outcome:
    given = {name.replace("_", "-"): value for name, value in secrets.items()}
    events = deploy(wanted(), TARGETS, Way(host), secrets=given)
    (outcome,) = (event.outcome for event in events if isinstance(event, parallel_hosts.Finished))
    assert isinstance(outcome, Outcome), outcome
    assert not any(value in json.dumps(outcome.plan.to_json()) for value in secrets.values())
    return outcome


def test_a_changed_secret_is_sent_again_and_its_reader_restarts(host: FakeHost) -> None:
    kept = host.prefix / "etc/swarm/new/secrets/epuck-pin"
    assert rolled(host, epuck_pin=PIN).plan.targets(Kind.SECRET) == ("epuck-pin",)
    assert kept.read_text() == PIN
    assert not rolled(host, epuck_pin=PIN).changed
    changed = rolled(host, epuck_pin="0042").plan
    assert [(step.kind, step.target) for step in changed.steps] == [
        (Kind.SECRET, "epuck-pin"),
        (Kind.RESTART, "new.epuck.pair.service"),
    ]
    assert kept.read_text() == "0042"
    assert not rolled(host).changed


def test_a_token_with_which_its_unit_ends_is_taken_back(
    host: FakeHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    rolled(host, epuck_pin=PIN)
    first = host.readers()
    after_the_change(monkeypatch, lambda: fails(host, "new.epuck.pair.service"))
    events = deploy(wanted(), TARGETS, Way(host), secrets={"epuck-pin": "0042"})
    error = list(events)[-1].outcome

    assert isinstance(error, HostError)
    assert "new.epuck.pair.service does not keep running" in error.message
    assert (host.prefix / "etc/swarm/new/secrets/epuck-pin").read_text() == PIN
    assert host.readers() == first


def test_rollback_brings_the_value_before_and_again_the_one_after(host: FakeHost) -> None:
    rolled(host, epuck_pin=PIN)
    rolled(host, epuck_pin="0042")
    kept = host.prefix / "etc/swarm/new/secrets/epuck-pin"
    texts = []
    for value in (PIN, "0042"):
        with Rollback(wanted(), TARGETS, Way(host), rules=Rules(0, (), TERMS), parallel=4) as going:
            for _ in going.survey():
                pass
            assert [step.cause for step in going.due[0].steps] == [
                "with the secrets that it had before",
                "secrets that it reads change",
            ]
            for _ in going.change(order(going.due, (), ("100%",), "all")):
                pass
        assert kept.read_text() == value
        assert set(host.readers()) == {"new.epuck.pair.service"}
        found: Any = list(histories("new", list(TARGETS.values()), Way(host), parallel=1))[-1]
        texts.append(history_text(runs({"pi": found.outcome.entries}), {}, None).plain)
    assert texts[1].count(", other secrets") == 3


def test_values_that_the_host_has_no_more_are_no_way_back(host: FakeHost) -> None:
    for value in (PIN, "0042", "0043"):
        rolled(host, epuck_pin=value)
    first, *_ = host.history()
    with Rollback(wanted(), TARGETS, Way(host), to=first.run, rules=Rules(0, (), TERMS), parallel=4) as going:
        for _ in going.survey():
            pass
    assert "the secrets that release" in str(going.errors["pi"])


def test_a_plan_says_where_it_is_missing(host: FakeHost) -> None:
    (plan,) = observe(wanted(), TARGETS, Way(host), parallel=4).hosts
    assert "epuck-pin is missing on the host and beside the spec" in plan.notes[0]
    (plan,) = observe(wanted(), TARGETS, Way(host), secrets={"epuck-pin": PIN}, parallel=4).hosts
    assert [step.cause for step in plan.steps if step.kind is Kind.SECRET] == ["not on the host yet"]
