"""Secrets: for root alone, in no answer and no record; a change that is undone leaves the old values."""

from __future__ import annotations

import json
from dataclasses import replace
from hashlib import sha256

import pytest

from swarmctl.render.bundle import Bundle, Unit
from tests.onboard.agent.fakehost import FakeHost, Reply, bundle
from tests.sizes import some_of

PIN, NEXT = "49714971", "80358035"  # longer than any process id, which the lock file has
PLAIN = bundle("1")
TXID = "0123456789abcdef"
VAULT = "etc/swarm/new/secrets"
READER, OTHER = "koala.service", "master.service"


def reading(release: Bundle) -> Bundle:
    """A release whose driver reads the PIN."""
    units = (
        Unit(OTHER, ("params/master.yaml",)),
        Unit(READER, ("params/koala.yaml",), secrets=("epuck-pin",)),
    )
    return replace(release, units=units, secrets=("epuck-pin",))


PAIRED, LATER = reading(PLAIN), reading(bundle("2"))


@pytest.fixture
def paired(host: FakeHost) -> FakeHost:
    """Runs a release with its PIN."""
    assert host.apply(PAIRED, secrets={"epuck-pin": PIN}).answer
    return host


def rotate(host: FakeHost, failpoint: str = "", pin: str = NEXT, **more: object) -> Reply:
    """Another PIN for the same release."""
    change = {"previous": PAIRED.digest, "start": [], "restart": [READER], "txid": TXID, **more}
    return host.apply(PAIRED, failpoint, {"epuck-pin": pin}, **change)


def back(host: FakeHost, release: Bundle, secrets: str) -> Reply:
    base = host.observe().release
    return host.ask(
        {
            "verb": "rollback",
            "swarm": "new",
            "txid": "f" * 16,
            "previous": base,
            "next": release.digest,
            "secrets": secrets,
        }
    )


def compared(host: FakeHost, value: str | None) -> str:
    payload = json.dumps({} if value is None else {"epuck-pin": value}).encode()
    reply = host.ask({"verb": "observe", "swarm": "new", "secrets": ["epuck-pin"]}, payload)
    assert PIN not in json.dumps(reply.answer)
    return str(reply.answer["secrets"]["epuck-pin"])


def current(host: FakeHost) -> str:
    return (host.prefix / VAULT).readlink().name


def has_the_old_pin(host: FakeHost, runs: bool = True) -> None:
    """What reads it runs with it, and nothing is left of another one."""
    assert (host.prefix / VAULT / "epuck-pin").read_text() == PIN
    assert not runs or host.readers()[READER] == current(host)
    assert NEXT not in [path.read_text() for path in (host.prefix / "etc").rglob("*") if path.is_file()]
    assert host.observe().transaction.state == "undone"


def test_only_root_can_read_it(paired: FakeHost) -> None:
    kept = paired.prefix / VAULT / "epuck-pin"
    assert kept.read_text() == PIN
    assert kept.stat().st_mode & 0o777 == 0o600
    assert {
        path.stat().st_mode & 0o777 for path in (kept.parent.resolve(), kept.parent.resolve().parent)
    } == {0o700}


def test_the_host_reports_only_how_secrets_compare(host: FakeHost) -> None:
    assert compared(host, None) == "missing"
    assert compared(host, PIN) == "new"
    host.apply(PAIRED, secrets={"epuck-pin": PIN})
    assert compared(host, PIN) == "same"
    assert compared(host, "0000") == "other"
    assert compared(host, None) == "kept"


STEPS = ["secrets", "record", "stop", "flip", "switch", "links", "blocks", "reload", "start", "pending"]
TAKEN = ["secrets", "stop", "links", "pending"]


@pytest.mark.parametrize("boot", [0, 1], ids=["agent killed", "power cut"])
@pytest.mark.parametrize("step", some_of(STEPS, TAKEN))
def test_wherever_a_change_ends_early_its_host_has_the_old_value(
    paired: FakeHost, step: str, boot: int
) -> None:
    assert rotate(paired, f"after:{step}", confirm_within=0.05).status == 137
    paired.boot(boot)

    assert paired.recover() == 0

    if step == "secrets":  # nothing had changed; the next change clears away what it had written
        assert rotate(paired, "error:stop").error
    has_the_old_pin(paired, runs=not boot)


@pytest.mark.parametrize("step", some_of([*STEPS[:1], *STEPS[2:-1]], TAKEN))
def test_a_change_that_fails_leaves_the_old_value(paired: FakeHost, step: str) -> None:
    before = paired.readers()
    assert rotate(paired, f"error:{step}").error
    assert (paired.prefix / VAULT / "epuck-pin").read_text() == PIN
    assert paired.readers() == before
    assert len(list((paired.prefix / "etc/swarm/new/secret-sets").iterdir())) == 1


@pytest.mark.parametrize("verb", ["undo", "hold", "deadline"])
def test_a_value_that_is_not_confirmed_goes(paired: FakeHost, verb: str) -> None:
    within = 0.05 if verb == "deadline" else 100
    assert rotate(paired, confirm_within=within).answer
    assert paired.readers()[READER] == current(paired) == TXID
    if verb == "hold":  # the unit ends, since its token is wrong
        (paired.prefix / "units" / READER).unlink()
        (paired.prefix / f"failed-{READER}").touch()
    if verb == "deadline":
        assert paired.recover() == 0
    else:
        within = {"seconds": 1, "within": 5} if verb == "hold" else {}
        paired.ask({"verb": verb, "swarm": "new", "txid": TXID, **within})
    has_the_old_pin(paired)


def test_a_rollback_brings_the_values_of_that_time(paired: FakeHost) -> None:
    first = current(paired)
    assert rotate(paired).answer
    second = current(paired)
    assert paired.apply(LATER, previous=PAIRED.digest, start=[], restart=[READER, OTHER]).answer
    assert current(paired) == second  # an unchanged set stays the same one

    for wanted, pin in ((first, PIN), (second, NEXT)):
        assert back(paired, PAIRED, wanted).answer
        assert (paired.prefix / VAULT / "epuck-pin").read_text() == pin
        assert paired.readers()[READER] == wanted
    assert paired.units() == dict.fromkeys((READER, OTHER), PAIRED.digest)


def test_a_rollback_of_a_value_restarts_only_what_reads_it(paired: FakeHost) -> None:
    first = current(paired)
    rotate(paired)
    paired.calls()
    back(paired, PAIRED, first)
    assert [one for one in paired.calls() if one.startswith(("stop", "start"))] == [
        f"stop -- {READER}",
        f"start -- {READER}",
    ]


def test_values_that_are_gone_are_no_way_back(paired: FakeHost) -> None:
    reply = back(paired, PAIRED, "e" * 16)
    assert reply.error["message"] == f"the secrets of release {PAIRED.digest} are not on the host any more"
    assert (paired.prefix / VAULT / "epuck-pin").read_text() == PIN


def test_it_stays_as_long_as_a_release_needs_it(paired: FakeHost) -> None:
    paired.apply(PLAIN, previous=PAIRED.digest, start=[])
    assert compared(paired, None) == "missing"
    before = PLAIN
    for following in (bundle("7"), bundle("8")):
        assert (paired.prefix / "etc/swarm/new/secret-sets").exists()  # a rollback would need it
        paired.apply(following, previous=before.digest, start=[])
        before = following
    assert not (paired.prefix / "etc/swarm").exists()


def test_of_each_release_the_last_two_values_are_kept(paired: FakeHost) -> None:
    for number in range(4):
        assert rotate(paired, pin=f"1000000{number}", txid=f"{number:016x}").answer
    kept = (paired.prefix / "etc/swarm/new/secret-sets").iterdir()
    assert sorted((path / "epuck-pin").read_text() for path in kept) == ["10000002", "10000003"]


@pytest.mark.parametrize("failpoint", ["", "error:start", "error:secrets"])
def test_removed_or_undone_it_is_gone(host: FakeHost, failpoint: str) -> None:
    host.apply(PAIRED, failpoint, {"epuck-pin": PIN})
    if not failpoint:
        host.ask({"verb": "remove", "swarm": "new"})
    assert not (host.prefix / "etc/swarm").exists()


def test_no_file_of_the_swarms_folder_holds_it_or_its_digest(paired: FakeHost) -> None:
    rotate(paired)
    hidden = [
        text for pin in (PIN, NEXT) for text in (pin.encode(), sha256(pin.encode()).hexdigest()[:12].encode())
    ]
    for path in (paired.prefix / "opt").rglob("*"):
        assert path.is_symlink() or path.is_dir() or not any(one in path.read_bytes() for one in hidden), path


def test_a_folder_in_place_of_the_link_is_refused(host: FakeHost) -> None:
    (host.prefix / VAULT).mkdir(parents=True)
    reply = host.apply(PAIRED, secrets={"epuck-pin": PIN})
    assert "is a folder, and swarmctl needs a link there" in reply.error["message"]
    assert host.units() == {}


@pytest.mark.parametrize("name", ["../../passwd", "", "a/b", "A", ".x"])
def test_a_name_that_is_no_name_is_refused(host: FakeHost, name: str) -> None:
    reply = host.apply(PAIRED, secrets={name: PIN})
    assert reply.error["kind"] == "refused"
    assert not (host.prefix / "etc/swarm").exists()
