"""One job on all hosts with each tool, as a process of its own: ``python contestants.py TOOL FOLDER JOB``.

JOB is ``nothing``, or the files in FOLDER are new: all are written and one service restarts. A tool that
compares finds out by itself what is new; bare paramiko, asyncssh, fabric and Mitogen get the job.
"""

from __future__ import annotations

import asyncio
import io
import json
import sys
import tarfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

RESTART = "systemctl restart -- bench.service"


def archive(files: Path) -> bytes:
    """Returns the files as a tar.gz."""
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:gz") as packed:
        for path in sorted(files.iterdir()):
            packed.add(path, path.name)
    return stream.getvalue()


def bare(hosts: list[dict[str, Any]], folder: Path, job: str) -> None:
    """Logs in with paramiko and runs one command."""
    import paramiko

    payload = b"" if job == "nothing" else archive(folder / "files")

    def work(host: dict[str, Any]) -> None:
        with paramiko.SSHClient() as client:
            key = paramiko.hostkeys.HostKeyEntry.from_line(f"[127.0.0.1]:{host['port']} {host['key']}")
            assert key is not None
            client.get_host_keys().add(key.hostnames[0], key.key.get_name(), key.key)
            client.connect(
                "127.0.0.1", host["port"], "root", key_filename=host["identity"], allow_agent=False,
                look_for_keys=False,
            )  # fmt: skip
            command = f"tar xz -C {host['app']} && {RESTART}" if payload else "true"
            stdin, stdout, _ = client.exec_command(command)
            stdin.write(payload)
            stdin.channel.shutdown_write()
            if stdout.channel.recv_exit_status():
                raise SystemExit(f"{command} failed on {host['name']}")

    with ThreadPoolExecutor(len(hosts)) as pool:
        list(pool.map(work, hosts))


def asyncssh(hosts: list[dict[str, Any]], folder: Path, job: str) -> None:
    """Logs in with asyncssh and runs one command."""
    import asyncssh as library  # type: ignore[import-not-found]

    payload = b"" if job == "nothing" else archive(folder / "files")

    async def work(host: dict[str, Any]) -> None:
        known = library.import_known_hosts(f"[127.0.0.1]:{host['port']} {host['key']}")
        async with library.connect(
            "127.0.0.1", host["port"], username="root", client_keys=[host["identity"]], known_hosts=known
        ) as connection:
            command = f"tar xz -C {host['app']} && {RESTART}" if payload else "true"
            await connection.run(command, input=payload, encoding=None, check=True)

    async def everywhere() -> None:
        await asyncio.gather(*map(work, hosts))

    asyncio.run(everywhere())


def mitogen(hosts: list[dict[str, Any]], folder: Path, job: str) -> None:
    """Runs a function of Python on each host, which unpacks the tar."""
    import on_host  # type: ignore[import-not-found]
    from mitogen.master import Broker, Router  # type: ignore[import-not-found]

    payload = b"" if job == "nothing" else archive(folder / "files")
    broker = Broker()

    def work(host: dict[str, Any]) -> None:
        context = Router(broker).ssh(
            hostname="127.0.0.1", port=host["port"], username="root", identity_file=host["identity"],
            python_path="/usr/bin/python3", check_host_keys="ignore",
        )  # fmt: skip
        context.call(on_host.unpack, host["app"], payload)

    try:
        with ThreadPoolExecutor(len(hosts)) as pool:
            list(pool.map(work, hosts))
    finally:
        broker.shutdown()


def swarmctl(hosts: list[dict[str, Any]], folder: Path, job: str) -> None:
    """Observes, applies and confirms a bundle of the files; imports what the verb imports."""
    import swarmctl.linter.runner  # noqa: F401
    from swarmctl.deploy.host_transaction import Terms
    from swarmctl.remote.parallel_hosts import Finished
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.remote.transport import HostError, Target
    from swarmctl.render.bundle import Bundle, File, Unit
    from tests.deploy.deploying import deploy

    files = [File(f"app/{path.name}", path.read_bytes()) for path in sorted((folder / "files").iterdir())]
    needs = tuple(file.path for file in files)
    files.append(File("units/bench.service", b"[Service]\nExecStart=/bin/true\n"))
    links = {"/etc/systemd/system/bench.service": "units/bench.service"}
    unit = Unit("bench.service", needs)
    bundles = {
        one["name"]: Bundle(tuple(files), (unit,), links, swarm="new", host=one["name"]) for one in hosts
    }
    targets = {
        one["name"]: Target(
            one["name"], "127.0.0.1", "root", one["port"], (one["key"],), (Path(one["identity"]),)
        )
        for one in hosts
    }
    terms = Terms(healthy_for=0.0, healthy_within=5.0)  # how long a unit is watched is no cost of the tool
    for event in deploy(bundles, targets, SshTransport(), parallel=len(hosts), terms=terms):
        if isinstance(event, Finished) and isinstance(result := event.outcome, HostError):
            raise SystemExit(f"{event.host}: {result}")


def fabric(hosts: list[dict[str, Any]], folder: Path, job: str) -> None:
    """Puts the tar and runs two commands."""
    import paramiko
    from fabric import Connection  # type: ignore[import-not-found]

    payload = b"" if job == "nothing" else archive(folder / "files")

    def work(host: dict[str, Any]) -> None:
        options = {"key_filename": host["identity"], "allow_agent": False, "look_for_keys": False}
        with Connection("127.0.0.1", "root", host["port"], connect_kwargs=options) as connection:
            connection.client.set_missing_host_key_policy(paramiko.AutoAddPolicy())
            if payload:
                connection.put(io.BytesIO(payload), f"{host['app']}.tgz")
                connection.run(f"tar xzf {host['app']}.tgz -C {host['app']}", hide=True)
                connection.run(RESTART, hide=True)
            else:
                connection.run("true", hide=True)

    with ThreadPoolExecutor(len(hosts)) as pool:
        list(pool.map(work, hosts))


if __name__ == "__main__":
    tool, place, job = sys.argv[1:]
    all_hosts = json.loads(Path(place, "hosts.json").read_text())
    tools = {"bare": bare, "asyncssh": asyncssh, "swarmctl": swarmctl, "fabric": fabric, "mitogen": mitogen}
    tools[tool](all_hosts, Path(place), job)
