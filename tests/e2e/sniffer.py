"""Counts what SSH costs: connections, bytes and round trips of every host, seen on the lab's own network."""

from __future__ import annotations

import select
import socket
import struct
import threading
from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.hosts import network

ETH_P_ALL, ETH_P_IP = 0x0003, 0x0800  # only a socket for all protocols receives what we send
SYN, ACK = 0x02, 0x10
SSH = 22


@dataclass
class Talk:
    """What went between us and one host. A round trip: we spoke, and then the host did."""

    connections: int = 0
    payload: int = 0
    on_wire: int = 0
    round_trips: int = 0
    _we_spoke: bool = False

    def add(self, size: int, payload: int, flags: int, *, ours: bool) -> None:
        self.connections += flags & (SYN | ACK) == SYN
        self.payload += payload
        self.on_wire += size
        if payload or flags & SYN:
            self.round_trips += self._we_spoke and not ours
            self._we_spoke = ours


@contextmanager
def listening(namespace: Path, bridge: str = "br0") -> Iterator[Mapping[str, Talk]]:
    """The talks begun while the block runs, by the host's address; complete once it has been left."""
    wire = network.within(namespace, lambda: _tapped(bridge))
    talks: defaultdict[str, Talk] = defaultdict(Talk)
    over = threading.Event()
    thread = threading.Thread(target=_listen, args=(wire, talks, over), daemon=True)
    thread.start()
    try:
        yield talks
    finally:
        over.set()
        thread.join()
        wire.close()


def _tapped(bridge: str) -> socket.socket:
    wire = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, socket.htons(ETH_P_ALL))
    wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
    wire.bind((bridge, ETH_P_ALL))
    wire.setblocking(False)
    return wire


def _listen(wire: socket.socket, talks: defaultdict[str, Talk], over: threading.Event) -> None:
    begun: set[tuple[str, int]] = set()
    while True:
        ready, _, _ = select.select([wire], [], [], 0.1)
        if ready:
            packet, address = wire.recvfrom(1 << 16)
            if address[1] == ETH_P_IP:
                _take(packet, talks, begun)
        elif over.is_set():
            return


def _take(packet: bytes, talks: defaultdict[str, Talk], begun: set[tuple[str, int]]) -> None:
    header = (packet[0] & 15) * 4
    if packet[9] != socket.IPPROTO_TCP:
        return
    size = int.from_bytes(packet[2:4], "big")
    source, target = struct.unpack("!HH", packet[header : header + 4])
    if SSH not in (source, target):
        return
    flags = packet[header + 13]
    ours = target == SSH
    host = socket.inet_ntoa(packet[16:20] if ours else packet[12:16])
    talk = (host, source if ours else target)
    if ours and flags & (SYN | ACK) == SYN:
        begun.add(talk)
    if talk in begun:
        payload = size - header - (packet[header + 12] >> 4) * 4
        talks[host].add(size, payload, flags, ours=ours)
