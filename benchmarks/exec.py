"""What `swarmctl exec all -- true` costs: ``python benchmarks/exec.py [--hosts N] [--rounds N]``.

As root, in a lab of N hosts, beside a loop of `ssh`, pssh, pdsh, clush and an ad hoc command of Ansible,
which log in to the same hosts with the same key, in turn. A tool that is not installed is named and left out.
"""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from deploy import booted, spec_of
from stop import home_of

from swarmctl.lab import paths
from swarmctl.lab.hosts import network
from swarmctl.remote.transport import Target

EXEC = "swarmctl exec"


def commands(folder: Path, targets: Sequence[Target]) -> dict[str, list[str]]:
    """Returns the command of each tool."""
    config, hosts, inventory = (folder / one for one in ("ssh_config", "hosts", "inventory.ini"))
    common = f"IdentityFile {targets[0].identities[0]}\nUserKnownHostsFile {folder}/known\nLogLevel ERROR\n"
    entries = [f"Host {one.host}\n  HostName {one.address}\n  User {one.user}\n" for one in targets]
    config.write_text("".join(entries) + f"Host *\n{common}StrictHostKeyChecking yes\n")
    keys = [f"{one.host},{one.address} {key}\n" for one in targets for key in one.keys]
    (folder / "known").write_text("".join(keys))
    names = [one.host for one in targets]
    hosts.write_text("\n".join(names) + "\n")
    inventory.write_text("".join(f"{name} ansible_python_interpreter=/usr/bin/python3\n" for name in names))
    many, ssh = str(len(names)), f"-F {config}"
    swarmctl = str(Path(sys.executable).with_name("swarmctl"))
    return {
        EXEC: [swarmctl, "exec", str(folder / "swarm.yaml"), "all", "--", "true"],
        "ssh in a loop": ["sh", "-c", f"for one in {shlex.join(names)}; do ssh -n {ssh} $one true; done"],
        "pssh": ["parallel-ssh", "-h", str(hosts), "-p", many, "-x", ssh, "true"],
        "pdsh": ["pdsh", "-R", "ssh", "-f", many, "-w", ",".join(names), "true"],
        "clush": ["clush", "-f", many, "-o", ssh, "-w", ",".join(names), "true"],
        "ansible -m raw": [
            "ansible", "all", "-i", str(inventory), "-f", many, "--ssh-common-args", ssh,
            "-m", "raw", "-a", "true",
        ],
    }  # fmt: skip


def seconds(command: Sequence[str], environment: Mapping[str, str]) -> float:
    """Returns how long the command took. Raises SystemExit if it failed."""
    began = time.monotonic()
    done = subprocess.run(
        command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    took = time.monotonic() - began
    if done.returncode:
        raise SystemExit(f"{shlex.join(command)}: {done.stdout}{done.stderr}")
    return took


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as place:
        folder = Path(place)
        os.environ.setdefault(paths.STATE_VARIABLE, place)
        spec = folder / "swarm.yaml"
        spec.write_text(spec_of(options.hosts))
        with booted(spec) as (namespace, targets, _):
            network.enter(namespace)
            every = commands(folder, targets)
            tools = {name: words for name, words in every.items() if shutil.which(words[0])}
            home = home_of(folder, targets)
            control = f"-F {folder}/ssh_config -o ControlMaster=no"  # each login counts, as for the others
            environment = {
                **home,
                "ANSIBLE_SSH_ARGS": control,
                "PDSH_SSH_ARGS_APPEND": f"-F {folder}/ssh_config",
            }
            rounds = [
                {name: seconds(words, environment) for name, words in tools.items()}
                for _ in range(options.rounds)
            ]
    print(f"{options.hosts} hosts, {options.rounds} rounds in turn, median of each")
    for name in every:
        if name not in tools:
            print(f"  {name:<16} is not installed")
            continue
        took = statistics.median(one[name] for one in rounds)
        ratio = statistics.median(one[name] / one[EXEC] for one in rounds)
        print(f"  {name:<16} {took:6.2f} s   {ratio:5.2f} times {EXEC}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
