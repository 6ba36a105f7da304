"""An error of a lost connection names the packets that had to be sent again, where these were many."""

from __future__ import annotations

import pytest

from swarmctl.remote.ssh_errors import lost, rejected, unfinished, with_losses
from swarmctl.remote.tcp import dial
from swarmctl.remote.transport import Target
from tests.remote.sshd import Sshd
from tests.timing import PATIENCE


@pytest.mark.parametrize(
    ("sent_again", "named"),
    [((9, 41), True), ((3, 30), True), ((2, 5), False), ((3, 31), False), ((0, 0), False)],
)
def test_many_packets_that_were_sent_again_are_a_reason(sent_again: tuple[int, int], named: bool) -> None:
    for error in (lost("pi"), unfinished("pi", 50)):
        found = with_losses(error, sent_again)
        assert found.message.startswith(error.message)
        assert ("had to be sent again" in found.message) is ("link loses packets" in found.hint) is named


def test_other_errors_have_other_reasons() -> None:
    error = rejected(Target("pi", "127.0.0.1", "robot", 22), ["id_rsa"])
    assert with_losses(error, (9, 41)) is error


def test_a_connection_knows_what_it_sent_again_also_once_it_is_closed(sshd: Sshd) -> None:
    link = dial(sshd.target(), PATIENCE, acknowledgement=PATIENCE)
    link.settimeout(PATIENCE)
    before = link.sent_again()
    link.recv(1)
    link.sendall(b"SSH-2.0-me\r\n")
    link.close()
    assert link.sent_again()[0] == before[0] == 0
    assert link.sent_again()[1] > before[1] > 0
