"""The agent over a real SSH connection: kept on the host, distinguished from noise, run as root, cheap."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import MAGIC_NUMBER
from pathlib import Path
from typing import Any

import pytest
from swarm_onboard.agent.verbs import observe

from swarmctl import onboard_archive
from swarmctl.remote import agent_client
from swarmctl.remote.answer_check import checked
from swarmctl.remote.ssh import SshTransport
from swarmctl.remote.ssh_limits import Timeouts
from swarmctl.remote.transport import HostError, Kind, Output, Session
from swarmctl.render.bundle import Bundle, File, Unit
from swarmctl.resources import onboard
from tests.onboard.agent.local_session import LocalSession
from tests.remote import sshd as servers
from tests.remote.captured_wire import proxy
from tests.remote.conftest import with_paramiko
from tests.timing import PATIENCE, wait_for

OBSERVE = {"verb": "observe", "swarm": "new"}
SYSTEMCTL = """#!/bin/sh
[ "$1" = show ] || exit 0
while [ "$1" != -- ]; do shift; done; shift
for u; do
  printf 'Id=%s\\nLoadState=loaded\\nActiveState=active\\n' $u
  printf 'SubState=running\\nMainPID=4711\\nNRestarts=0\\n\\n'
done
"""


@pytest.fixture
def transport() -> SshTransport:
    """The one that is used unless there is a reason for the other: the budgets are about it."""
    return with_paramiko(timeouts=Timeouts(*[PATIENCE] * 4))


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """A folder that plays the root of the host."""
    root = tmp_path / "host"
    for folder in ("opt", "etc", "run/systemd/system", "bin", "home"):
        (root / folder).mkdir(parents=True)
    (root / "etc/hosts").write_text("127.0.0.1 localhost\n")
    (root / "bin/systemctl").write_text(SYSTEMCTL)
    (root / "bin/systemctl").chmod(0o755)
    return root


def ask(session: Session, *question: Any, **more: Any) -> dict[str, Any]:
    """One question, one agent."""
    with agent_client.agent_session(session) as host:
        return host.request(*question, **more)


def environment(prefix: Path, path: str = "/usr/sbin:/usr/bin:/sbin:/bin") -> str:
    return f"SetEnv SWARM_PREFIX={prefix} PATH={prefix}/bin:{path} HOME={prefix}/home"


def release(files: int = 20) -> Bundle:
    """Of the size that a robot's host has."""
    units = tuple(f"swarm-new-part{number}.service" for number in range(6))
    contents = [File(f"units/{name}", b"[Service]\nExecStart=/bin/true\n" * 20) for name in units]
    contents += [File(f"params/{n}.yaml", f"speed: {n}\n".encode() * 40) for n in range(files - len(units))]
    return Bundle(
        tuple(contents),
        tuple(Unit(name, (f"units/{name}",)) for name in units),
        {f"/etc/systemd/system/{name}": f"units/{name}" for name in units},
        {"/etc/hosts": "params/0.yaml"},
        swarm="new",
        host="pi",
    )


def apply_request(bundle: Bundle) -> tuple[dict[str, object], bytes]:
    request = {
        "verb": "apply",
        "swarm": "new",
        "txid": agent_client.new_txid(),
        "who": "test",
        "previous": None,
        "next": bundle.digest,
        "steps": [["start", unit.name, ""] for unit in bundle.units],
    }
    return request, agent_client.pack(
        bundle.manifest_bytes, {file.path: (file.content, file.mode) for file in bundle.files}
    )


def test_the_agent_is_sent_once_and_kept(spare: Path, prefix: Path, transport: SshTransport) -> None:
    sent: list[int] = []
    with (
        servers.running(spare, extra=environment(prefix)) as server,
        transport.connect(server.target()) as session,
    ):

        class Counting:
            @contextmanager
            def channel(self, command: str, *, limit: int) -> Iterator[Counting]:
                with session.channel(command, limit=limit) as self.inner:
                    yield self

            def exchange(self, stdin: Sequence[bytes], *enough: Any, **rest: Any) -> Output:
                sent.append(sum(map(len, stdin)))
                return self.inner.exchange(stdin, *enough, **rest)

            def close(self) -> None: ...

        for _ in range(2):
            assert ask(Counting(), OBSERVE)["release"] is None

    small = len(b'{"verb":"observe","swarm":"new","payload":0}\n')
    assert sent == [small, small + len(agent_client.agent().archive), small]
    kept = (prefix / "opt/swarm/.agent").glob("*.zip")
    plain = {path.name for path in kept} - {compiled(prefix).name}
    assert plain == {f"{agent_client.agent().digest}.zip"}


def compiled(prefix: Path) -> Path:
    """Where the host keeps the agent compiled, for the Python of these tests."""
    name = f"{agent_client.agent().digest}-{MAGIC_NUMBER.hex()}.zip"
    return prefix / "opt/swarm/.agent" / name


def started(prefix: Path, size: int = 0, *python: str) -> subprocess.CompletedProcess[bytes]:
    """One agent that answers one request, as the loader starts it in this Python."""
    loader = (onboard() / "agent/loader.py").read_text("utf-8")
    words = ["cafe", agent_client.agent().digest, str(size)]
    return subprocess.run(
        [sys.executable, "-I", "-S", *python, "-c", loader, *words],
        input=agent_client.agent().archive[:size] + b'{"verb":"observe","swarm":"new","payload":0}\n',
        capture_output=True, check=True, env={"PATH": "/usr/bin:/bin", "SWARM_PREFIX": str(prefix)},
    )  # fmt: skip


def test_the_host_compiles_the_agent_once(prefix: Path) -> None:
    """Python would compile every module of the archive at each start, which takes most of it."""
    started(prefix, len(agent_client.agent().archive))
    second = started(prefix, 0, "-v")
    assert b'"release":null' in second.stdout or b"z:" in second.stdout
    of_the_agent = [line for line in second.stderr.splitlines() if b"swarm_onboard.agent" in line]
    assert any(compiled(prefix).name.encode() in line for line in of_the_agent)
    assert not any(re.search(rb"[.]py\b", line) for line in of_the_agent)


def test_a_host_that_cannot_keep_the_agent_says_why(prefix: Path) -> None:
    folder = prefix / "opt/swarm/.agent"
    folder.parent.mkdir(parents=True, exist_ok=True)
    folder.write_text("in the way")
    done = started(prefix, len(agent_client.agent().archive))
    assert done.stdout.startswith(b"\n@cafe cannot-keep-agent [Errno 17] File exists")


def test_a_damaged_compiled_agent_is_made_anew(prefix: Path) -> None:
    """By a cut of the power: the archive is on the disk, and what was compiled from it is not."""
    started(prefix, len(agent_client.agent().archive))
    whole = compiled(prefix).read_bytes()
    for damaged in (b"", whole[:64], whole[:-1000] + bytes(1000)):
        compiled(prefix).write_bytes(damaged)
        assert b"\n@cafe z:" in started(prefix).stdout
        assert compiled(prefix).read_bytes() == whole


def test_an_agent_that_was_tampered_with_is_not_run_but_sent_anew(
    spare: Path, prefix: Path, transport: SshTransport
) -> None:
    with (
        servers.running(spare, extra=environment(prefix)) as server,
        transport.connect(server.target()) as session,
    ):
        ask(session, OBSERVE)
        kept = prefix / f"opt/swarm/.agent/{agent_client.agent().digest}.zip"
        wait_for(lambda: list(kept.parent.glob(f"{kept.stem}-*.zip")))  # what the agent compiles at its end
        for made in kept.parent.glob(f"{kept.stem}-*.zip"):
            made.unlink()
        kept.write_bytes(kept.read_bytes() + b"#")
        ask(session, OBSERVE)
        assert kept.read_bytes() == agent_client.agent().archive


def test_a_whole_deploy_with_notes(spare: Path, prefix: Path, transport: SshTransport) -> None:
    bundle = release()
    notes: list[str] = []
    with (
        servers.running(spare, extra=environment(prefix)) as server,
        transport.connect(server.target()) as session,
    ):
        request, payload = apply_request(bundle)
        answer = ask(session, request, payload, on_note=notes.append)
        seen = ask(session, {**OBSERVE, "known_release": bundle.digest})

    assert answer["release"] == seen["release"] == bundle.digest
    assert set(seen["units"]) == {unit.name for unit in bundle.units}
    assert seen["drift"] == [{}, {}, {}]
    assert notes[0] == "staging 20 files"
    assert notes[1] == f"starting {len(bundle.units)} units"


def test_a_deploy_with_nothing_to_do_fits_its_budget(
    spare: Path, prefix: Path, transport: SshTransport
) -> None:
    bundle = release()

    def idle(server: servers.Sshd, delay: float) -> tuple[int, int]:
        with proxy(server.port, delay) as traffic:
            with transport.connect(server.target(port=traffic.port)) as session:
                seen = ask(session, {**OBSERVE, "known_release": bundle.digest})
                spent = traffic.round_trips + 1, traffic.up + traffic.down  # one opens the connection
            assert seen["release"] == bundle.digest
            assert len(seen["units"]) == 6
            return spent

    with servers.running(spare, extra=environment(prefix)) as server:
        with transport.connect(server.target()) as session:
            ask(session, *apply_request(bundle))
        for delay in (0.25, 1.0, 4.0):  # an end that pauses for longer than that seems to await an answer
            round_trips, size = idle(server, delay)
            if round_trips <= 8:
                break

    print(f"{size} bytes, {round_trips} round trips")
    assert size <= 8192
    assert 5 < round_trips <= 8


@pytest.mark.parametrize(
    "noise", ["echo hi", "printf hi", "echo >&2 hi", "printf '@x {}\\n\\033]0;t\\007'", "seq 2000"]
)
def test_what_a_login_shell_prints_does_not_matter(
    spare: Path, prefix: Path, transport: SshTransport, noise: str
) -> None:
    (prefix / "home/.bashrc").write_text(noise + "\n")
    with (
        servers.running(spare, extra=environment(prefix)) as server,
        transport.connect(server.target()) as session,
    ):
        servers.run(session, "true")
        printed = servers.run(session, "true")
        assert printed.stdout + printed.stderr, "the shell printed nothing, so this test shows nothing"
        found = checked(ask(session, OBSERVE), observe.Answer, "the answer")
        assert found.facts.uid == 0


@pytest.mark.parametrize("shell", ["sh", "dash", "bash", "csh", "tcsh", "fish", "zsh", "busybox sh"])
def test_the_command_line_is_the_same_to_every_shell(prefix: Path, shell: str) -> None:
    program, *arguments = shell.split()
    found = next((Path(d) / program for d in ("/bin", "/usr/bin") if (Path(d) / program).exists()), None)
    if found is None:
        pytest.skip(f"no {program} here (apt install {program})")
    done = subprocess.run(
        [found, *arguments, "-c", agent_client.command("cafe", "0" * 64, 0)],
        capture_output=True,
        check=True,
        env={"PATH": "/usr/bin:/bin", "SWARM_PREFIX": str(prefix), "HOME": str(prefix / "home")},
    )
    assert done.stdout == b"\n@cafe need-agent\n"


def test_an_error_of_the_agent_is_a_host_error(spare: Path, prefix: Path, transport: SshTransport) -> None:
    bundle = release()
    request, payload = apply_request(bundle)
    with (
        servers.running(spare, extra=environment(prefix)) as server,
        transport.connect(server.target()) as session,
        pytest.raises(HostError) as caught,
    ):
        ask(session, {**request, "previous": "0" * 16}, payload)
    assert caught.value.kind is Kind.REFUSED
    assert caught.value.message == f"stale plan: it was made for release {'0' * 16}, the host has none"


def test_a_host_without_python_is_an_error(spare: Path, prefix: Path, transport: SshTransport) -> None:
    extra = f"SetEnv PATH={prefix}/bin HOME={prefix}/home"
    with (
        servers.running(spare, extra=extra) as server,
        transport.connect(server.target()) as session,
        pytest.raises(HostError) as caught,
    ):
        ask(session, OBSERVE)
    assert caught.value.message == "the host has no python3"


def without_root(folder: Path, sudo: str) -> LocalSession:
    """The host as ``nobody`` finds it, with this ``sudo`` before any other on the path."""
    tools = folder / "tools"
    tools.mkdir()
    folder.chmod(0o755)
    (tools / "sudo").write_text(sudo)
    (tools / "sudo").chmod(0o755)
    return LocalSession(
        {"PATH": f"{tools}:/usr/bin:/bin", "SWARM_PREFIX": str(folder)},
        ("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"),
    )


class Recorded:
    """A host that sends the same output for every request; ``%n`` stands for the nonce."""

    def __init__(self, output: bytes) -> None:
        self._output = output

    @contextmanager
    def channel(self, command: str, *, limit: int) -> Iterator[Recorded]:
        nonce = command.split(" sh ", 1)[1].split(maxsplit=1)[0]
        yield Recorded(self._output.replace(b"%n", nonce.encode()))

    def exchange(self, stdin: Sequence[bytes], enough: Callable[[bytes], bool], *, timeout: float) -> Output:
        enough(self._output)
        return Output(1, self._output, b"bad \x1b]0;title\x07\n")

    def close(self) -> None: ...


@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user needs root")
@pytest.mark.parametrize(
    "sudo",
    ["#!/bin/sh\necho 'sudo: a password is required' >&2; exit 1\n", "#!/nowhere/sudo: not found\n"],
    ids=["password", "no sudo"],
)
def test_neither_root_nor_sudo_is_a_matter_of_privilege(sudo: str) -> None:
    # Another user may not enter the folders that pytest makes.
    with tempfile.TemporaryDirectory() as folder, pytest.raises(HostError) as caught:
        ask(without_root(Path(folder), sudo), OBSERVE)
    assert caught.value.kind is Kind.PRIVILEGE
    assert "NOPASSWD" in caught.value.hint


@pytest.mark.parametrize(
    ("output", "kind"),
    [
        (b"", Kind.PROTOCOL),
        (b"\n@%n {broken\n", Kind.PROTOCOL),
        (b"\n@%n z:AAAA\n", Kind.PROTOCOL),
        (b'\n@%n {"answer": 7}\n', Kind.PROTOCOL),
        (b'\n@%n {"error": {"kind": "unknown kind", "message": "\\u001b[2J"}}\n', Kind.PROTOCOL),
        (b"\n@%n cannot-keep-agent [Errno 30] Read-only file system\n", Kind.REFUSED),
        (b"\n@%n need-agent\n", Kind.PROTOCOL),
        (b'\n@ffff {"answer": {}}\n', Kind.PROTOCOL),
    ],
)
def test_any_unexpected_output_is_a_harmless_error(output: bytes, kind: Kind) -> None:
    with pytest.raises(HostError) as caught:
        ask(Recorded(output), OBSERVE)
    assert caught.value.kind is kind
    assert caught.value.message.isprintable()


def test_the_same_sources_make_the_same_agent_and_payload() -> None:
    first = agent_client.agent().archive
    onboard_archive._archive.cache_clear()
    assert agent_client.agent().archive == first
    files = {"b": (b"2", 0o644), "a": (b"1", 0o755)}
    assert agent_client.pack(b"{}", files) == agent_client.pack(b"{}", dict(sorted(files.items())))


def test_text_from_a_host_cannot_steer_a_terminal() -> None:
    assert (
        agent_client.printable(b"caf\xc3\xa9 \x1b[2J\x9b \xe2\x80\xae\r") == "café \\x1b[2J\\x9b \\u202e\\r"
    )


@pytest.mark.skipif(not Path("/usr/bin/sudo").exists(), reason="needs sudo (apt install sudo)")
@pytest.mark.skipif(os.geteuid() != 0, reason="needs root to call sudo without a password")
def test_sudo_passes_everything_through(prefix: Path) -> None:
    # The agent as the loader starts it, but through the real sudo even though we are root.
    command = agent_client.command(
        "cafe", agent_client.agent().digest, len(agent_client.agent().archive)
    ).replace('[ "$(id -u)" = 0 ] || exec sudo -n', "exec sudo -n")
    command = command.replace("sudo -n python3", f"sudo -n SWARM_PREFIX={prefix} python3")
    done = subprocess.run(
        ["/bin/sh", "-c", command],
        input=agent_client.agent().archive + b'{"verb":"observe","swarm":"new","payload":0}\n',
        capture_output=True,
        check=False,
        env={"PATH": "/usr/bin:/bin"},
    )
    assert done.stdout.startswith(b"\n@cafe "), done.stderr
    assert (prefix / "opt/swarm/.agent").is_dir()
