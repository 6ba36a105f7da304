"""The agent's verb ``probe``: facts of a host and its graph, each part on its own."""

from __future__ import annotations

import itertools
import json
import os
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlsplit

import pytest
from swarm_onboard.agent import systemd, unit_journal
from swarm_onboard.agent.observations import MasterSeen, PeerSeen, SenderSeen, SimulatedTimeSeen
from swarm_onboard.agent.unit_journal import Message
from swarm_onboard.agent.verbs import probe
from swarm_onboard.agent.verbs.probe import Answer, Request
from swarm_onboard.ros1_probe import nodes, observe

from swarmctl.remote.answer_check import checked, parsed
from swarmctl.resources import host_check_names
from tests.onboard.host_checks.hosts import program, with_unit
from tests.onboard.ros1_probe.ros_fakes import (
    FakeRos,
    diagnostics,
    header,
    peer,
    publishing,
    received_header,
    served,
    slave,
)
from tests.timing import wait_for

TWIST = "geometry_msgs/Twist"
ODOM = "nav_msgs/Odometry"
TOPICS = {"/k3/odom": 0.5, "/diagnostics": 0.5}
KINDS = {"/k3/odom": ODOM, "/diagnostics": "diagnostic_msgs/DiagnosticArray"}


@pytest.fixture
def prefix(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A host whose current release is 0123456789abcdef, and which has a systemctl."""
    home = tmp_path / "opt/swarm/test"
    (home / "releases/0123456789abcdef").mkdir(parents=True)
    (home / "current").symlink_to("releases/0123456789abcdef")
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    systemctl(tmp_path, monkeypatch, RUNNING)
    return tmp_path


RUNNING = """\
Id=swarm-test.k3.service
LoadState=loaded
ActiveState=active
SubState=running
Result=success
StatusText=
MainPID=42
NRestarts=$restarts
ConditionResult=yes
ConditionTimestampMonotonic=12
"""


def systemctl(folder: Path, monkeypatch: pytest.MonkeyPatch, answer: str) -> None:
    """A ``systemctl`` that prints ``answer``, where ``$restarts`` grows with every look; a ``journalctl``."""
    program = folder / "bin" / "systemctl"
    program.parent.mkdir(exist_ok=True)
    count = folder / "calls"
    program.write_text(
        f'#!/bin/sh\ncase "$*" in *NRestarts*) echo >> {count};; esac\n'
        f"restarts=$(wc -l < {count})\ncat <<END\n{answer}END\n",
        encoding="utf-8",
    )
    program.chmod(0o755)
    journal = program.with_name("journalctl")
    journal.write_text(f"#!/bin/sh\ncat {folder}/journal 2>/dev/null || true\n", encoding="utf-8")
    journal.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)


@pytest.fixture
def graph() -> Iterator[tuple[FakeRos, str]]:
    """A master that knows /k3/driver, which publishes odometry at 20 Hz and says that its port is missing."""
    with ExitStack() as stack:
        ports = {
            "/k3/odom": stack.enter_context(peer(publishing(ODOM, 20.0))),
            "/diagnostics": stack.enter_context(
                peer(publishing(KINDS["/diagnostics"], 10.0, diagnostics(2, "no serial port")))
            ),
        }
        node = stack.enter_context(served(slave(ports, KINDS, {"/k3/cmd_vel": TWIST})))
        joystick = stack.enter_context(
            served(slave({}, {"/k3/cmd_vel": TWIST, "/rosout": "rosgraph_msgs/Log"}))
        )
        fake = FakeRos({"/k3/driver": node, "/joystick": joystick}, {"/k3/cmd_vel": ["/joystick"]})
        yield fake, stack.enter_context(served(fake.functions()))


def probed(master: str, **other: Any) -> Answer:
    request = Request(
        "test",
        "swarm_onboard.ros1_probe.observe",
        units=["swarm-test.k3.service"],
        master=master,
        nodes={"/k3/driver": TOPICS},
        commands=["/k3/cmd_vel"],
        devices=["/dev/null", "/dev/swarm/none"],
        advertised="127.0.0.1",
        restart_window=600.0,
        checks=["memory"],
    )
    answer = probe.handle(request._replace(**other), b"", None)  # type: ignore[arg-type]
    return checked(parsed(json.dumps(answer._asdict())), Answer, "whatever nodes and masters say")


def test_a_healthy_host_reports_everything(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(probe, "time", SimpleNamespace(time=lambda: 1_700_000_000.0))

    def with_rate() -> Answer | None:
        found = probed(graph[1])
        return found if found.nodes["/k3/driver"].topics["/k3/odom"].rate else None

    answer = wait_for(with_rate)
    assert answer.troubles == {}
    assert answer.release == "0123456789abcdef"
    assert answer.units["swarm-test.k3.service"].runs
    assert answer.master is not None
    assert answer.master.run_id == "run-1"
    node = answer.nodes["/k3/driver"]
    assert (node.registered, node.alive, node.pid) == (True, True, 42)
    assert node.subscribes == {"/k3/cmd_vel": TWIST}
    assert node.publishes == KINDS
    assert node.topics["/k3/odom"].rate
    assert node.report is not None
    assert (node.report.level, node.report.message) == (2, "no serial port")
    assert answer.commanders == {"/k3/cmd_vel": ["/joystick"]}
    assert answer.senders == {"/joystick": SenderSeen("127.0.0.1", {"/k3/cmd_vel": TWIST})}
    assert answer.time == 1_700_000_000.0
    assert answer.boot_id


def test_topics_of_a_commands_type_are_reported_unnamed(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    fake, uri = graph
    fake.types.update({"/cmd_vel": TWIST, "/text": "std_msgs/String"})
    fake.publishers["/cmd_vel"] = ["/joystick"]
    answer = probed(uri, command_types=[TWIST])
    assert answer.commanders == {"/k3/cmd_vel": ["/joystick"], "/cmd_vel": ["/joystick"]}
    assert answer.receivers["/cmd_vel"] == []


def clock(step: int, rate: float = 40.0) -> Callable[[socket.socket], None]:
    """Behaves like a publisher of /clock at ``rate`` Hz whose time moves by ``step`` ns with each message."""

    def behave(connection: socket.socket) -> None:
        received_header(connection)
        connection.sendall(header(callerid="/sim", md5sum="0" * 32, type="rosgraph_msgs/Clock"))
        for count in itertools.count():
            connection.sendall(struct.pack("<III", 8, 1000 + count * step // 10**9, count * step % 10**9))
            time.sleep(1 / rate)

    return behave


@pytest.mark.parametrize(
    ("step", "publishers", "moves"),
    [(10**8, ["/sim"], True), (0, ["/sim"], False), (0, ["/gone"], None), (0, [], None)],
    ids=["moves", "stands", "its node is gone", "nothing publishes it"],
)
def test_the_clock_of_simulated_time_is_measured(
    step: int, publishers: list[str], moves: bool | None, prefix: Path
) -> None:
    with ExitStack() as stack:
        port = stack.enter_context(peer(clock(step)))
        uri = stack.enter_context(served(slave({"/clock": port}, {"/clock": "rosgraph_msgs/Clock"})))
        fake = FakeRos({"/sim": uri}, {"/clock": publishers}, parameters={"/use_sim_time": True})
        seen = probed(stack.enter_context(served(fake.functions())), nodes={}, clock=0.4)
    found = seen.simulated_time
    assert found is not None
    assert (found.used, found.publishers) == (True, publishers)
    assert (None if found.moved is None else found.moved > 0) is moves
    assert bool(found.error) is (publishers == ["/gone"])
    assert found.now is None if moves is None else found.now is not None and found.now >= 1000


@pytest.mark.parametrize(("value", "used"), [(None, False), (False, False), (True, True), (1, True)])
def test_simulated_time_of_a_master_is_read(value: Any, used: bool, prefix: Path) -> None:
    parameters = {} if value is None else {"/use_sim_time": value}
    fake = FakeRos(parameters=parameters)
    with served(fake.functions()) as uri:
        answer = probed(uri, nodes={}, commands=[], clock=0.0)
    assert answer.simulated_time == SimulatedTimeSeen(used, [])
    assert "getSystemState" not in fake.calls
    assert answer.troubles == {}


def test_the_probe_registers_nothing(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    probed(graph[1])
    assert set(graph[0].calls) == {"getPid", "getParam", "lookupNode", "getSystemState"}


def test_parameters_that_are_not_as_the_node_set_them_are_named(
    prefix: Path, graph: tuple[FakeRos, str]
) -> None:
    wanted = {"port": "/dev/k3", "limits": {"linear": 0.3, "angular": 2.0}, "rates": {"odom": 10.0}}
    looks: Any = {"nodes": {"/k3/driver": {}}, "parameters": {"/k3/driver": wanted}}
    for seen, found in (
        (wanted, []),
        (
            {"port": "/dev/k3", "limits": {"linear": 9.0}, "rates": 1},
            ["limits/linear is 9.0 instead of 0.3", "limits/angular is not set", "rates/odom is not set"],
        ),
        ("what is no dictionary", ["port is not set", "limits is not set", "rates is not set"]),
    ):
        graph[0].parameters["/k3/driver"] = seen
        assert probed(graph[1], **looks).nodes["/k3/driver"].parameters == found
    graph[0].parameters["/k3/driver"] = None
    unset = [f"{name} is not set" for name in wanted]
    assert probed(graph[1], **looks).nodes["/k3/driver"].parameters == unset


@pytest.mark.parametrize("method", ["getParam", "lookupNode"])
def test_a_call_that_the_master_does_not_answer_is_not_taken_for_a_no(
    prefix: Path, graph: tuple[FakeRos, str], method: str
) -> None:
    known = graph[0].functions()[method]

    def answer(caller: str, name: str) -> Any:
        if name.startswith("/k3"):
            raise TimeoutError  # any answer that is none of a master
        return known(caller, name)

    looks: Any = {"nodes": {"/k3/driver": {}}, "parameters": {"/k3/driver": {"port": "/dev/k3"}}}
    with served({**graph[0].functions(), method: answer}) as uri:
        found = probed(uri, **looks).nodes["/k3/driver"]
    assert found.registered is (True if method == "getParam" else None)
    assert found.parameters is None


def test_a_systemd_that_does_not_answer_is_called_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, graph: tuple[FakeRos, str]
) -> None:
    """The robot's record and drop-ins of its unit are looked at through systemd, as is a launch file."""
    unit = "swarm-new.k3.service"
    text = b"[Service]\nStateDirectory=swarm-commands/new/k3\n"
    with_unit(tmp_path, unit, text, {f"/etc/systemd/system/{unit}": f"units/{unit}"})
    monkeypatch.setenv("SWARM_PREFIX", str(tmp_path))
    program(tmp_path, monkeypatch, "systemctl", f"echo >> {tmp_path}/calls; exec sleep 60")
    monkeypatch.setattr(systemd, "_ANSWERS_WITHIN", 0.5)
    launched: Any = {unit: {}}
    answer = probed(graph[1], swarm="new", units=[unit], checks=list(host_check_names()), launched=launched)
    assert (tmp_path / "calls").read_text() == "\n"
    assert answer.troubles == {"systemd": "does not answer"}
    assert answer.units == {}
    assert answer.nodes["/k3/driver"].alive


def test_what_a_release_requires_and_the_host_lacks_is_named(
    prefix: Path, graph: tuple[FakeRos, str]
) -> None:
    """The test for it is the one before a deploy; files of a package alone make it one that is there."""
    share = prefix / "usr/share/tf2_ros"
    share.mkdir(parents=True)
    (share / "package.xml").touch()
    wanted = ["package:tf2_ros", "package:move_base", "workspace:/home/robot/ws", "podman"]
    assert probed(graph[1], requires=wanted).lacks == wanted[1:]
    (share / "package.xml").unlink()
    assert probed(graph[1], requires=wanted).lacks == wanted


def test_restarts_during_the_probe_are_counted(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    state = probed(graph[1]).units["swarm-test.k3.service"]
    assert (state.restarts, state.restarted) == (2, 1)


def test_a_restart_under_way_as_the_probe_begins_is_counted(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    starting = "$([ $restarts = 1 ] && echo activating || echo active)"
    text = RUNNING.replace("=$restarts", "=1").replace("ActiveState=active", f"ActiveState={starting}")
    systemctl(prefix, monkeypatch, text)
    state = probed(graph[1]).units["swarm-test.k3.service"]
    assert (state.active, state.restarts, state.restarted) == ("active", 1, 1)


def test_what_a_unit_says_of_itself_is_cut(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    systemctl(prefix, monkeypatch, RUNNING.replace("StatusText=", f"StatusText={'waits ' * 1000}"))
    assert len(probed(graph[1]).units["swarm-test.k3.service"].text) == 200


def test_a_node_that_another_ends_during_the_probe_is_a_conflict(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    line = Message(time.time(), "shutdown request: [/k3/driver] Reason: new node registered with same name")
    monkeypatch.setattr(unit_journal, "messages", lambda unit, since: [line])
    assert list(probed(graph[1]).conflicts["swarm-test.k3.service"]) == ["/k3/driver"]


def test_the_name_of_a_driver_that_goes_on_may_be_a_conflict(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    systemctl(prefix, monkeypatch, RUNNING.replace("$restarts", "0"))
    text = "shutdown request: [/k3/driver] Reason: new node registered with same name"
    entry = {"MESSAGE": text, "_SYSTEMD_UNIT": "swarm-test.k3.service", "__REALTIME_TIMESTAMP": "1"}
    (prefix / "journal").write_text(json.dumps(entry) + "\n", encoding="utf-8")
    assert probed(graph[1]).conflicts["swarm-test.k3.service"]["/k3/driver"].count == 1


def test_a_dead_master_costs_the_graph_only(prefix: Path) -> None:
    answer = probed("http://127.0.0.1:9")
    assert answer.master == MasterSeen(False, "connection refused")
    assert answer.nodes == {}
    assert answer.release == "0123456789abcdef"
    assert answer.units


def test_a_master_without_its_parameters_answers(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    graph[0].parameters["/run_id"] = None
    answer = probed(graph[1])
    assert (answer.master.reachable, answer.master.run_id) == (True, "")
    assert answer.nodes["/k3/driver"].alive


def test_a_node_that_is_gone_keeps_its_registration(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    fake, uri = graph
    fake.nodes["/k3/driver"] = "http://127.0.0.1:9/"
    node = probed(uri).nodes["/k3/driver"]
    assert (node.registered, node.alive, node.error) == (True, False, "connection refused")


def test_an_unknown_node_is_not_registered(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    graph[0].nodes.clear()
    assert probed(graph[1]).nodes["/k3/driver"].registered is False


@pytest.mark.parametrize("uri", ["http://127.0.0.1:9/", "nonsense", None])
def test_a_sender_that_is_gone_publishes_nothing(
    prefix: Path, graph: tuple[FakeRos, str], uri: str | None
) -> None:
    """It is still registered, as after a SIGKILL."""
    fake, master = graph
    del fake.nodes["/joystick"]
    if uri is not None:
        fake.nodes["/joystick"] = uri
    answer = probed(master)
    assert answer.commanders == {"/k3/cmd_vel": ["/joystick"]}
    assert answer.senders["/joystick"].publishes == {}
    assert answer.troubles == {}


@pytest.mark.parametrize("value", [True, -1, "42", [], 1.5])
def test_a_process_number_that_is_none_costs_no_more_than_itself(
    prefix: Path, graph: tuple[FakeRos, str], value: Any
) -> None:
    with served({**graph[0].functions(), "getPid": lambda caller: [1, "", value]}) as uri:
        answer = probed(uri)
    assert answer.master.reachable


def test_nodes_of_other_hosts_are_connected_to(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    fake, master = graph
    fake.nodes["/dead"] = "http://127.0.0.1:9/"
    peers = ["/k3/driver", "/dead", "/never_registered"]
    answer = probed(master, peers=peers, inputs=["/k3/cmd_vel", "/map"], advertised="10.0.0.1")
    assert answer.troubles == {}
    assert answer.peers == {
        "/k3/driver": PeerSeen(fake.nodes["/k3/driver"], []),
        "/dead": PeerSeen("http://127.0.0.1:9/", [], 9, "127.0.0.1:9: connection refused"),
        "/joystick": PeerSeen(fake.nodes["/joystick"], ["/k3/cmd_vel"]),
    }
    assert urlsplit(master).port in answer.listening
    assert 9 not in answer.listening


def test_nodes_of_the_same_host_are_not(prefix: Path, graph: tuple[FakeRos, str]) -> None:
    assert probed(graph[1], peers=["/k3/driver"], inputs=["/k3/cmd_vel"]).peers == {}


def test_other_publishers_of_a_topic_are_reported_with_their_host(
    prefix: Path, graph: tuple[FakeRos, str]
) -> None:
    wanted = {"/k3/cmd_vel": ["/k3/teleop"], "/k3/odom": ["/k3/driver"]}
    answer = probed(graph[1], publishers=wanted)
    assert answer.others == {"/k3/cmd_vel": ["/joystick"]}
    assert answer.senders["/joystick"].host == "127.0.0.1"
    assert probed(graph[1], publishers={"/k3/cmd_vel": ["/joystick"]}).others == {}


@pytest.mark.parametrize("state", [7, [], ["x"], [[["/k3/cmd_vel"]]], [[[1, 2]]], [{"a": 1}]])
def test_a_master_that_talks_nonsense_costs_the_commanders_only(
    prefix: Path, graph: tuple[FakeRos, str], state: Any
) -> None:
    functions = {**graph[0].functions(), "getSystemState": lambda caller: [1, "", state]}
    with served(functions) as uri:
        answer = probed(uri, inputs=["/k3/cmd_vel"])
    assert {"commanders", "peers"} <= answer.troubles.keys()
    assert answer.nodes["/k3/driver"].alive is True


@pytest.mark.parametrize("topics", [7, "abc", [7], [["a"]], [["a", "b", "c"]], {"a": "b"}])
def test_a_node_that_talks_nonsense_is_not_alive(
    prefix: Path, graph: tuple[FakeRos, str], topics: Any
) -> None:
    with served({**slave({}, {}), "getPublications": lambda caller: [1, "", topics]}) as uri:
        graph[0].nodes["/k3/driver"] = uri
        node = probed(graph[1]).nodes["/k3/driver"]
    assert node.alive is False
    assert node.error == "its list of topics makes no sense"


def test_a_bug_in_a_part_of_the_graph_costs_that_part_only(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observe, "_first_names", lambda side: side.nothing)
    answer = probed(graph[1], inputs=["/k3/cmd_vel"])
    assert answer.troubles.keys() == {"commanders"}
    assert answer.nodes["/k3/driver"].alive


def test_the_host_is_looked_at_while_the_graph_is(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The look at the graph ends only after the devices of the host have been looked at."""
    begun = threading.Event()
    device = probe.device
    monkeypatch.setattr(probe, "device", lambda path: begun.set() or device(path))
    monkeypatch.setattr(observe, "observe", lambda _, known: known._replace(seen=7 if begun.wait(30) else 0))
    answer = probed("", nodes={}, commands=[])
    assert (answer.seen, answer.devices.keys()) == (7, {"/dev/null", "/dev/swarm/none"})


def test_a_systemd_that_fails_costs_the_units_only(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (prefix / "bin/systemctl").write_text("#!/bin/sh\necho Failed to connect to bus >&2; exit 1\n", "utf-8")
    answer = probed(graph[1])
    assert "Failed to connect to bus" in answer.troubles["units"]
    assert answer.units == {}
    assert answer.nodes["/k3/driver"].alive is True


def test_a_part_that_fails_after_the_graph_was_seen_is_named_too(
    prefix: Path, graph: tuple[FakeRos, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    script = (prefix / "bin/systemctl").read_text()
    fails = f'case "$*" in *NRestarts*) [ $(wc -l < {prefix}/calls) = 2 ] && exit 1;; esac\ncat <<END'
    (prefix / "bin/systemctl").write_text(script.replace("cat <<END", fails))
    answer = probed(graph[1])
    assert answer.troubles.keys() == {"units"}
    assert answer.units == {}
    assert answer.nodes["/k3/driver"].alive


def test_without_a_release_there_is_none(prefix: Path) -> None:
    (prefix / "opt/swarm/test/current").unlink()
    assert probed("http://127.0.0.1:9").release is None


def test_devices_are_looked_at(prefix: Path, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    link = tmp_path / "link"
    link.symlink_to("/dev/null")
    assert probe.device(str(file)).is_device is False
    assert probe.device(str(link)).resolves == "/dev/null"
    assert probe.device(str(link)).is_device is True
    assert probe.device(str(link)).usable is False
    assert probe.device("/dev/swarm/none").exists is False


def test_dialout_makes_a_device_usable(monkeypatch: pytest.MonkeyPatch) -> None:
    class Group:
        gr_name = "dialout"

    monkeypatch.setattr(probe.grp, "getgrgid", lambda gid: Group)
    assert probe.device("/dev/null").usable is True


def test_a_request_cannot_listen_for_ever(prefix: Path, graph: tuple[FakeRos, str], monkeypatch: Any) -> None:
    monkeypatch.setattr(nodes, "LONGEST_LISTENING", 0.2)
    endless = {"/k3/driver": {"/k3/odom": 1e9}}
    assert probed(graph[1], nodes=endless).nodes["/k3/driver"].topics["/k3/odom"].seconds == 0.2
