#!/usr/bin/env python3
"""The WireGuard of a swarm on a host: ``tunnel.py --interface NAME --address A`` and three files.

The interface is there while this program runs. It follows its files: other peers, other keys of theirs or
another key of this host restart nothing.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from swarm_onboard.common.systemd import Notifier
from swarm_onboard.tunnel.interface import FRESH, Interface, WireguardError, forward_from
from swarm_onboard.tunnel.keys import Keys
from swarm_onboard.tunnel.peers import chosen, config

_LOOK_EVERY = 1.0  # s
_SELDOM = 10  # looks between two counts of handshakes, and between two attempts with peers that wg refuses


class Wanted:
    """What the files have: the peers of the release, and the known keys."""

    def __init__(self, peers: Path, keys: Path) -> None:
        self._peers_file, self._keys_file = peers, keys
        self._peers = json.loads(peers.read_text("utf-8"))
        self._keys = Keys()
        self._met: set[str] = set()  # public keys with which there was a handshake

    def config(self) -> str:
        """Returns the peers as wg reads them. A file that cannot be read counts as it was."""
        with suppress(OSError, ValueError):
            self._peers = json.loads(self._peers_file.read_text("utf-8"))
        with suppress(OSError):
            self._keys = Keys(self._keys_file.read_text("utf-8", "replace"))
        return config(self._keys, self._peers, self._met)

    @property
    def changing(self) -> bool:
        """Whether a peer has several keys: the next one counts once there was a handshake with it."""
        return any(len(self._keys.live.get(one["name"], ())) > 1 for one in self._peers["peers"])

    def look_at(self, interface: Interface) -> str:
        """Takes note of handshakes. Returns with how many peers there was one lately. Raises
        ``WireguardError``."""
        times = interface.handshakes()
        self._met.update(key for key, last in times.items() if last)
        used = chosen(self._keys, self._peers, self._met).values()
        fresh = sum(times.get(key, 0) > time.time() - FRESH for key in used)
        return f"{fresh} of {len(used)} peers with a handshake in the last 3 min"


def main(arguments: list[str]) -> int:
    """Runs the program. Returns its exit status."""
    parser = argparse.ArgumentParser(description="Make the WireGuard interface of a swarm on this host.")
    parser.add_argument("--interface", required=True, help="its name, such as wg-lab")
    parser.add_argument("--address", required=True, help="the host's address in it, such as 10.200.3.7/16")
    parser.add_argument("--mtu", type=int, default=1280, help="the largest packet in it, bytes")
    parser.add_argument("--peers", type=Path, required=True, help="JSON file of the release: who they are")
    parser.add_argument("--keys", type=Path, required=True, help="file with the public keys of hosts")
    parser.add_argument("--relay", action="store_true", help="forward packets from one peer to another")
    parser.add_argument("--key", type=Path, required=True, help="file with the private key")
    options = parser.parse_args(arguments)
    ended = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: ended.set())
    interface = Interface(options.interface, options.key)
    try:
        wanted = Wanted(options.peers, options.keys)
        try:
            interface.make()
            used = wanted.config()
            interface.bring_up(options.address, options.mtu, used)
            if options.relay:
                forward_from(options.interface)
            return _serve(interface, wanted, used, ended)
        finally:
            interface.remove()
    except (OSError, ValueError, WireguardError) as error:
        print(error, file=sys.stderr)
        return 1


def _serve(interface: Interface, wanted: Wanted, used: str, ended: threading.Event) -> int:
    """Follows the files until a signal arrives, or the interface is gone."""
    notifier, looks, refused = Notifier(), 0, ""
    notifier.ready()
    while not ended.is_set():
        if trouble := interface.trouble():
            print(trouble, file=sys.stderr)
            return 1
        seldom = looks % _SELDOM == 0
        if seldom or wanted.changing:
            with suppress(WireguardError):  # the next look shows whether the interface is gone
                notifier.status(wanted.look_at(interface))
        new = wanted.config()
        if (new != used or interface.has_another_key()) and (new != refused or seldom):
            try:
                interface.use(new)
                used, refused = new, ""
            except WireguardError as error:
                if new != refused:
                    print(f"{error}; the peers stay as they were", file=sys.stderr, flush=True)
                refused = new
        looks += 1
        notifier.beat()
        ended.wait(min(_LOOK_EVERY, notifier.interval or _LOOK_EVERY))
    notifier.stopping()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
