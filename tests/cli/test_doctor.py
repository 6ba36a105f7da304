"""``swarmctl doctor`` as a person and a script see it, where no host can be reached."""

from __future__ import annotations

import json
from pathlib import Path

from swarmctl.cli import exit_codes
from tests.in_process import swarmctl
from tests.ports import free_port

SPEC = """\
version: 1
name: lab
hosts:
  pi: {{address: 127.0.0.1, port: {port}}}
robots:
  r1: {{type: unknown-type, host: pi}}
"""


def test_it_names_what_is_wrong_here_and_on_the_way_to_a_host(tmp_path: Path) -> None:
    (tmp_path / "swarm.yaml").write_text(SPEC.format(port=free_port()))
    env = {"HOME": str(tmp_path), "SSH_AUTH_SOCK": None}
    run = swarmctl("doctor", cwd=tmp_path, env=env)
    assert run.returncode == exit_codes.UNHEALTHY
    lines = run.stdout.splitlines()
    for line, remedy in (
        ("✗ spec: swarm.yaml has 2 errors", "`swarmctl validate`"),
        ("✗ pinned keys: pi has none", "`swarmctl trust`"),
        ("✗ private keys: there is no private key to log in to pi with", "create one with `ssh-keygen"),
    ):
        assert lines[lines.index(line) + 1].startswith(f"    help: {remedy}")
    at = lines.index("pi")
    assert lines[at - 1] == "hosts: 0 of 1 can be logged in to"
    assert any(line.startswith("✗ port: pi ") and "nothing listens" in line for line in lines[at:])
    assert lines[-1] == "- disk: needs login"
    found = json.loads(swarmctl("doctor", "r1", "--json", cwd=tmp_path, env=env).stdout)
    assert {one["check"]: one["state"] for one in found["checks"] if one["host"] == "pi"}["port"] == "bad"
