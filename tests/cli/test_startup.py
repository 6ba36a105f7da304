"""``--help`` imports no verb and nothing large; benchmarks/startup.py measures the time that it takes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from swarmctl.cli.app import Verbs
from swarmctl.cli.lazy_verbs import Verb

SCRIPT = str(Path(sys.executable).with_name("swarmctl"))
SPEC = Path(__file__).parents[2] / "examples/paper-leader/swarm.yaml"
STARTS = {"the script": [SCRIPT], "the module": ["-m", "swarmctl"]}
LARGE = {"pydantic", "yaml", "networkx", "paramiko", "serial", "rich", "jinja2", "asyncio"}
BASIS = {f"swarmctl{name}" for name in ("", ".streams", ".version", ".cli", ".cli.app")}
FOR_HELP = {
    f"swarmctl.cli.{name}" for name in ("console", "exit_codes", "lazy_verbs", "options", "spec_args")
}
MOST = 145  # modules beyond those of a bare Python; now 132, and 148 if every verb is imported
EACH_HELP = """
import contextlib, io, sys
from swarmctl.cli.app import Verbs, run
for verb in Verbs.verbs:
    below = getattr(verb.load(), "commands", ())
    for words in ([verb.name], *([verb.name, name] for name in below)):
        with contextlib.redirect_stdout(io.StringIO()):
            assert run([*words, "--help"]) == 0, words
print(*sys.modules)
"""


def imported(*arguments: str) -> set[str]:
    """The modules that a fresh Python imports, also those that it did not find."""
    ran = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True
    )
    return {line.rpartition("|")[2].strip() for line in ran.stderr.splitlines()[1:]}


@pytest.mark.parametrize("start", STARTS.values(), ids=STARTS)
def test_the_help_imports_little(start: list[str]) -> None:
    found = imported(*start, "--help") - imported("-c", "pass")
    ours = {name for name in found if name.partition(".")[0] == "swarmctl"}
    assert ours - {"swarmctl.__main__"} == BASIS | FOR_HELP
    assert not found & LARGE
    assert len(found) <= MOST, sorted(found)


@pytest.mark.parametrize("verb", [["validate"], ["plan", "--offline"]], ids=" ".join)
def test_a_verb_imports_only_what_a_valid_spec_needs(verb: list[str]) -> None:
    for_faults = {"rapidfuzz", "urllib.request"}
    for_hosts = {"paramiko", "cryptography", "asyncio", "serial", "tarfile"}
    found = imported("-m", "swarmctl", *verb, str(SPEC))
    assert not found & (for_faults | for_hosts)
    assert "networkx" in found
    assert ("jinja2" in found) is (verb != ["validate"])


@pytest.mark.parametrize("mode", ["{mode: leader, leader: h1}", "{mode: standalone}"])
@pytest.mark.parametrize("hosts", [1, 2])
def test_several_hosts_are_checked_as_a_graph(tmp_path: Path, mode: str, hosts: int) -> None:
    names = [f"h{number + 1}" for number in range(hosts)]
    data = {
        "version": 1,
        "name": "small",
        **yaml.safe_load(mode),
        "hosts": {name: {"address": f"192.168.7.1{place}"} for place, name in enumerate(names)},
        "robots": {"k3": {"type": "khepera3", "host": "h1"}},
        "links": [
            {"kind": "wlan", "name": "lab", "hosts": names},
            {"kind": "serial", "host": "h1", "robot": "k3", "usb": {"serial": "A6001"}},
        ],
    }
    spec = tmp_path / "swarm.yaml"
    spec.write_text(json.dumps(data), "utf-8")
    assert ("networkx" in imported("-m", "swarmctl", "validate", str(spec))) is (hosts > 1)


def test_stop_imports_neither_models_nor_plans(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    nobody = "hosts: {pi: {address: 127.0.0.1, port: 9}}"  # the discard service, which no host has today
    spec.write_text(f"version: 1\nname: s\n{nobody}\nrobots: {{k3: {{type: khepera3, host: pi}}}}\n")
    after = "from swarmctl.cli import stop_targets; stop_targets.warn_of_errors = lambda spec: None"
    calls = f"{after}; run(['stop', {str(spec)!r}]); print(*sys.modules)"
    script = f"import sys; from swarmctl.cli.app import run; {calls}"
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    found = set(ran.stdout.splitlines()[-1].split())
    assert "paramiko" in found, ran.stdout
    unwanted = ("plan", "analysis", "render", "rules", "swarm", "robot_types", "spec.model", "spec.document")
    assert not {one for one in found if one.startswith(tuple(f"swarmctl.{name}" for name in unwanted))}


def test_ssh_comes_without_what_it_does_not_need() -> None:
    found = imported("-c", "import swarmctl.remote.ssh")
    assert "paramiko" in found
    assert not found & {"asyncio", "unittest", "argparse"}


def test_the_version_imports_no_command_line() -> None:
    found = imported("-m", "swarmctl", "--version")
    assert not found & {"typer", "swarmctl.cli", *LARGE}


def test_the_help_of_a_verb_imports_nothing_large() -> None:
    ran = subprocess.run([sys.executable, "-c", EACH_HELP], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    loaded = set(ran.stdout.split())
    assert not loaded & LARGE
    ours = {name for name in loaded if name.startswith("swarmctl.") and ".cli" not in name}
    ours = {name for name in ours if not name.startswith("swarmctl.lab")}  # the table of faults
    assert ours == {"swarmctl.version"}


@pytest.mark.parametrize("verb", Verbs.verbs, ids=[verb.name for verb in Verbs.verbs])
def test_the_list_shows_what_the_verb_shows(verb: Verb) -> None:
    command = verb.load()
    assert command.name == verb.name
    for width in (20, 45, 79, 240):
        assert verb.get_short_help_str(width) == command.get_short_help_str(width)
