#!/usr/bin/env python3
"""The WireGuard of a swarm on a host: ``tunnel.py --interface NAME --address A --peers FILE --key FILE``.

The interface is there while this program runs. A deploy brings other peers, and restarts nothing for them.
"""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from contextlib import suppress
from pathlib import Path

from swarm_onboard.common.systemd import Notifier
from swarm_onboard.tunnel.interface import Interface, WireguardError

_LOOK_EVERY = 1.0  # s
_SELDOM = 10  # looks between two counts of handshakes, and between two attempts with peers that wg refuses


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Make the WireGuard interface of a swarm on this host.")
    parser.add_argument("--interface", required=True, help="its name, such as wg-lab")
    parser.add_argument("--address", required=True, help="the host's address in it, such as 10.200.3.7/16")
    parser.add_argument("--mtu", type=int, default=1280, help="the largest packet in it, bytes")
    parser.add_argument("--peers", type=Path, required=True, help="file in the format of `wg setconf`")
    parser.add_argument("--key", type=Path, required=True, help="file with the private key")
    options = parser.parse_args(arguments)
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: ended.set())
    interface = Interface(options.interface, options.key)
    try:
        peers = options.peers.read_bytes()
        try:
            interface.make()
            interface.bring_up(options.address, options.mtu, peers)
            return _serve(interface, options.peers, peers, ended)
        finally:
            interface.remove()
    except (OSError, WireguardError) as error:
        print(error, file=sys.stderr)
        return 1


def _serve(interface: Interface, path: Path, peers: bytes, ended: threading.Event) -> int:
    """Follows the file of peers until a signal arrives, or the interface is gone."""
    notifier, looks, refused = Notifier(), 0, peers
    notifier.ready()
    while not ended.is_set():
        if trouble := interface.trouble():
            print(trouble, file=sys.stderr)
            return 1
        seldom = looks % _SELDOM == 0
        new = _content(path, peers)
        if new != peers and (new != refused or seldom):
            try:
                interface.use(new)
                peers = new
            except WireguardError as error:
                if new != refused:
                    print(f"{path}: {error}; the peers stay as they were", file=sys.stderr, flush=True)
                refused = new
        if seldom:
            with suppress(WireguardError):  # the next look shows whether the interface is gone
                fresh, every = interface.handshakes()
                notifier.status(f"{fresh} of {every} peers with a handshake in the last 3 min")
        looks += 1
        notifier.beat()
        ended.wait(min(_LOOK_EVERY, notifier.interval or _LOOK_EVERY))
    notifier.stopping()
    return 0


def _content(path: Path, before: bytes) -> bytes:
    """What the file has now; what it had before if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError:
        return before


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
