"""Every command that a verb prints as the next one can be typed: tried over verbs, outcomes and options.

The hosts are made up; each printed line goes through the parser of the command line, and its hosts are there.
"""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
import typer
from swarm_onboard.agent.steps import Kind as StepKind
from swarm_onboard.agent.steps import Step

from swarmctl.cli import console, selected
from swarmctl.cli.app import app, run
from swarmctl.cli.where import Where
from swarmctl.deploy import rollout
from swarmctl.deploy.deployment import Deployment, ObservedHost
from swarmctl.deploy.outcome import Removed
from swarmctl.health import collect, host_logs
from swarmctl.health.host_logs import Entry, HostLog
from swarmctl.plan.observed_host import NOTHING
from swarmctl.plan.plan import HostPlan, Plan, Problem
from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import Ran
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError, Kind, Target
from tests import ROOT
from tests.cli.test_width import Terminal
from tests.health.swarm_values import HOSTS, all_well, nothing_deployed
from tests.loading import load_swarm

COMMAND = re.compile(r"(?:next: |then run: |help: run `?|(?<!  )help: `)(swarmctl [^`\n]+)")
HINTED = re.compile(r"help: [^\n]*?`(swarmctl [^`\n]+)`")
AWAY = HostError(Kind.UNREACHABLE, "no answer")
LOST = HostError(Kind.LOST, "the connection was lost")
NEW_KEY = HostError(Kind.HOST_KEY, "has no pinned key", "`swarmctl trust SPEC` shows the keys of new hosts")
UNFIT = HostError(Kind.UNFIT, "it lacks rospy", "`swarmctl prepare` installs it")
UNSIGNED = HostError(Kind.UNFIT, "not signed as the spec has them", "`swarmctl keys` signs them")
STEP = Step(StepKind.START, "swarm-newswarm.k3.service", "new")


ODOM = b" * /k3/odom [nav_msgs/Odometry] 1 publisher\n"


def logged(level: str) -> HostLog:
    """A log with one entry."""
    return HostLog([Entry(1.0, "k3-pi", "k3", level, "what was logged")], 0.0, cut=False)


class Screen:
    """A terminal in a folder with a spec; it keeps the commands that verbs print."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._patch, self.shown = patch, ""

    def typed(self, line: str) -> list[str]:
        """Runs a line without ``swarmctl``; returns the commands that it prints."""
        out, err = Terminal(), Terminal()
        self._patch.setattr(sys, "stdout", out)
        self._patch.setattr(sys, "stderr", err)
        console._console.cache_clear()
        try:
            run(shlex.split(line))
        finally:
            console._console.cache_clear()
        self.shown = out.getvalue() + err.getvalue()
        return COMMAND.findall(self.shown)


@pytest.fixture
def screen(tmp_path: Path, leader_spec: Path, monkeypatch: pytest.MonkeyPatch) -> Screen:
    for name in ("swarm.yaml", "lab's spec.yaml"):
        shutil.copy(leader_spec, tmp_path / name)
    (tmp_path / "night.yaml").write_text("version: 1\n")
    text = leader_spec.read_text("utf-8")
    (tmp_path / "guess.yaml").write_text(text.replace("mode:", "mod:"), "utf-8")
    (tmp_path / "fixable.yaml").write_text(text.replace("koala-laptop, robot", "koala-laptp, robot"), "utf-8")
    monkeypatch.chdir(tmp_path)
    for key, value in {"NO_COLOR": "1", "TERM": "xterm", "COLUMNS": "400", "HOME": str(tmp_path),
                       "XDG_STATE_HOME": str(tmp_path), "SWARMCTL_STATE": str(tmp_path)}.items():  # fmt: skip
        monkeypatch.setenv(key, value)
    return Screen(monkeypatch)


@pytest.fixture
def hosts(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {name: Target(name, "192.0.2.1", "robot") for name in HOSTS}
    monkeypatch.setattr(Where, "targets", lambda *_, **__: found)


def looking(errors: Mapping[str, HostError]) -> Callable[..., ObservedHost]:
    """Returns a survey: hosts with these errors, and if there are any, steps on the others."""

    def look(self: Deployment, target: Target, say: object) -> ObservedHost:
        if target.host in errors:
            raise errors[target.host]
        return ObservedHost(
            HostPlan(target.host, "a", "a", (STEP,) if errors else ()), NOTHING, recovered=False
        )

    return look


def parsed(line: str) -> typer.Context:
    """What the command line makes of ``line``; raises the usage error of a wrong one."""
    words = shlex.split(line)
    assert words.pop(0) == "swarmctl"
    command: Any = typer.main.get_command(app)
    context = command.make_context("swarmctl", words)
    while hasattr(command, "resolve_command"):
        rest = [*context._protected_args, *context.args]
        name, command, rest = command.resolve_command(context, rest)
        context = command.make_context(name, rest, parent=context)
    found: typer.Context = context
    return found


def check(line: str) -> None:
    """The command can be parsed, its spec is there, and so are the hosts that it selects."""
    context = parsed(line)
    spec = context.params["specs"][0] if "specs" in context.params else context.params["spec"]
    assert all(file.is_file() for file in spec.files)
    swarm, _ = load_swarm(spec.first)
    if swarm is not None and context.params.get("limit"):
        assert selected.hosts(swarm.candidates, context.params["limit"])


@pytest.mark.parametrize(
    ("typed", "printed"),
    [
        ("validate", "swarmctl plan"),
        ("validate -f swarm.yaml -f night.yaml", "swarmctl plan swarm.yaml -f night.yaml"),
        ('validate "lab\'s spec.yaml"', "swarmctl plan 'lab'\"'\"'s spec.yaml'"),
        ("validate fixable.yaml --workspace .", "swarmctl validate fixable.yaml --workspace . --fix"),
        ("validate guess.yaml", "swarmctl validate guess.yaml --unsafe-fixes --diff"),
        ("plan fixable.yaml", "swarmctl validate fixable.yaml --fix"),
        ("spec fixable.yaml", "swarmctl validate fixable.yaml --fix"),
        ("graph fixable.yaml --impact", "swarmctl validate fixable.yaml --fix"),
        ("plan --offline --limit 'k3-pi,epuck-pi'", "swarmctl deploy --limit k3-pi,epuck-pi"),
        ("render --out out --host k3-pi", "swarmctl plan --limit k3-pi"),
        ("mode convert --to central", "swarmctl mode convert --to central --write"),
        ("status --lab", "swarmctl lab up"),
        ("lab status --name second", "swarmctl lab up --name second"),
        ("lab fault unplug k3", "swarmctl lab up"),
        ("init 'other lab'", "swarmctl validate 'other lab/swarm.yaml'"),
    ],
)
def test_the_next_command_keeps_what_was_typed(screen: Screen, typed: str, printed: str) -> None:
    found = screen.typed(typed)
    assert found == [printed], screen.shown
    check(found[0])


@pytest.mark.usefixtures("hosts")
@pytest.mark.parametrize(
    ("results", "verb", "printed"),
    [
        ({}, "deploy --lab --limit k3-pi", ["status --lab --limit k3-pi"]),
        ({"k3-pi": LOST, "epuck-pi": AWAY}, "deploy --lab-name b",
         ["deploy --lab-name b --limit k3-pi,epuck-pi", "deploy --lab-name b --keep-going"]),
        ({"k3-pi": NEW_KEY}, "deploy", ["trust --limit k3-pi", "deploy --keep-going"]),
        ({"k3-pi": HostError(Kind.REFUSED, "full")}, "deploy", ["deploy --keep-going"]),
        ({"k3-pi": UNFIT}, "deploy -f swarm.yaml -f night.yaml",
         ["prepare swarm.yaml -f night.yaml", "deploy swarm.yaml -f night.yaml --keep-going"]),
        ({"k3-pi": AWAY}, "remove --yes", ["remove --limit k3-pi"]),
        ({}, "remove --yes", []),
    ],
)  # fmt: skip
def test_after_a_rollout(
    screen: Screen, monkeypatch: pytest.MonkeyPatch, results: dict[str, Any], verb: str, printed: list[str]
) -> None:
    def remove(names: Sequence[str], *_: Any, **__: Any) -> Iterator[Finished[Any]]:
        for name in names:
            yield Finished(name, results.get(name, Removed(True)), 0.1)

    monkeypatch.setattr(Deployment, "_look", looking(results))
    monkeypatch.setattr(rollout, "remove", remove)
    found = screen.typed(verb)
    assert found == [f"swarmctl {one}" for one in printed], screen.shown
    for line in (*found, *HINTED.findall(screen.shown)):
        check(line)


@pytest.mark.usefixtures("hosts")
def test_hosts_that_failed_can_be_tried_again(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Deployment, "_look", looking({"k3-pi": AWAY}))
    screen.typed("deploy --keep-going --dry-run")
    screen.typed("deploy --limit k3-pi")
    monkeypatch.setattr(Deployment, "_look", looking({}))
    assert screen.typed("deploy --retry-failed --limit epuck-pi") == []
    assert "exclude each other" in screen.shown
    screen.typed("deploy --retry-failed")
    assert "0 of 1 hosts changed" in screen.shown
    screen.typed("deploy --retry-failed")
    assert "no host failed in the last deploy" in screen.shown


@pytest.mark.usefixtures("hosts")
@pytest.mark.parametrize(
    ("error", "verb", "hint"),
    [
        (NEW_KEY, "deploy -f swarm.yaml -f night.yaml", "trust swarm.yaml -f night.yaml"),
        (NEW_KEY, "deploy", "trust"),
        (UNSIGNED, "deploy --lab-name b --limit k3-pi", "keys"),
        (UNFIT, "deploy --lab-name b", "prepare --lab-name b"),
        (UNFIT, 'deploy "lab\'s spec.yaml" --limit k3-pi', 'prepare "lab\'s spec.yaml" --limit k3-pi'),
    ],
)
def test_the_hints_of_hosts_can_be_typed(
    screen: Screen, monkeypatch: pytest.MonkeyPatch, error: HostError, verb: str, hint: str
) -> None:
    monkeypatch.setattr(Deployment, "_look", looking(dict.fromkeys(HOSTS, error)))
    screen.typed(verb)
    found = HINTED.findall(screen.shown)
    assert shlex.split(found[0]) == ["swarmctl", *shlex.split(hint)], screen.shown
    for line in found:
        check(line)


@pytest.mark.usefixtures("hosts")
@pytest.mark.parametrize(
    ("problem", "typed", "printed"),
    [
        (None, "plan", "deploy"),
        (Problem("host-key", "no pinned key"), "plan --limit k3-pi", "trust --limit k3-pi"),
        (Problem("host-key", "no pinned key"), "plan --lab", ""),
        (Problem("unfit", "it lacks rospy", "`swarmctl prepare` installs it"), "plan --lab", "prepare --lab"),
        (Problem("unreachable", "no answer"), "plan", ""),
    ],
)
def test_after_a_plan(
    screen: Screen, monkeypatch: pytest.MonkeyPatch, problem: Problem | None, typed: str, printed: str
) -> None:
    steps = () if problem else (STEP,)
    made = Plan("newswarm", (HostPlan("k3-pi", "a", "b", steps, problem=problem),))
    monkeypatch.setattr(rollout, "observe", lambda *_, **__: made)
    found = screen.typed(typed)
    assert found == ([f"swarmctl {printed}"] if printed else []), screen.shown
    for line in found:
        check(line)


@pytest.mark.usefixtures("hosts")
@pytest.mark.parametrize(
    ("seen", "typed", "printed"),
    [
        ("well", "status", []),
        ("bare", "status --lab", ["deploy --lab", "plan --lab"]),
        ("away", "status --lab --limit k3-pi", ["status --lab --limit k3-pi --watch"]),
        ("key", "status", ["trust"]),
    ],
)
def test_after_a_status(
    screen: Screen, monkeypatch: pytest.MonkeyPatch, seen: str, typed: str, printed: list[str]
) -> None:
    def ask(graph: Any, *_: Any, **__: Any) -> dict[str, Any]:
        answers = all_well()
        made: dict[str, Any] = {
            host.name: answers[host.name]._replace(release=host.release.digest) for host in graph.hosts
        }
        spoilt = {"bare": nothing_deployed(answers["k3-pi"]), "away": AWAY, "key": NEW_KEY}
        return made | ({"k3-pi": spoilt[seen]} if seen in spoilt else {})

    monkeypatch.setattr(collect, "probe_hosts", ask)
    found = screen.typed(typed)
    assert found == [f"swarmctl {one}" for one in printed], screen.shown
    for line in found:
        check(line)


@pytest.mark.usefixtures("hosts")
@pytest.mark.parametrize(
    ("outcome", "typed", "printed"),
    [
        (AWAY, "exec swarm.yaml all --lab-name b --file night.yaml -- uptime",
         "doctor {spec} k3-pi --lab-name b"),
        (LOST, "exec all -- uptime", ""),
        (AWAY, "exec all --json -- uptime", ""),
        (AWAY, "exec all -f -- uptime", ""),
        (Ran("k3-pi", 1), "exec all -- uptime", ""),
        (AWAY, "topic list swarm.yaml --lab-name b -f night.yaml", "doctor {spec} k3-pi --lab-name b"),
        (Ran("k3-pi", 0, ODOM), "topic list swarm.yaml --lab-name b -f night.yaml",
         "topic echo {spec} /k3/odom --lab-name b"),
        (Ran("k3-pi", 0, ODOM), "topic list", "topic echo /k3/odom"),
        (Ran("k3-pi", 0, ODOM), "topic list --json", ""),
        (Ran("k3-pi", 0, ODOM.replace(b"/k3", b"/k3/\x1b[2J")), "topic list", ""),
        (Ran("k3-pi", 0, ODOM.replace(b"publisher", b"subscriber")), "topic list", ""),
        (AWAY, "logs swarm.yaml --lab-name b --file night.yaml", "doctor {spec} k3-pi --lab-name b"),
        (logged("error"), "logs swarm.yaml --lab-name b --file night.yaml", "status {spec} --lab-name b"),
        (logged("error"), "logs --json", ""),
        (logged("error"), "logs --grep nothing", ""),
        (logged("warn"), "logs", ""),
    ],
)  # fmt: skip
def test_after_a_look(
    screen: Screen, monkeypatch: pytest.MonkeyPatch, outcome: Any, typed: str, printed: str
) -> None:
    """``outcome`` is that of k3-pi, the hub of its island; the other hosts have nothing to say."""

    def ended(names: Sequence[str], nothing: Callable[[str], Any]) -> Iterator[Finished[Any]]:
        for name in names:
            yield Finished(name, outcome if name == "k3-pi" else nothing(name), 0.1)

    def run_command(targets: Sequence[Target], *_: Any, **__: Any) -> Iterator[Finished[Any]]:
        return ended([one.host for one in targets], lambda name: Ran(name, 0))

    def read(*_: Any, **__: Any) -> Iterator[Finished[Any]]:
        return ended(HOSTS, lambda name: HostLog([], 0.0, cut=False))

    monkeypatch.setattr(host_commands, "run", run_command)
    monkeypatch.setattr(host_logs, "host_logs", read)
    shutil.copy(ROOT / "examples/paper-4-standalone/swarm.yaml", "swarm.yaml")
    found = screen.typed(typed)
    line = printed.format(spec="swarm.yaml -f night.yaml")
    assert found == ([f"swarmctl {line}"] if line else []), screen.shown
    for one in found:
        check(one)


def test_the_harmless_ones_run(screen: Screen) -> None:
    for line in ("validate guess.yaml", "mode convert --to central", "render --out out"):
        for printed in screen.typed(line):
            words = [word for word in shlex.split(printed)[1:] if word != "--write"]
            assert run([*words, *(["--offline"] if words[0] == "plan" else [])]) in (0, 1)
            assert "usage" not in screen.shown.lower()
