"""Whatever a host answers to a request, the outcome is a value or that host's error, never an exception."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from swarm_onboard.agent.verbs import wireguard_key
from swarm_onboard.agent.verbs.probe import Answer

from swarmctl.deploy import flash, prepare, rollout
from swarmctl.deploy.outcome import Outcome, Removed
from swarmctl.deploy.rekey import exchanged
from swarmctl.firmware import avrdude
from swarmctl.health import collect
from swarmctl.plan.host_needs import HostNeeds, PackageRequirement
from swarmctl.plan.host_preparation import HostPreparation
from swarmctl.plan.plan import HostPlan
from swarmctl.plan.robots_in_use import Dependents
from swarmctl.remote import parallel_hosts
from swarmctl.remote.agent_client import agent_session
from swarmctl.remote.answer_check import DEEPEST, bounded
from swarmctl.remote.ask import ask
from swarmctl.remote.transport import HostError, Kind, Output, Target
from swarmctl.spec.model import Mode
from swarmctl.swarm.resolved import Swarm
from tests.deploy.deploying import deploy
from tests.health.swarm_values import graph
from tests.onboard.agent.fakehost import bundle

RELEASE = bundle("1")
PI = {"pi": Target("pi", "10.0.0.1", "root")}
UNIT = {
    "load": "loaded", "active": "active", "sub": "running", "result": "success", "text": "",
    "pid": 1, "restarts": 0, "skipped": False, "unmet": [],
    "unenforced": False, "restarted": 0,
}  # fmt: skip
FACTS = {
    "hostname": "pi", "machine": "armv7l", "python": "3.8.10", "systemd": True, "uid": 0, "boot_id": "b",
    "time": 1.0, "free_bytes": 1, "free_inodes": 1, "has": {"rospy": None}, "absent": [],
    "platform": "", "clock": None, "power_save": None,
}  # fmt: skip
TRANSACTION = {
    "txid": "", "state": "", "who": "", "previous": None, "next": None, "left": 0.0, "error": ""
}  # fmt: skip
OBSERVED = {
    "facts": FACTS, "release": None, "releases": [], "transaction": TRANSACTION, "staging": [], "lock": None,
    "drift": {"files": {}, "links": {}, "blocks": {}}, "units": {"koala.service": UNIT},
    "manifest": RELEASE.manifest, "uploaded": [], "foreign_units": [], "host_list": None,
    "wireguard_keys": [], "secrets": {}, "edits": {}, "edit_texts": {}, "busy": {}, "files": {}, "blocks": {},
}  # fmt: skip
ENTRY = {
    "time": 1.0, "txid": "t", "run": "r", "who": "anna@desk (7)", "previous": None, "next": None,
    "previous_secrets": "", "next_secrets": "", "state": "undone", "error": "",
}  # fmt: skip
MOTION = {
    "latched": True, "runs": True, "proof": "wheels", "seconds": 0.5, "commander": "", "trouble": "",
}  # fmt: skip
RECORDING = {
    "runs": True, "began": 1.0, "topics": ["/k3/odom"], "ended": "", "status": 0, "output": "",
    "bags": {"pi_0.bag": 1}, "free": 1,
}  # fmt: skip
FITTING: dict[str, Any] = {
    "observe": OBSERVED,
    "lease": {
        "granted": True, "epoch": 1, "run": "r", "who": "anna@desk (7)", "left": 60.0,
        "last": "", "last_who": "",
    },
    "apply": {"release": RELEASE.digest, "previous": None},
    "rollback": {"release": RELEASE.digest, "previous": None},
    "host_list": {"epoch": 1, "hosts": {}, "gone": {}},
    "wireguard_key": {"public": "oZW7F9q5HzxnPlYmVJ7CXp2NwtOGKGIoiCl5aOYLlTU=", "next": ""},
    "history": {
        "entries": [ENTRY], "release": None, "secrets": "", "releases": [], "secret_sets": [], "last": "",
    },
    "command_record": {"robots": ["k3"], "text": "{}\n"},
    "logs": {
        "clock": 1.0, "cursor": "", "cut": False,
        "entries": [{"time": 1.0, "unit": "k3.service", "priority": 6, "message": "m"}],
    },
    "stop": {"deployed": True, "elapsed": 0.1, "robots": {"k3": MOTION}},
    "start": {"deployed": True, "released": ["k3"]},
    "restart": {"deployed": True, "restarted": ["k3.service"]},
    "motion": {"in_use": {"k3": {"why": "is not confirmed to stand by its wheels", "commander": ""}}},
    "telemetry": {"sent": 5},
    "costs": {
        "clock": 1.0, "units": {"k3.service": {"cpu": 0.5, "memory": 50_000_000, "processes": 1}},
    },
    "record": RECORDING,
    "recording": RECORDING,
    "hold": {"units": {"koala.service": UNIT}},
    "confirm": {"release": RELEASE.digest},
    "undo": {"release": None},
    "remove": {"removed": True},
    "flash": {"runs": True, "logged": True},
    "probe": {"units": {"koala.service": UNIT}, "troubles": {}},
    "inventory": {
        "facts": FACTS, "debian": {"chrony": "installed"}, "pip": {"crcmod": None}, "groups": ["dialout"],
        "account": {"exists": True, "keys": True, "sudo": True, "groups": ["dialout"]},
        "workspaces": {"/home/robot/ws": "built"}, "rosdep": {"tf": ["ros-tf"]}, "sources": [],
        "images": [], "wireless": [],
    },
    "prepare": {"step": "apt"},
    "build_packages": {"platform": "bookworm-x86_64", "sizes": {"nav": 4}},
    "fetch_build": {"data": "AAAA"},
}  # fmt: skip
NEEDS = HostNeeds(
    "new",
    "pi",
    "root",
    "noetic",
    (PackageRequirement("", ("chrony",), ("time",)),),
    {},
    {"dialout": ("robots.k3",)},
)


class Session:
    """Answers each request with ``answer(verb)``, as the agent would print it."""

    def __init__(self, answer: Callable[[str], str]) -> None:
        self._answer = answer

    @contextmanager
    def channel(self, command: str, *, limit: int = 0) -> Iterator[Session]:
        _, starts_agent, rest = command.partition("' sh ")
        self._nonce = rest.split(" ", 1)[0] if starts_agent else ""
        yield self

    def exchange(
        self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float = 0.0
    ) -> Output:
        if not stdin:
            return Output(0, b"", b"")
        verb = json.loads(stdin[0])["verb"]
        printed = f"\n@{self._nonce} {self._answer(verb)}\n".encode()
        return Output(None if enough(printed) else 1, printed, b"")

    def close(self) -> None: ...


class Transport:
    def __init__(self, answer: Callable[[str], str]) -> None:
        self._answer = answer

    @contextmanager
    def connect(self, target: Target) -> Iterator[Session]:
        yield Session(self._answer)


LONE = Dependents(Swarm("new", Mode.CENTRAL, "noetic", None, {}, {}, (), ()))
JOB = flash.Job("new", "k3", "pi", "k3.service", "/dev/k3", "0" * 16, avrdude.Writing({}, ("avrdude",)))


def outcomes(transport: Transport) -> dict[str, Any]:
    """What each command makes of the answers: by verb the value or the error of the host."""
    plan = rollout.observe({"pi": RELEASE}, PI, transport, diff=True, parallel=4).hosts[0]
    (deployed,) = results(deploy({"pi": RELEASE}, PI, transport))
    (removed,) = results(rollout.remove(["pi"], PI, transport, dependents=LONE, parallel=4))
    (flashed,) = results(flash.flash([JOB], PI, transport, parallel=4))
    shown = graph()
    targets = {host.name: Target(host.name, "10.0.0.1", "root") for host in shown.hosts}
    probed = collect.probe_hosts(shown, targets, transport, window=0.1, parallel=4)[shown.hosts[0].name]
    (looked,) = prepare.observe({"pi": NEEDS}, PI, transport, parallel=4)
    (prepared,) = results(prepare.prepare({"pi": NEEDS}, PI, transport, parallel=4))
    return {
        "observe": plan, "apply": deployed, "remove": removed, "flash": flashed, "probe": probed,
        "inventory": looked, "prepare": prepared,
    }  # fmt: skip


def test_a_host_that_confirms_another_release_is_no_success() -> None:
    answers = {**FITTING, "confirm": {"release": "f" * 16}}
    (found,) = results(
        deploy({"pi": RELEASE}, PI, Transport(lambda verb: json.dumps({"answer": answers[verb]})))
    )
    assert isinstance(found, HostError)
    assert found.message == f"it confirms release {'f' * 16}, and {RELEASE.digest} was applied"


def keys_of(**answer: str) -> Any:
    transport = Transport(answering({**FITTING["wireguard_key"], **answer}))
    return exchanged({"pi": wireguard_key.Request("new")}, PI, transport)["pi"]


KEY = FITTING["wireguard_key"]["public"]


@pytest.mark.parametrize("which", ["public", "next"])
@pytest.mark.parametrize(
    "key",
    [
        " ", KEY[:-1], KEY + "=", KEY + "\n", f"{KEY}\nother-pi {KEY}", KEY[:-2] + "V=", "ä" + KEY[1:],
        "A" * 42 + "==", "A" * 44,
    ],
)  # fmt: skip
def test_a_public_key_is_32_bytes_in_base64(which: str, key: str) -> None:
    """It goes into the file of pinned keys, and from there to the other hosts."""
    assert getattr(keys_of(**{which: KEY}), which) == KEY
    found = keys_of(**{which: key})
    assert isinstance(found, HostError)
    assert found.kind is Kind.PROTOCOL


def results(events: Any) -> list[Any]:
    return [event.outcome for event in events if isinstance(event, parallel_hosts.Finished)]


def asked_for(answers: Mapping[str, Any]) -> dict[str, Any]:
    """What `ask` makes of the answers, by verb."""
    found = {}
    for verb in FITTING:
        module: Any = importlib.import_module(f"swarm_onboard.agent.verbs.{verb}")
        request = [None] * len(module.Request._fields)
        with agent_session(
            Session(lambda verb: json.dumps({"answer": answers[verb]})), verbs=(verb,)
        ) as agent:
            try:
                found[f"ask {verb}"] = ask(agent, module.handle, module.Request(*request))
            except HostError as error:
                found[f"ask {verb}"] = error
    return found


def no_bug(found: dict[str, Any]) -> None:
    for plan in (found["observe"], found["inventory"]):
        assert isinstance(plan, HostPlan | HostPreparation)
        assert plan.problem is None or plan.problem.kind != Kind.BUG.value, plan.problem
    for outcome in found.values():
        assert not isinstance(outcome, HostError) or outcome.kind is not Kind.BUG, outcome


def answering(value: Any) -> Callable[[str], str]:
    return lambda _: json.dumps({"answer": value})


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6) | st.just(10**400)
JSON = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
)


@st.composite
def damaged(draw: st.DrawFn) -> dict[str, Any]:
    """Answers that fit, with something else in one place of each."""
    made = json.loads(json.dumps(FITTING))
    for verb in made:
        place, steps = made[verb], draw(st.integers(0, 5))
        for _ in range(steps):
            inner = [key for key, one in place.items() if isinstance(one, dict) and one]
            if not inner:
                break
            place = place[draw(st.sampled_from(inner))]
        place[draw(st.sampled_from(sorted(place)))] = draw(JSON)
    return made


def test_fitting_answers_give_values() -> None:
    found = outcomes(Transport(lambda verb: json.dumps({"answer": FITTING[verb]})))
    assert isinstance(found["apply"], Outcome)
    assert found["remove"] == Removed(True)
    assert found["flash"] == {"k3": flash.Flashed(True, True)}
    assert isinstance(found["probe"], Answer)
    assert found["observe"].problem is None
    assert found["inventory"].fit
    assert found["prepare"] == prepare.Prepared(())
    assert [verb for verb, one in asked_for(FITTING).items() if isinstance(one, HostError)] == []


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(JSON)
def test_any_json_is_a_value_or_the_hosts_error(value: Any) -> None:
    no_bug(outcomes(Transport(answering(value))) | asked_for(dict.fromkeys(FITTING, value)))


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(damaged())
def test_a_damaged_answer_is_a_value_or_the_hosts_error(answers: dict[str, Any]) -> None:
    no_bug(outcomes(Transport(lambda verb: json.dumps({"answer": answers[verb]}))) | asked_for(answers))


@pytest.mark.parametrize(
    "printed",
    [
        "[" * 100_000,
        '{"answer":' + "[" * 100_000 + "]" * 100_000 + "}",
        '{"answer":' + '{"a":' * 40 + "1" + "}" * 41,
        '{"answer": {"units": ' + "9" * 5000 + "}}",
        '{"answer": NaN}',
        '{"answer": {"release": "\\ud800"}}',
        '{"error": {"kind": [], "message": {"a": []}, "hint": 7}}',
        '{"error": {"kind": "bug", "message": "x"}}',
        '{"note": {"a": 1}}',
        "z:" + "A" * 40,
        "z:%%%",
        "{",
    ],
    ids=range(12),
)
def test_what_is_no_answer_is_the_hosts_error(printed: str) -> None:
    found = outcomes(Transport(lambda _: printed))
    assert found["observe"].problem is not None
    no_bug(found)
    for verb in ("apply", "remove", "probe"):
        assert isinstance(found[verb], HostError)


@pytest.mark.parametrize(
    ("path", "value", "problem"),
    [
        (("facts",), 3, "facts: Input should be a tuple, list, dictionary or an instance of Facts"),
        (("facts", "free_bytes"), True, "facts.free_bytes: Input should be a valid integer"),
        (("facts", "time"), float("nan"), "facts.time: Input should be a finite number"),
        (("facts", "has", "rospy"), 7, "facts.has.rospy: Input should be a valid string"),
        (("facts", "absent"), {}, "facts.absent: Input should be a valid list"),
        (
            ("units", "koala.service", "pid"),
            10**400,
            "units.koala.service.pid: Input should be a valid integer",
        ),
        (("units", "koala.service"), {}, "units.koala.service.load: Field required"),
        (
            ("drift", "files"),
            {"a": "odd"},
            "drift.files.a: Input should be 'changed', 'missing', 'extra' or 'damaged'",
        ),
    ],
)
def test_the_error_names_the_place_and_what_belongs_there(
    path: tuple[str, ...], value: Any, problem: str
) -> None:
    answer = json.loads(json.dumps(OBSERVED))
    place = answer
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    (outcome,) = results(deploy({"pi": RELEASE}, PI, Transport(answering(answer))))
    assert isinstance(outcome, HostError)
    assert outcome.kind is Kind.PROTOCOL
    assert outcome.message == f"the answer to `observe` does not fit: {problem}"


def test_depth_is_bounded() -> None:
    deep: Any = 1
    for _ in range(DEEPEST - 1):
        deep = [deep]
    assert bounded(deep)
    assert not bounded([deep])
