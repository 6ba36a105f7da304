"""``swarmctl report`` writes one archive without secrets, and ``status --from`` shows its status again."""

from __future__ import annotations

import gzip
import json
import math
import shutil
import tarfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from swarm_onboard.agent.verbs.history import Answer

from swarmctl.adoption.changes import EditedFile
from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.cli.where import Where
from swarmctl.deploy import host_records, observe_host, rollout
from swarmctl.health import collect, host_logs, report_archive
from swarmctl.health.host_logs import Entry, HostLog
from swarmctl.plan.plan import HostPlan, Plan
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind, Target
from swarmctl.swarm.topic_island import MotionTopics
from tests.health.swarm_values import HOSTS, K3_PI, LAPTOP, all_well, graph, with_device

PIN = "pin-71#4"
AWAY = HostError(Kind.UNREACHABLE, "connect timed out")


class Swarm:
    """A swarm of made up hosts, in a folder with its spec."""

    def __init__(self, spec: Path, output: pytest.CaptureFixture[str]) -> None:
        self.spec, self.file, self._output = spec, spec.parent / "r.tar.gz", output
        self.answers: dict[str, Any] = dict(all_well())
        self.message = f"the PIN is {PIN}"
        self.edits: list[EditedFile] | HostError = []

    def probe(self, *_: Any, **__: Any) -> dict[str, Any]:
        return self.answers

    def logs(self, *_: Any, **__: Any) -> Any:
        for host in HOSTS:
            log = HostLog([Entry(1.0, host, "k3", "info", self.message)], 0.0, cut=False)
            yield Finished(host, AWAY if self.answers[host] is AWAY else log, 0.0)

    def observe(self, bundles: Any, *_: Any, **__: Any) -> Plan:
        return Plan("newswarm", tuple(HostPlan(host, None, "a" * 16) for host in bundles))

    def edited(self, bundles: Any, *_: Any, **__: Any) -> dict[str, Any]:
        return {host: self.edits if host == K3_PI else [] for host in bundles}

    def typed(self, *words: str) -> tuple[int, str, str]:
        code = run(words)
        printed = self._output.readouterr()
        return code, printed.out, printed.err

    def report(self) -> tuple[int, str, str]:
        return self.typed("report", str(self.spec), "-o", str(self.file))

    def texts(self) -> dict[str, str]:
        with tarfile.open(self.file) as tar:
            return {
                one.name.partition("/")[2]: content.read().decode()
                for one in tar
                if (content := tar.extractfile(one)) is not None
            }


@pytest.fixture
def swarm(
    leader_spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Swarm:
    found = Swarm(Path(shutil.copy(leader_spec, tmp_path)), capsys)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("SWARMCTL_SECRET_EPUCK_PIN", PIN)
    monkeypatch.setattr(collect, "probe_hosts", found.probe)
    monkeypatch.setattr(host_logs, "host_logs", found.logs)
    monkeypatch.setattr(rollout, "observe", found.observe)
    monkeypatch.setattr(observe_host, "edits_on_hosts", found.edited)
    unchanged = Answer([], None, "", [], [], "")
    monkeypatch.setattr(
        host_records, "histories", lambda *_, **__: [Finished(host, unchanged, 0.0) for host in HOSTS]
    )
    reach = {host.name: Target(host.name, host.address, "robot") for host in graph().hosts}
    monkeypatch.setattr(Where, "targets", lambda *_, **__: reach)
    return found


def test_the_archive_has_what_was_edited_on_hosts(swarm: Swarm) -> None:
    swarm.edits = [
        EditedFile(K3_PI, "params/k3.yaml", "params/k3.yaml", f"pin: {PIN}\n", "0" * 64),
        EditedFile(K3_PI, "hosts/block", "/etc/hosts", "10.0.0.9 printer\n", "0" * 64),
        EditedFile(K3_PI, "../../up", "../../up", "x", "0" * 64),
        EditedFile(K3_PI, "urdf/k3.urdf", "urdf/k3.urdf", None, "0" * 64),
    ]
    assert swarm.report()[0] == exit_codes.OK
    assert {name: text for name, text in swarm.texts().items() if name.startswith("edits/")} == {
        "edits/k3-pi/params/k3.yaml": "pin: (secret epuck-pin)\n",
        "edits/k3-pi/etc/hosts": "10.0.0.9 printer\n",
    }


@pytest.mark.parametrize("options", [(), ("--details",), ("--json",)])
def test_the_archive_shows_what_status_had_shown(swarm: Swarm, options: tuple[str, ...]) -> None:
    swarm.answers[K3_PI] = with_device("k3", exists=False)(swarm.answers[K3_PI])
    code, shown, _ = swarm.typed("status", str(swarm.spec), *options)
    assert "/dev/swarm/k3 does not exist" in shown
    assert swarm.report()[0] == exit_codes.OK
    again = swarm.typed("status", "--from", str(swarm.file), *options)
    assert again[:2] == (code, shown)
    assert again[2].startswith("taken 20")


def test_the_archive_says_what_shows_how_robots_move(swarm: Swarm) -> None:
    start = "start: {x: 1.0, y: 0.5, heading_deg: 180}"
    swarm.spec.write_text(swarm.spec.read_text().replace("type: koala,", f"type: koala, {start},"))
    swarm.report()
    topics, starts = report_archive.motion(swarm.file)
    assert topics["koala"] == MotionTopics("/koala/odom", "/koala/cmd_vel", "/koala/battery")
    assert topics.keys() == {"koala", "k3", "epuck"}
    assert starts == {"koala": (1.0, 0.5, math.pi)}


def test_a_host_that_is_away_costs_only_its_part(swarm: Swarm) -> None:
    swarm.answers[K3_PI] = AWAY
    code, printed, complaints = swarm.report()
    assert code == exit_codes.HOSTS_UNREACHABLE
    assert printed.startswith(str(swarm.file))
    assert "missing: k3-pi: connect timed out" in complaints
    texts = swarm.texts()
    assert "missing: k3-pi: connect timed out" in texts["README.txt"]
    assert [json.loads(line)["host"] for line in texts["logs.jsonl"].splitlines()] == [LAPTOP, "epuck-pi"]
    assert swarm.typed("status", "--from", str(swarm.file))[0] == exit_codes.HOSTS_UNREACHABLE


def test_no_text_has_a_secret(swarm: Swarm) -> None:
    swarm.spec.write_text(f"# {PIN}\n{swarm.spec.read_text()}")
    swarm.report()
    texts = swarm.texts()
    assert texts["spec/swarm.yaml"].startswith("# (secret epuck-pin)\n")
    assert json.loads(texts["logs.jsonl"].splitlines()[0])["message"] == "the PIN is (secret epuck-pin)"
    assert not [name for name, text in texts.items() if PIN in text]


def test_a_secret_that_is_not_known_is_named(swarm: Swarm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SWARMCTL_SECRET_EPUCK_PIN")
    assert "not known here, so not looked for: epuck-pin" in swarm.report()[2]


SECRETS = st.dictionaries(st.sampled_from(["a", "b"]), st.text(r'0789#"\ é' + "\n", min_size=4), max_size=2)


@given(SECRETS, st.lists(st.text(r'0789#"\ é' + "\n")), st.text("x07\n"))
def test_no_secret_is_left_in_any_string(secrets: dict[str, str], texts: list[str], between: str) -> None:
    strings = [*texts, *(f"{between}{one}{between}" for one in secrets.values()), "".join(secrets.values())]
    clean = report_archive.remover(secrets)
    for text in clean({"key": strings})["key"]:
        assert not [one for one in secrets.values() if one in text]


def test_each_line_of_a_key_is_a_secret() -> None:
    clean = report_archive.remover({"key": "-----BEGIN KEY-----\nMIIEvgIBADANBg\n"})
    assert clean(["read MIIEvgIBADANBg", 7]) == ["read (secret key)", 7]


def test_an_old_archive_stays(swarm: Swarm) -> None:
    swarm.file.write_bytes(b"old")
    code, _, complaints = swarm.report()
    assert (code, swarm.file.read_bytes()) == (exit_codes.ERROR, b"old")
    assert "exists already" in complaints


def _truncated(data: bytes) -> bytes:
    return data[: len(data) // 2]


def _without_status(_: bytes) -> bytes:
    return report_archive.packed("s", {"look.json": "{}"}, 0.0)


def _bomb(data: bytes) -> bytes:
    return gzip.compress(gzip.decompress(data) + bytes(report_archive.MOST_BYTES), 1)


@pytest.mark.parametrize("damage", [_truncated, _without_status, _bomb, lambda _: b"", lambda _: b"text"])
def test_a_damaged_archive_is_one_line(swarm: Swarm, damage: Any) -> None:
    swarm.report()
    swarm.file.write_bytes(damage(swarm.file.read_bytes()))
    code, shown, complaints = swarm.typed("status", "--from", str(swarm.file))
    assert (code, shown) == (exit_codes.ERROR, "")
    assert complaints.startswith(f"error: {swarm.file} ")
    assert "help: `swarmctl report` writes one" in complaints


@pytest.mark.parametrize("more", [("SPEC",), ("--watch",), ("--wait",), ("--lab",)])
def test_an_archive_excludes_what_concerns_hosts(swarm: Swarm, more: tuple[str, ...]) -> None:
    swarm.report()
    words = [str(swarm.spec) if one == "SPEC" else one for one in more]
    assert swarm.typed("status", *words, "--from", str(swarm.file))[0] == exit_codes.USAGE
