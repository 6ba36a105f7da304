"""The program ``ssh`` as a transport: what only it can, what the user's own files may decide, and its end."""

from __future__ import annotations

import gc
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl.remote import openssh
from swarmctl.remote.openssh import OpenSshTransport
from swarmctl.remote.transport import HostError, Kind, Target
from tests.remote import sshd as servers
from tests.remote.conftest import with_openssh
from tests.remote.sshd import Sshd
from tests.timing import wait_for

# A proxy command in the language of the tests: no nc, no socat.
PIPE = (
    "import os,socket,sys,threading;"
    "s=socket.create_connection(('127.0.0.1',int(sys.argv[1])));"
    "t=threading.Thread(target=lambda:[s.sendall(p) for p in iter(lambda:os.read(0,9999),b'')],daemon=True);"
    "t.start();[os.write(1,p) for p in iter(lambda:s.recv(9999),b'')]"
)


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """The operator's folder ``.ssh``."""
    (tmp_path / "ssh").mkdir()
    return tmp_path / "ssh"


def refused(transport: OpenSshTransport, target: Target) -> HostError:
    with pytest.raises(HostError) as caught, transport.connect(target):
        pass
    return caught.value


def children() -> list[int]:
    """The processes that this one has started and that still run."""
    path = Path(f"/proc/{os.getpid()}/task")
    return [int(pid) for task in path.iterdir() for pid in (task / "children").read_text().split()]


def test_a_proxy_command_leads_to_the_host(sshd: Sshd) -> None:
    command = f'{sys.executable} -c "{PIPE}" %p'
    target = sshd.target(address="pi.invalid", proxy_command=command)
    with with_openssh().connect(target) as session:
        assert servers.run(session, "echo far").stdout == b"far\n"


def test_of_a_proxy_command_that_fails_the_last_words_are_shown(sshd: Sshd) -> None:
    # A shell of its own: ssh would see the end of what it executes itself before the text is written.
    command = "sh -c \"echo 'log in\033[2J first' >&2; exit 1\""
    error = refused(with_openssh(), sshd.target(proxy_command=command))
    assert error.kind is Kind.UNREACHABLE
    assert error.message.endswith("cannot be reached: log in\\x1b[2J first")


WEAKER = """
StrictHostKeyChecking no
NoHostAuthenticationForLocalhost yes
VerifyHostKeyDNS yes
UserKnownHostsFile {known}
GlobalKnownHostsFile {known}
KnownHostsCommand /bin/cat {known}
HostKeyAlias another
UpdateHostKeys yes
"""
COMMANDS = """
PermitLocalCommand yes
LocalCommand touch {trap}
RemoteCommand touch {trap}
ProxyCommand touch {trap}
ControlMaster auto
ControlPath {trap}
ControlPersist yes
ForwardAgent yes
HostName 192.0.2.1
User nobody
Port 1
LogLevel QUIET
BatchMode no
LocalForward {trap}.sock 127.0.0.1:22
"""


def test_no_file_of_the_user_makes_a_wrong_host_key_right(
    home: Path, tmp_path: Path, spare: Path, sshd: Sshd
) -> None:
    with servers.running(spare) as server:
        known = tmp_path / "known"
        known.write_text(f"pi,another,127.0.0.1,[127.0.0.1]:{server.port} {server.keys[0]}\n")
        (home / "config").write_text(WEAKER.format(known=known))
        for target in (server.target(keys=sshd.keys), server.target(keys=())):
            assert refused(with_openssh(home), target).kind is Kind.HOST_KEY
        assert "userauth" not in server.log


def test_no_file_of_the_user_runs_or_leads_elsewhere(home: Path, tmp_path: Path, sshd: Sshd) -> None:
    trap = tmp_path / "trap"
    (home / "config").write_text(COMMANDS.format(trap=trap))
    with with_openssh(home).connect(sshd.target()) as session:
        assert servers.run(session, "echo [$SSH_AUTH_SOCK]").stdout == b"[]\n"
    assert list(tmp_path.glob("trap*")) == []


@pytest.mark.parametrize("pattern", ["pi", "127.0.0.*"], ids=["its name", "its address"])
def test_what_the_users_file_allows_is_used(spare: Path, home: Path, pattern: str) -> None:
    with servers.running(spare, extra="Ciphers aes256-cbc") as server:
        assert "~/.ssh/config" in refused(with_openssh(home), server.target()).hint
        (home / "config").write_text(f"Host {pattern}\n Ciphers +aes256-cbc\n")
        with with_openssh(home).connect(server.target()):
            pass


def test_a_wrong_line_in_the_users_file_is_named(home: Path, sshd: Sshd) -> None:
    (home / "config").write_text("Host *\n BindAddress\n")
    error = refused(with_openssh(home), sshd.target())
    assert f"{home}/config line 2" in error.message


def test_a_key_that_others_can_read_is_named(tmp_path: Path, sshd: Sshd) -> None:
    key = tmp_path / "key"
    key.write_bytes(sshd.identity.read_bytes())
    key.chmod(0o644)
    error = refused(with_openssh(), sshd.target(identities=(key,)))
    assert (error.kind, error.message) == (
        Kind.AUTH, f"the private key {key} cannot be used: bad permissions"
    )  # fmt: skip


@pytest.mark.parametrize("name", ["-oProxyCommand=x", "a b", "$(touch x)", "x'y", "a\nHost b"])
def test_no_name_is_an_option_or_a_command(sshd: Sshd, name: str) -> None:
    for changes in ({"host": name}, {"address": name}, {"user": name}):
        assert "ssh cannot be given the name" in refused(with_openssh(), sshd.target(**changes)).message


def test_a_killed_ssh_is_a_lost_connection_and_the_next_one_works(sshd: Sshd) -> None:
    before = set(children())
    transport = with_openssh()
    with transport.connect(sshd.target()) as session:
        (pid,) = {pid for pid in children() if b"-N" in Path(f"/proc/{pid}/cmdline").read_bytes()} - before
        with pytest.raises(HostError) as caught:
            servers.run_until(session, lambda: os.kill(pid, signal.SIGKILL))
        with pytest.raises(HostError) as again:
            servers.run(session, "true")
    assert (caught.value.kind, again.value.kind) == (Kind.LOST, Kind.LOST)
    assert "connection was lost" in caught.value.message
    with transport.connect(sshd.target()) as session:
        assert servers.run(session, "echo back").stdout == b"back\n"
    assert not Path(f"/proc/{pid}").exists(), "not reaped"


def test_its_files_are_private_and_gone_afterwards(sshd: Sshd) -> None:
    before = set(children())
    transport = with_openssh()
    with transport.connect(sshd.target()) as session:
        folder = session._control.parent
        modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()}
        assert modes == dict.fromkeys(("config", "known_hosts", "ctl", "log"), 0o600)
        assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert list(folder.parent.iterdir()) == []
    del transport
    gc.collect()
    wait_for(lambda: not folder.parent.exists())
    assert set(children()) <= before


KILLED = """
import sys, time
from pathlib import Path
from tests.remote import sshd as servers
from tests.remote.conftest import with_openssh
from swarmctl.remote.transport import Target
address, port, key, identity = sys.argv[1:]
target = Target("pi", address, "root", int(port), (key,), (Path(identity),))
with with_openssh().connect(target) as session:
    servers.run(session, "true")
    try:
        print(session._process.pid, session._control, flush=True)
        time.sleep(600)
    except KeyboardInterrupt:
        print(servers.run(session, "echo still there").stdout.decode(), flush=True)
        time.sleep(600)
"""


def test_ctrl_c_leaves_the_connection_and_kill_9_leaves_nothing(sshd: Sshd) -> None:
    arguments = [sys.executable, "-c", KILLED, "127.0.0.1", str(sshd.port), sshd.keys[2], str(sshd.identity)]
    with subprocess.Popen(
        arguments, cwd=Path(__file__).parents[2], stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as operator:
        assert operator.stdout is not None
        pid, control = operator.stdout.readline().split()
        assert Path(control).exists()
        os.killpg(operator.pid, signal.SIGINT)
        assert operator.stdout.readline() == "still there\n"
        operator.kill()
    wait_for(lambda: not Path(f"/proc/{pid}").exists())
    wait_for(lambda: not Path(control).parents[1].exists())


def test_without_the_program_the_error_names_its_package(sshd: Sshd, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(openssh, "PROGRAM", "no-such-ssh")
    error = refused(with_openssh(), sshd.target())
    assert error.message == "the program `ssh` is not installed on this machine"
    assert "openssh-client" in error.hint
