"""Logging in to a real sshd: whom we trust, whom we refuse, and that every wait ends."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import threading
from pathlib import Path

import pytest

from swarmctl.remote.known_hosts import fingerprint
from swarmctl.remote.ssh import HopSocket
from swarmctl.remote.ssh_limits import Timeouts
from swarmctl.remote.transport import HostError, Kind, Target
from tests.ports import free_port
from tests.remote import sshd as servers
from tests.remote.conftest import AnySsh, MakeTransport
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE, wait_for


def refused(transport: AnySsh, target: Target) -> HostError:
    with pytest.raises(HostError) as caught, transport.connect(target):
        pass
    return caught.value


def lines_about_auth(log: str) -> list[str]:
    return [
        line for line in log.splitlines() if re.search("userauth|publickey|Postponed|Accepted|Failed", line)
    ]


def test_a_pinned_host_lets_us_in(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        done = servers.run(session, "echo hello; echo oh >&2; head -c 6; exit 3", [b"to ", b"you"])
    assert (done.status, done.stdout, done.stderr) == (3, b"hello\nto you", b"oh\n")


@pytest.mark.parametrize(("end", "status"), [("exit 255", 255), ("kill -9 $$", -1)])
def test_an_ended_command_is_no_lost_connection(sshd: Sshd, transport: AnySsh, end: str, status: int) -> None:
    with transport.connect(sshd.target()) as session:
        assert servers.run(session, end).status == status
        assert servers.run(session, "echo still here").stdout == b"still here\n"


@pytest.mark.parametrize("index", [0, 1, 2], ids=["rsa", "ecdsa", "ed25519"])
def test_any_one_pinned_key_is_enough_whatever_others_the_host_has(
    sshd: Sshd, transport: AnySsh, index: int
) -> None:
    with transport.connect(sshd.target(keys=(sshd.keys[index],))):
        pass


def test_a_host_without_a_pinned_key_is_named_with_its_fingerprint(sshd: Sshd, transport: AnySsh) -> None:
    error = refused(transport, sshd.target(keys=()))

    assert error.kind is Kind.HOST_KEY
    assert fingerprint(sshd.keys[2]) in error.message
    assert "swarmctl trust SPEC" in error.hint


@pytest.mark.parametrize("kind", ["ed25519", "ecdsa", "rsa"])
def test_a_changed_key_is_refused_before_authentication(
    spare: Path, tmp_path: Path, transport: AnySsh, kind: str
) -> None:
    other = servers.make_key(tmp_path / "other", kind)
    with servers.running(spare) as server:
        error = refused(transport, server.target(keys=(other,)))
        assert lines_about_auth(server.log) == []
        with transport.connect(server.target()):
            pass
        assert lines_about_auth(server.log)  # the log shows logins

    assert error.kind is Kind.HOST_KEY
    assert fingerprint(other) in error.message
    assert fingerprint(server.keys[0]) in error.message
    assert "trust SPEC --host pi --replace" in error.hint


def test_the_key_of_another_host_is_not_good_for_this_one(spare: Path, sshd: Sshd, transport: AnySsh) -> None:
    with servers.running(spare) as server:
        assert refused(transport, server.target(keys=sshd.keys)).kind is Kind.HOST_KEY


def test_a_scan_sees_the_strongest_key_without_logging_in(spare: Path, transport: AnySsh) -> None:
    with servers.running(spare, kinds=("rsa", "ed25519")) as server:
        assert transport.scan(server.target(keys=())) == server.keys[1]
        assert lines_about_auth(server.log) == []


def test_a_failed_login_names_the_user_and_the_keys_tried(spare: Path, transport: AnySsh) -> None:
    with servers.running(spare, authorize=False) as server:
        error = refused(transport, server.target())
        assert "password" not in "".join(lines_about_auth(server.log))

    assert error.kind is Kind.AUTH
    assert error.message == f"pi rejected the login of root; tried {server.identity}"
    assert "ssh-copy-id" in error.hint


def test_a_revoked_host_key_is_refused_although_it_is_pinned(sshd: Sshd, transport: AnySsh) -> None:
    error = refused(transport, sshd.target(revoked=sshd.keys))

    assert error.kind is Kind.HOST_KEY
    assert "shows a revoked host key" in error.message


def test_without_any_key_nothing_is_tried(sshd: Sshd, transport: AnySsh) -> None:
    error = refused(transport, sshd.target(identities=()))

    assert error.kind is Kind.AUTH
    assert "no private key" in error.message


def test_the_default_key_is_used_when_none_is_named(sshd: Sshd, tmp_path: Path, make: MakeTransport) -> None:
    shutil.copy(sshd.identity, tmp_path / "id_ed25519")
    with make(tmp_path).connect(sshd.target(identities=())):
        pass


def test_a_key_with_a_passphrase_and_one_that_is_missing_are_named(
    spare: Path, tmp_path: Path, transport: AnySsh
) -> None:
    public = servers.make_key(tmp_path / "locked", passphrase="open sesame")
    with servers.running(spare) as server:
        (spare / "authorized").write_text(public + "\n")
        locked = refused(transport, server.target(identities=(tmp_path / "locked",)))
        missing = refused(transport, server.target(identities=(tmp_path / "nowhere",)))

    assert (locked.kind, missing.kind) == (Kind.AUTH, Kind.AUTH)
    assert "has a passphrase" in locked.message
    assert "ssh-add" in locked.hint
    assert "does not exist" in missing.message


def test_kinds_of_unreachable_hosts_are_distinguished(sshd: Sshd, transport: AnySsh) -> None:
    closed = refused(transport, sshd.target(port=free_port()))
    nameless = refused(transport, sshd.target(address="no-such-host.invalid"))

    assert (closed.kind, nameless.kind) == (Kind.UNREACHABLE, Kind.UNREACHABLE)
    assert "nothing listens for SSH" in closed.message
    assert "cannot resolve no-such-host.invalid" in nameless.message
    assert closed.retryable
    assert not closed.reached


def test_a_port_that_sends_nothing_times_out(impatient: AnySsh, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        error = refused(impatient, Target("pi", "127.0.0.1", "root", listener.getsockname()[1]))

    assert error.message.endswith("accepts the connection but sends no SSH banner")


def test_a_flooding_command_is_cut_off(sshd: Sshd, transport: AnySsh) -> None:
    for flood in ("yes", "yes >&2"):
        with transport.connect(sshd.target()) as session, pytest.raises(HostError) as caught:
            servers.run(session, flood, limit=1 << 16, timeout=PATIENCE)
        assert caught.value.kind is Kind.PROTOCOL
        assert "more than 65536 bytes" in caught.value.message


def test_much_on_both_streams_at_once_does_not_stall(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        done = servers.run(
            session,
            "head -c 3000000 /dev/zero >&2; head -c 5000000 | wc -c",
            [b"x" * 5_000_000],
            limit=4 << 20,
            timeout=PATIENCE,
        )
    assert len(done.stderr) == 3_000_000
    assert done.stdout.strip() == b"5000000"


def test_a_command_that_reads_nothing_ends_all_the_same(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        assert servers.run(session, "exit 7", [b"x" * 5_000_000], timeout=PATIENCE).status == 7


def test_a_hanging_command_ends_at_its_deadline(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session, pytest.raises(HostError) as caught:
        servers.run(session, "echo $$; exec cat", timeout=0.7)  # cat ends with its connection
    assert caught.value.message == "pi did not finish within 0.7 s"
    assert caught.value.kind is Kind.LOST


def test_a_child_that_holds_the_streams_does_not_hold_us(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        done = servers.run(session, "sleep 3600 & echo $!", timeout=3600)  # whose end nobody waits for
    os.kill(int(done.stdout), signal.SIGTERM)


def test_a_frozen_server_is_given_up_on(spare: Path, transport: AnySsh) -> None:
    with servers.running(spare) as server, transport.connect(server.target()) as session:
        servers.run(session, "true")
        for child in server.children():
            os.kill(child, signal.SIGSTOP)
        with pytest.raises(HostError) as caught:
            servers.run(session, "true", timeout=1)
    assert caught.value.kind is Kind.LOST
    assert caught.value.message == "pi did not finish within 1 s"


def test_a_broken_connection_is_reported_as_lost(spare: Path, transport: AnySsh) -> None:
    with servers.running(spare) as server, transport.connect(server.target()) as session:

        def kill() -> None:
            for child in server.children():
                os.kill(child, signal.SIGKILL)

        with pytest.raises(HostError) as caught:
            servers.run_until(session, kill)
    assert caught.value.kind is Kind.LOST
    assert "connection was lost" in caught.value.message


def test_closing_from_another_thread_ends_a_command(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        closing = threading.Thread(target=session.close)
        with pytest.raises(HostError) as caught:
            servers.run_until(session, closing.start)
        closing.join()
    assert caught.value.kind is Kind.LOST
    assert "connection was lost" in caught.value.message


def test_through_a_jump_host_each_hop_is_checked(
    spare: Path, tmp_path: Path, sshd: Sshd, transport: AnySsh
) -> None:
    other = servers.make_key(tmp_path / "other")
    with servers.running(spare) as gate:
        through = sshd.target(jump=gate.target(host="gate"))
        with transport.connect(through) as session:
            assert servers.run(session, "echo far").stdout == b"far\n"
        assert "direct-tcpip" in gate.log

        bad_gate = refused(transport, sshd.target(jump=gate.target(host="gate", keys=(other,))))
        bad_end = refused(transport, sshd.target(keys=(other,), jump=gate.target(host="gate")))
        nobody = refused(transport, sshd.target(port=1, jump=gate.target(host="gate")))

    assert (bad_gate.kind, bad_end.kind) == (Kind.HOST_KEY, Kind.HOST_KEY)
    assert bad_gate.message.startswith("gate ")
    assert bad_end.message.startswith("pi ")
    assert nobody.kind is Kind.UNREACHABLE
    assert "cannot be reached through gate" in nobody.message


def test_all_hosts_behind_a_jump_host_share_one_login_to_it(
    spare: Path, sshd: Sshd, transport: AnySsh
) -> None:
    with servers.running(spare, extra="MaxStartups 5:100:5") as gate:
        behind = [sshd.target(host=f"pi{n}", jump=gate.target(host="gate")) for n in range(12)]
        errors: list[HostError] = []

        def enter(target: Target) -> None:
            try:
                with transport.connect(target) as session:
                    servers.run(session, "sleep 0.3")
            except HostError as error:
                errors.append(error)

        threads = [threading.Thread(target=enter, args=(target,)) for target in behind]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert errors == []
        assert gate.log.count("Accepted publickey") < 4  # the debug log may list one login several times
        with transport.connect(behind[0]):  # after the last user the hop was closed; this opens it anew
            pass


def test_a_dead_jump_host_is_tried_once_for_all_behind_it(sshd: Sshd, impatient: AnySsh) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        gate = Target("gate", "127.0.0.1", "root", silent.getsockname()[1])
        errors: list[HostError] = []

        def enter() -> None:
            errors.append(refused(impatient, sshd.target(jump=gate)))

        threads = [threading.Thread(target=enter) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        silent.setblocking(False)
        silent.accept()[0].close()
        with pytest.raises(BlockingIOError):  # there was no second connection
            silent.accept()
    assert {error.message for error in errors} == {
        f"gate (127.0.0.1, port {gate.port}) accepts the connection but sends no SSH banner"
    }


def test_a_jump_host_that_was_restarted_is_logged_in_to_again(
    spare: Path, sshd: Sshd, transport: AnySsh
) -> None:
    with servers.running(spare) as gate:
        behind = sshd.target(jump=gate.target(host="gate"))
        with transport.connect(behind):
            gate.end_connections()

            def reached() -> bool:
                try:
                    with transport.connect(behind) as session:
                        return servers.run(session, "echo far").stdout == b"far\n"
                except HostError:
                    return False

            wait_for(reached)


def test_a_server_that_drops_newcomers_is_tried_again(spare: Path, make: MakeTransport) -> None:
    patient = make(timeouts=Timeouts(2, PATIENCE, PATIENCE, PATIENCE), attempts=8)
    with servers.running(spare, extra="MaxStartups 1:50:2") as server:
        errors: list[HostError] = []

        def enter() -> None:
            try:
                with patient.connect(server.target()) as session:
                    servers.run(session, "true")
            except HostError as error:
                errors.append(error)

        threads = [threading.Thread(target=enter) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert "MaxStartups" in server.log or "drop connection" in server.log
    assert errors == []


def test_weak_algorithms_are_not_spoken(spare: Path, transport: AnySsh) -> None:
    with servers.running(spare, extra="Ciphers aes256-cbc\nMACs hmac-sha1") as server:
        error = refused(transport, server.target())
    assert error.kind is Kind.UNREACHABLE
    assert "aes256-cbc: no longer safe" in error.message


def test_nothing_is_forwarded_to_the_host(sshd: Sshd, transport: AnySsh) -> None:
    with transport.connect(sshd.target()) as session:
        assert servers.run(session, "echo [$SSH_AUTH_SOCK$DISPLAY]").stdout == b"[]\n"


def test_nothing_is_sent_through_a_hop_that_was_closed_meanwhile() -> None:
    """sshd ends the connection to the jump host for it, and with that all hosts behind it."""
    done: list[str] = []
    sending, sent = threading.Event(), threading.Event()

    class Channel:
        def send(self, data: bytes) -> int:
            sending.set()
            sent.wait()
            done.append("sent")
            return len(data)

        def close(self) -> None:
            done.append("closed")

    hop = HopSocket(Channel())
    threads = [threading.Thread(target=hop.send, args=(b"x",)), threading.Thread(target=hop.close)]
    threads[0].start()
    sending.wait()
    threads[1].start()
    threads[1].join(0.2)
    sent.set()
    for thread in threads:
        thread.join()
    assert done == ["sent", "closed"]
