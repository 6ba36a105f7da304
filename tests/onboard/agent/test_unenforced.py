"""Whether systemd enforces the IP addresses of a unit, by what ``systemctl show`` says."""

from __future__ import annotations

import pytest
from swarm_onboard.agent import systemd

DENY = "IPAddressDeny=::/0 0.0.0.0/0"


@pytest.mark.parametrize(
    ("shown", "unenforced"),
    [
        (("MainPID=42", DENY, "IPAccounting=yes", "IPIngressBytes=[no data]"), True),
        (("MainPID=42", DENY, "IPAccounting=yes", "IPIngressBytes=18446744073709551615"), True),
        (("MainPID=42", DENY, "IPAccounting=yes", "IPIngressBytes=0"), False),
        (("MainPID=42", DENY, "IPAccounting=no", "IPIngressBytes=[no data]"), False),
        (("MainPID=42", "IPAddressDeny=", "IPAccounting=yes", "IPIngressBytes=[no data]"), False),
        (("MainPID=0", DENY, "IPAccounting=yes", "IPIngressBytes=[no data]"), False),
        (("MainPID=42",), False),
    ],
)
def test_a_list_of_addresses_without_a_count_of_bytes_is_not_enforced(
    monkeypatch: pytest.MonkeyPatch, shown: tuple[str, ...], unenforced: bool
) -> None:
    monkeypatch.setattr(systemd, "call", lambda command, timeout: "\n".join(shown))
    assert systemd.states(["k3.service"])["k3.service"].unenforced is unenforced
