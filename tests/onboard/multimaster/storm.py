"""A storm over three islands: random events, then all masters must match the model. Prints figures.

storm.py IMAGE SEED EVENTS
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from tests.onboard.multimaster import network_faults
from tests.onboard.multimaster.many_islands import (
    ISLANDS,
    Archipelago,
    address,
    master_uri,
    parameters,
    sync_node,
)
from tests.onboard.multimaster.network_faults import RECEIVES, Model, Node
from tests.onboard.multimaster.nodehost import KIND

CALMS = 10  # pauses in which the masters are compared with the model
PATIENCE = 12.0  # s within which all masters must match the model
RECORD = "/multimaster/record"
ROUNDS = 20  # looks at a master until two of them find the same nodes


class Storm:
    def __init__(self, islands: Archipelago) -> None:
        self.islands, self.model = islands, Model()
        self.leaks: list[str] = []
        self.shut_down: list[str] = []
        self.races = 0
        self._hosts: dict[str, subprocess.Popen[bytes]] = {}
        for island in ISLANDS:
            islands.start_master(island)
            islands.configure(island, parameters(island, RECEIVES[island], KIND))
            islands.start_sync(island)
            script = str(Path(__file__).with_name("nodehost.py"))
            argv = (sys.executable, script, address(island), master_uri(island))
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
            self._hosts[island] = islands.popen(island, *argv, chroot=False, **pipes)

    def command(self, island: str, *command: Any) -> Any:
        """Send a command to the fake nodes of ``island``; returns the answer."""
        host = self._hosts[island]
        assert host.stdin
        assert host.stdout
        host.stdin.write(json.dumps(command).encode() + b"\n")
        host.stdin.flush()
        return json.loads(host.stdout.readline())

    def happen(self, event: network_faults.Event) -> None:
        kind, *details = event
        getattr(self, "_" + kind.replace(" ", "_"))(*details)

    def _start(self, island: str, name: str, publishes: list[str], subscribes: list[str]) -> None:
        uri = self.command(island, "start", name, publishes, subscribes)
        self.model.nodes[island][name] = Node(set(publishes), set(subscribes), uri)

    def _add(self, island: str, name: str, topic: str) -> None:
        self.command(island, "add", name, topic)
        self.model.nodes[island][name].publishes.add(topic)

    def _drop(self, island: str, name: str, topic: str) -> None:
        self.command(island, "drop", name, topic)
        self.model.nodes[island][name].publishes.discard(topic)

    def _stop(self, island: str, name: str) -> None:
        node = self.model.nodes[island].pop(name)
        self.command(island, "stop", name, sorted(node.publishes), sorted(node.subscribes))

    def _die(self, island: str, name: str) -> None:
        self.command(island, "die", name)  # all masters keep its registrations

    def _cut(self, one: str, other: str) -> None:
        self.islands.cut(one, other)

    def _heal(self) -> None:
        self.islands.heal()

    def _restart_master(self, island: str) -> None:
        self.command(island, "forget")
        self.model.nodes[island].clear()
        self.islands.kill_master(island)
        self.islands.start_master(island)

    def _kill_sync(self, island: str) -> None:
        self.islands.end_sync(island, signal.SIGKILL)
        self.islands.start_sync(island)

    def _stop_sync(self, island: str) -> None:
        self.islands.end_sync(island, signal.SIGTERM)
        self.islands.start_sync(island)

    def look_for_leaks(self) -> None:
        """Every foreign publisher at a master must be declared for the island that it is from."""
        for island in ISLANDS:
            hosts = {f"//{address(peer)}:": set(topics) for peer, topics in RECEIVES[island].items()}
            for topic, node, uri in self._seen(island)[0]:
                declared = next((topics for host, topics in hosts.items() if host in uri), None)
                if declared is not None and topic not in declared:
                    self.leaks.append(f"{island} has {topic} of {node} at {uri}")

    def calm(self) -> float:
        """Heal all partitions; returns the s until both sides of every bridge match the model."""
        self.islands.heal()
        start = time.monotonic()
        while True:
            self._restart_evicted()
            wrong = [text for island in ISLANDS for text in self._wrong(island)]
            took = time.monotonic() - start
            if not wrong or took > PATIENCE:
                self._collect_shut_down()
                if wrong:
                    raise AssertionError(f"after {took:.1f} s: " + "; ".join(wrong[:10]))
                return took
            time.sleep(0.05)

    def _restart_evicted(self) -> None:
        """Restart nodes as their units do. The Master API has no conditional registration: a local node that
        takes a name in the few ms between the bridge's check and its registration is shut down."""
        for island in ISLANDS:
            node = self.model.nodes[island].get("/shared")
            if node and self.model.publishers(island) - self._seen(island)[0]:
                self.races += 1
                self._start(island, "/shared", sorted(node.publishes), sorted(node.subscribes))

    def _collect_shut_down(self) -> None:
        for island in ISLANDS:
            live = {f"{name} {node.uri}" for name, node in self.model.nodes[island].items()}
            ends = set(self.command(island, "shut_down"))
            self.shut_down += [one for one in ends & live if not one.startswith("/shared ")]

    def _wrong(self, island: str) -> list[str]:
        publishers, subscribers, record = self._seen(island)
        own = self.model.publishers(island)
        brought = publishers - own
        brought -= {entry for entry in brought if entry[:2] == ("/diagnostics", sync_node(island))}
        wrong = [f"{island} lost its own {entry}" for entry in own - publishers]
        offers = self.model.offered(island)
        anything = set().union(*offers)
        wrong += [f"{island} has a stale {entry}" for entry in brought - anything]
        for entry in anything - brought:
            rivals = {one[2] for one in anything if one[1] == entry[1]}
            if len(rivals) == 1 or not any(
                one[1] == entry[1] and one[2] in rivals - {entry[2]} for one in brought
            ):
                wrong.append(f"{island} misses {entry}")
        expected = self.model.subscribers(island)
        wrong += (
            [f"{island}: subscribers {sorted(subscribers ^ expected)[:3]}"] if subscribers != expected else []
        )
        wrong += [f"{island}: record {record ^ brought}"] if record != brought else []
        return wrong

    def _seen(
        self, island: str
    ) -> tuple[set[tuple[str, str, str]], set[tuple[str, str]], set[tuple[str, str, str]]]:
        """Publishers and subscribers of a master, and the publishers in its record.

        A bridge may bring a name from another island between two calls: topics of the former node would get
        the URI of the new one. So the URIs count that are the same before and after the state.
        """
        master = self.islands.master(island)
        uris: dict[str, str] = {}
        for _ in range(ROUNDS):
            publishers, subscribers, _ = master.getSystemState("/checker")[2]
            names = {name for _, names in publishers for name in names}
            before, uris = uris, {name: master.lookupNode("/checker", name)[2] for name in names}
            if uris == before:
                break
        else:
            raise AssertionError(f"the nodes of {island} changed during each of {ROUNDS} looks")
        code, _, record = master.getParam("/checker", RECORD)
        return (
            {(topic, name, uris[name]) for topic, names in publishers for name in names},
            {(topic, name) for topic, names in subscribers for name in names},
            {(topic, node, uri) for _, topic, node, uri in record[0]} if code == 1 else set(),
        )


def main() -> None:
    image, seed, count = Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
    islands = Archipelago(image)
    storm = Storm(islands)
    start = time.monotonic()
    tally: dict[str, int] = {}
    calms = []
    try:
        for number, event in enumerate(network_faults.events(seed, count), 1):
            storm.happen(event)
            tally[event[0]] = tally.get(event[0], 0) + 1
            if number % 10 == 0:
                storm.look_for_leaks()
            if number % (count // CALMS) == 0:
                calms.append(storm.calm())
        problem = ""
    except AssertionError as error:
        problem = str(error)
    for island in ISLANDS:
        print(islands.log(island)[-2000:], file=sys.stderr)
    topics = {topic for received in RECEIVES.values() for topics in received.values() for topic in topics}
    figures = {
        "seed": seed,
        "events": sum(tally.values()),
        "kinds": tally,
        "topics": len(topics),
        "seconds": round(time.monotonic() - start, 1),
        "leaks": storm.leaks,
        "shut_down": storm.shut_down,
        "races_for_a_name": storm.races,
        "stale": problem,
        "longest_to_converge": round(max(calms, default=0.0), 2),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
