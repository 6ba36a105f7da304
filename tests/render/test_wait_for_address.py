"""``wait-for-address``: a master starts once its host has its address, not on `network-online.target`."""

from __future__ import annotations

import subprocess
import sys

import pytest

from swarmctl import resources
from tests.timing import PATIENCE

PROGRAM = resources.templates() / "host/wait-for-address"


def wait(address: str, within: float = 0.1) -> tuple[int, str]:
    argv = [sys.executable, str(PROGRAM), address, "--within", str(within)]
    done = subprocess.run(argv, capture_output=True, text=True, timeout=PATIENCE, check=False)
    return done.returncode, done.stderr.strip()


@pytest.mark.parametrize("address", ["127.0.0.1", "localhost"])
def test_an_address_of_this_host_is_found_at_once(address: str) -> None:
    assert wait(address) == (0, "")


@pytest.mark.parametrize("address", ["192.0.2.7", "2001:db8::7", "no-such-host.invalid"])
def test_another_is_waited_for_and_then_named(address: str) -> None:
    assert wait(address) == (1, f"this host has no address {address} after 0.1 s")
