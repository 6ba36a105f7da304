"""Every verb ends with the command that usually comes next, or there is a reason why none does."""

from __future__ import annotations

import inspect
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from swarmctl.cli.app import app
from tests.cli.test_next_commands_work import parsed

NEXT = {
    "init": ["validate"],
    "import": ["validate"],
    "mode infer": ["mode convert --to central --write"],
    "mode convert": ["validate", "mode convert --to central --write"],
    "swap": ["plan", "swap k3 --with k4 --write"],
    "rename": ["plan", "rename k3 k4 --write"],
    "driver new": ["driver show my-robot"],
    "driver test": ["status"],
    "validate": ["plan"],
    "render": ["plan"],
    "lab up": ["deploy --lab"],
    "lab status": ["status --lab"],
    "lab fault": ["status --lab"],
    "lab repair": ["status --lab"],
    "trust": ["plan"],
    "rekey": ["status"],
    "expel": ["graph --impact"],
    "keys": ["plan"],
    "prepare": ["deploy", "prepare"],
    "plan": ["trust", "prepare", "deploy", "status"],
    "deploy": ["status"],
    "adopt": ["plan", "adopt --write"],
    "history": ["rollback --dry-run"],
    "rollback": ["status"],
    "firmware build": ["firmware flash"],
    "firmware flash": ["status"],
    "status": ["trust", "plan", "status --watch"],
    "logs": ["doctor k3-pi", "status"],
    "topic list": ["doctor k3-pi", "topic echo /k3/odom"],
    "exec": ["doctor k3-pi"],
    "record": ["ui --bags newswarm-bags", "record --fetch"],
    "doctor": ["status"],
    "report": ["status --from report.tar.gz"],
    "stop": ["start k3"],
    "start": ["status"],
    "restart": ["status"],
    "ready": ["status"],
    "run": ["capsule show newswarm-trials/circles"],
}
NONE = {
    "spec": "prints a document",
    "schema": "prints a document",
    "graph": "prints a drawing or an analysis, which changes nothing",
    "driver list": "is for reading",
    "driver show": "is for reading",
    "rules": "is for reading",
    "explain": "is for reading",
    "lab down": "is the last of its commands",
    "lab robots": "is for reading",
    "lab shell": "prints what the command prints",
    "lab scenario": "ends with its result",
    "emulate": "goes on until Ctrl-C",
    "capsule compare": "is for reading",
    "capsule export": "writes data for other programs",
    "capsule show": "is for reading",
    "capsule verify": "ends with its result",
    "remove": "is the last of its commands; only hosts that failed have a next one",
    "ui": "goes on until Ctrl-C",
    "top": "goes on until Ctrl-C on a terminal",
    "topic echo": "prints messages",
    "topic hz": "goes on until Ctrl-C",
    "topic pub": "goes on until Ctrl-C",
    "ssh": "becomes ssh",
    "exporter": "goes on until Ctrl-C",
    "watch": "goes on until Ctrl-C",
}


def functions() -> dict[str, Any]:
    """The function of each verb; those of the faults of the lab are one."""

    def below(group: Any, context: typer.Context, names: tuple[str, ...]) -> Iterator[tuple[str, Any]]:
        for name in group.list_commands(context):
            words = (*names, name)
            command = group.resolve_command(context, [name])[1]
            if hasattr(command, "commands") and words != ("lab", "fault"):
                yield from below(command, context, words)
            else:
                yield " ".join(words), getattr(command, "callback", None)

    command: Any = typer.main.get_command(app)
    return dict(below(command, command.make_context("swarmctl", ["plan"], resilient_parsing=True), ()))


def test_every_verb_has_a_next_command_or_a_reason() -> None:
    assert sorted([*NEXT, *NONE]) == sorted(functions())


@pytest.mark.parametrize("verb", NEXT)
def test_the_next_command_can_be_typed(
    verb: str, leader_spec: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(leader_spec, "swarm.yaml")
    Path("report.tar.gz").touch()
    for line in NEXT[verb]:
        parsed(f"swarmctl {line}")


@pytest.mark.parametrize("verb", [one for one in NEXT if one != "lab fault"])  # that of `lab repair`
def test_the_verb_prints_it(verb: str) -> None:
    text = inspect.getsource(sys.modules[functions()[verb].__module__])
    for line in NEXT[verb]:
        words = line.split()
        named = " ".join(words[:2]) if words[0] in ("mode", "topic", "firmware", "driver") else words[0]
        advised = rf'(advise|command)\(\s*"{named}"|(\*\(|else )\("{named}", spec'
        printed = rf'{advised}|"swarmctl", "{named}"|advise_{named}\('
        if verb.startswith("driver"):  # in a sentence
            printed = f"swarmctl {named}"
        assert re.search(printed, text)
