"""The same jobs with swarmctl, bare paramiko and other tools: ``python benchmarks/compare.py``.

As root. The hosts are an sshd each on loopback with a folder as root and a stub of systemctl, so that N = 60
fit on one machine; nobody waits for a service. Every run is a process of its own, in turn, so that the start
of each tool counts; swarmctl reads no spec. `make bench-tools` installs the other tools into build/tools; one
that is missing is named and left out. The job "nothing to do" is `true`, or an empty function of Mitogen.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from deploy_cost import contestants
from deploy_cost.hosts import SmallHost, running

FILES = 20
JOBS = (f"{FILES} files, one restart", "nothing to do", "one parameter, one restart")
TOOLS = Path(__file__).resolve().parents[1] / "build/tools/bin"
BARE = "bare paramiko"
ANSIBLE = """\
- hosts: all
  gather_facts: false
  tasks:
    - ansible.builtin.copy: {src: files/, dest: "{{ app }}/"}
      register: files
    - ansible.builtin.command: systemctl restart -- bench.service
      when: files.changed
"""
PYINFRA = """\
from pyinfra import host
from pyinfra.operations import files, server
synced = files.sync(src="files", dest=host.data.app)
server.shell(commands="systemctl restart -- bench.service", _if=synced.did_change)
"""


def commands(folder: Path, hosts: Sequence[SmallHost]) -> dict[str, list[str]]:
    """Returns the command of each tool, to which the job is added for scripts of ours."""
    (folder / "hosts.json").write_text(json.dumps([one.to_json() for one in hosts]))
    (folder / "playbook.yml").write_text(ANSIBLE)
    (folder / "deploy.py").write_text(PYINFRA)
    inventory = [
        f"{one.name} ansible_host=127.0.0.1 ansible_port={one.port} ansible_user=root app={one.app} "
        f"ansible_ssh_private_key_file={one.identity} ansible_python_interpreter=/usr/bin/python3 "
        f"ansible_remote_tmp={one.prefix}/tmp"
        for one in hosts
    ]
    (folder / "inventory.ini").write_text("\n".join(inventory) + "\n")
    listed = [
        (one.name, {"ssh_hostname": "127.0.0.1", "ssh_port": one.port, "ssh_user": "root",
                    "ssh_key": one.identity, "ssh_strict_host_key_checking": "off", "app": one.app})
        for one in hosts
    ]  # fmt: skip
    (folder / "inventory.py").write_text(f"hosts = {listed!r}\n")
    script = str(Path(contestants.__file__))
    number = str(len(hosts))
    return {
        BARE: [sys.executable, script, "bare", str(folder)],
        "swarmctl": [sys.executable, script, "swarmctl", str(folder)],
        **{
            tool: [str(TOOLS / "python"), script, tool, str(folder)]
            for tool in ("asyncssh", "fabric", "mitogen")
        },
        "ansible-core": [
            str(TOOLS / "ansible-playbook"),
            "-i",
            "inventory.ini",
            "-f",
            number,
            "playbook.yml",
        ],
        "pyinfra": [str(TOOLS / "pyinfra"), "-y", "--parallel", number, "inventory.py", "deploy.py"],
    }


def measured(
    folder: Path, hosts: Sequence[SmallHost], rounds: int, without: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Returns the median of s by tool and job. Before each round of a tool its files are as they were."""
    found: dict[str, dict[str, list[float]]] = {}
    tools = {name: one for name, one in commands(folder, hosts).items() if name not in without}
    for name in [one for one, command in tools.items() if not Path(command[0]).exists()]:
        print(f"{name} is not installed: `make bench-tools`", file=sys.stderr)
        del tools[name]
    version = 0
    for number in range(rounds + 1):
        for tool, command in tools.items():
            version += 1
            write(folder / "files", dict.fromkeys(range(FILES), version))
            if not number:  # warms up: interpreters, and what a tool keeps on the hosts
                run(folder, command, JOBS[0])
                continue
            for job in JOBS:
                if job is JOBS[2]:
                    write(folder / "files", {0: -version})
                seconds = run(folder, command, job)
                print(
                    f"  {len(hosts)} hosts, {number}: {tool}, {job}: {seconds:.2f} s",
                    file=sys.stderr,
                    flush=True,
                )
                found.setdefault(tool, {}).setdefault(job, []).append(seconds)
    return {
        tool: {job: statistics.median(all_) for job, all_ in jobs.items()} for tool, jobs in found.items()
    }


def write(folder: Path, versions: Mapping[int, int]) -> None:
    """Writes files of 2 KB."""
    folder.mkdir(exist_ok=True)
    for number, version in versions.items():
        (folder / f"{number}.yaml").write_text(f"speed: {version}.{number}  # m/s\n" * 100)


def run(folder: Path, command: Sequence[str], job: str) -> float:
    """Returns the s of one run; its output is shown if it fails."""
    added = ["nothing" if job is JOBS[1] else "files"] if command[1].endswith("contestants.py") else []
    environment = {
        **os.environ, "ANSIBLE_HOST_KEY_CHECKING": "False", "ANSIBLE_PIPELINING": "True",
        "ANSIBLE_SSH_ARGS": "-o ControlMaster=auto -o ControlPersist=60s -o UserKnownHostsFile=/dev/null",
        "ANSIBLE_LOCAL_TEMP": str(folder / "ansible"), "ANSIBLE_HOME": str(folder / "ansible"),
        "ANSIBLE_SSH_CONTROL_PATH_DIR": str(folder / "cp"),
    }  # fmt: skip
    began = time.perf_counter()
    done = subprocess.run(
        [*command, *added], cwd=folder, env=environment, capture_output=True, check=False, text=True
    )
    seconds = time.perf_counter() - began
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {job}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return seconds


def shown(number: int, found: Mapping[str, Mapping[str, float]]) -> None:
    """Prints seconds, and times bare paramiko."""
    print(f"{f'{number} hosts':14}" + "".join(f"{job:>30}" for job in JOBS))
    for tool, jobs in found.items():
        cells = (f"{jobs[job]:.2f} s {jobs[job] / found[BARE][job]:6.1f} x bare" for job in JOBS)
        print(f"{tool:14}" + "".join(f"{cell:>30}" for cell in cells), flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--hosts", type=int, nargs="+", default=[10], help="numbers of hosts: 10 30 60")
    parser.add_argument("--rounds", type=int, default=2, help="runs of each job; the median counts")
    parser.add_argument("--without", nargs="+", default=[], metavar="TOOL", help="leave these tools out")
    given = parser.parse_args()
    if os.geteuid():
        raise SystemExit("this needs root: sshd logs in root")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the hosts end with it
    for number in given.hosts:
        with (
            tempfile.TemporaryDirectory(prefix="swarm-bench-") as place,
            running(Path(place), number) as hosts,
        ):
            shown(number, measured(Path(place), hosts, given.rounds, given.without))
    return 0


if __name__ == "__main__":
    sys.exit(main())
