"""``--executor dask://``: the workers of a real cluster have the sessions, or an error has the reason."""

from __future__ import annotations

import importlib.util
import os
import signal
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from swarmctl import __version__
from swarmctl.remote import dask_cluster, parallel_hosts
from swarmctl.remote.dask_cluster import Address, ClusterError, address_of
from swarmctl.remote.parallel_hosts import Finished, Note, Started, not_started
from swarmctl.remote.transport import HostError, Kind
from tests import ROOT
from tests.deploy.deploying import deploy
from tests.deploy.test_rollout import TARGETS, FolderTransport, bundles, changed, deployed, hosts
from tests.in_process import swarmctl
from tests.onboard.agent.fakehost import FakeHost
from tests.remote.test_workers import Hosts, question, targets
from tests.timing import wait_for

__all__ = ["hosts"]
SPEC = str(ROOT / "examples/paper-leader/swarm.yaml")
needs_dask = pytest.mark.skipif(not importlib.util.find_spec("distributed"), reason="needs swarmctl[scale]")


def two_workers() -> Any:
    import distributed

    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, memory_limit=0, silence_logs=False
    )


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with two_workers() as found:
        yield found


@pytest.fixture
def doomed() -> Iterator[Any]:
    """A cluster of which a worker is killed: another one may take long to come, or not come."""
    with two_workers() as found:
        yield found


def address_in(cluster: Any) -> Address:
    return address_of(cluster.scheduler_address.replace("tcp", "dask"))


@pytest.fixture
def address(cluster: Any) -> Address:
    return address_in(cluster)


@needs_dask
def test_a_killed_worker_costs_its_host_and_the_others_go_on(doomed: Any) -> None:
    with dask_cluster.workers(address_in(doomed), login=Hosts) as workers:
        events = parallel_hosts.run(targets("silent1", "a", "b"), question, transport=workers, parallel=2)
        seen = [next(events) for _ in range(8)]  # all but the end of the first
        assert [type(event) for event in seen if event.host == "a"] == [Started, Note, Finished]
        (note,) = (event.text for event in seen if isinstance(event, Note) and event.host == "silent1")
        pid = int(note.split()[-1])
        assert pid != os.getpid()
        os.kill(pid, signal.SIGKILL)
        (last,) = events
        assert isinstance(last, Finished)
        assert isinstance(last.outcome, HostError)
        assert last.outcome.kind is Kind.LOST
        assert "was lost while it was connected to silent1" in last.outcome.message
        (after,) = (
            event.outcome
            for event in parallel_hosts.run(targets("c"), question, transport=workers, parallel=4)
            if isinstance(event, Finished)
        )
        assert after == {"host": "c"}


@needs_dask
def test_what_a_killed_worker_has_begun_another_one_confirms(doomed: Any, hosts: dict[str, FakeHost]) -> None:
    import distributed

    with distributed.Client(doomed, set_as_default=False) as client:
        first = next(iter(client.scheduler_info(n_workers=-1)["workers"]))
        pid = client.run(os.getpid)[first]
    one = {"k3": bundles()["k3"]}
    with dask_cluster.workers(address_in(doomed), login=partial(FolderTransport, hosts, {})) as workers:
        ends, killed = [], False
        for event in deploy(one, TARGETS, workers):
            ends.append(event)
            if isinstance(event, Note) and event.text.startswith("starting"):
                os.kill(pid, signal.SIGKILL)
                killed = True
        assert killed
    assert changed(deployed(iter(ends))) == {"k3": True}
    assert hosts["k3"].observe().transaction.state == "applied"


def profiles(dask_worker: Any) -> bool:
    found = dask_worker.periodic_callbacks.get("profile")
    return found is not None and bool(found.is_running())


@needs_dask
def test_no_profiler_runs_beside_the_threads_of_a_worker(cluster: Any, address: Address) -> None:
    import distributed

    with distributed.Client(cluster, set_as_default=False) as client:
        with dask_cluster.workers(address, login=Hosts) as workers:
            list(parallel_hosts.run(targets("a", "b"), question, transport=workers, parallel=4))
        assert set(client.run(profiles).values()) == {False}


@needs_dask
def test_ctrl_c_skips_hosts_and_again_ends_those_of_workers(address: Address) -> None:
    with (
        dask_cluster.workers(address, login=Hosts) as workers,
        parallel_hosts.interruptible() as stop,
    ):
        events = parallel_hosts.run(
            targets("silent1", "a"), question, transport=workers, parallel=1, stop=stop
        )
        assert [type(next(events)) for _ in range(2)] == [Started, Note]
        os.kill(os.getpid(), signal.SIGINT)
        wait_for(lambda: stop.requested)
        os.kill(os.getpid(), signal.SIGINT)
        ended, skipped = events
    assert isinstance(ended, Finished)
    assert isinstance(ended.outcome, HostError)
    assert ended.outcome.kind is Kind.STOPPED
    assert skipped == not_started("a")


@needs_dask
def test_a_verb_reports_what_workers_found(
    address: Address, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    (spec := tmp_path / "swarm.yaml").write_text(ONE_HOST)
    ran = swarmctl("plan", str(spec), "--executor", address.text)
    assert ran.returncode == 4, ran.stderr
    assert "(from worker tcp://127.0.0.1:" in " ".join(ran.stdout.split())


@needs_dask
def test_workers_with_another_swarmctl_are_refused(address: Address, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "__version__", "99.1")
    with (
        pytest.raises(ClusterError, match=r"the workers do not fit: swarmctl \S+ at tcp") as found,
        dask_cluster.workers(address),
    ):
        raise AssertionError
    assert "pip install swarmctl==99.1" in found.value.fix


@pytest.mark.parametrize(
    ("packages", "python", "complaint"),
    [
        ({"swarmctl": None}, sys.version, "no swarmctl at tcp://a:1"),
        ({"swarmctl": "0.0.0"}, sys.version, "swarmctl 0.0.0 at tcp://a:1"),
        ({"swarmctl": __version__}, "3.7.1.final.0", "Python 3.7 at tcp://a:1"),
    ],
)
def test_workers_that_do_not_fit_are_named(
    packages: dict[str, str | None], python: str, complaint: str
) -> None:
    good = {"host": {"python": sys.version}, "packages": {"swarmctl": __version__}}
    other = {"host": {"python": python}, "packages": packages}
    dask_cluster.check_versions({"workers": {"tcp://b:1": good}})
    with pytest.raises(ClusterError) as found:
        dask_cluster.check_versions({"workers": {"tcp://a:1": other, "tcp://b:1": good}})
    assert str(found.value) == f"the workers do not fit: {complaint}"


@needs_dask
def test_secrets_take_no_open_way_to_other_machines(
    address: Address, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_cluster, "on_loopback", lambda _: False)
    refused = pytest.raises(ClusterError, match="is not encrypted, and hosts of this swarm need secrets")
    with refused as found, dask_cluster.workers(address, secrets=True):
        raise AssertionError
    assert "dask+tls://HOST:PORT" in found.value.fix


@pytest.mark.parametrize("verb", ["plan", "deploy"])
def test_verbs_announce_that_they_send_secrets(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    seen = []

    def refuse(address: Address, *, login: object, secrets: bool) -> Any:
        seen.append(secrets)
        raise ClusterError("no", "yes")

    monkeypatch.setattr(dask_cluster, "workers", refuse)
    for pin in (None, "1234"):
        env = {"SWARMCTL_SECRET_EPUCK_PIN": pin}
        ran = swarmctl(verb, SPEC, "--executor", "dask://192.0.2.1:1", env=env)
        assert "error: --executor: no" in ran.stderr
    assert seen == [False, True]


def test_without_dask_the_error_names_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    ran = swarmctl("plan", SPEC, "--executor", "dask://192.0.2.1:8786")
    assert ran.returncode == 1
    assert 'pip install "swarmctl[scale]"' in ran.stderr


@pytest.mark.parametrize(
    "text",
    [
        "dask",
        "dask://",
        "dask://host",
        "dask://:8786",
        "dask://h:99999",
        "dask://h:1/x",
        "ssh://h:1",
        "tcp://h:1",
    ],
)
def test_what_is_no_address_is_an_error(text: str) -> None:
    with pytest.raises(ClusterError) as found:
        address_of(text)
    assert text in str(found.value)
    assert "dask://HOST:PORT" in found.value.fix


def test_an_address_may_ask_for_tls() -> None:
    assert address_of("dask://10.0.0.1:8786").dask == "tcp://10.0.0.1:8786"
    assert address_of("dask+tls://[fd00::1]:8786").dask == "tls://[fd00::1]:8786"


@needs_dask
def test_a_scheduler_that_does_not_answer_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_cluster, "CONNECT", 0.2)
    with (
        pytest.raises(ClusterError, match="no Dask scheduler answers at dask"),
        dask_cluster.workers(address_of("dask://127.0.0.1:1")),
    ):
        raise AssertionError


@pytest.mark.parametrize(
    ("addresses", "local"),
    [
        (["tcp://127.0.0.1:1", "tcp://[::1]:2"], True),
        (["tcp://127.0.0.1:1", "tcp://192.0.2.1:2"], False),
        (["tcp://scheduler:1"], False),
    ],
)
def test_secrets_are_sent_unencrypted_to_this_machine_only(addresses: list[str], local: bool) -> None:
    assert dask_cluster.on_loopback(addresses) is local


def test_a_lab_has_no_workers() -> None:
    ran = swarmctl("status", SPEC, "--lab", "--executor", "dask://127.0.0.1:1")
    assert ran.returncode == 64
    assert "exclude each other" in ran.stderr


ONE_HOST = """\
version: 1
name: far
mode: standalone
ros: {distro: noetic}
hosts:
  pi: {address: 127.0.0.1, port: 1, user: robot, computer: raspberry-pi-4b}
robots:
  k3: {type: khepera3, host: pi}
links:
  - {kind: serial, host: pi, robot: k3, usb: {serial: FTDI1234}}
"""
