"""Time and memory of `swarmctl validate`: ``python benchmarks/validate.py [--quick]``; exit 1 above a bar.

Specs of each mode without errors, with 100 to 10 000 robots. The measure is ``yaml.compose`` with the C
loader on the same text in the same process, both with the collector off, by the least CPU time of several
runs. Memory and the time of the whole command are measured in a separate ``swarmctl validate`` process.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

RATIO = 3.0  # times yaml.compose
MEMORY = 400  # MB
EXPONENT = 1.15  # of the growth of the time with the text; 1 is linear, and 0.05 is noise
SIZES = (100, 1_000, 10_000)
EACH = 5  # robots a host drives
ISLAND = 10  # hosts of an island in mode combined
PROGRAM = str(Path(sys.executable).with_name("swarmctl"))
LAYOUTS = ("block", "line")


def spec_of(mode: str, robots: int, layout: str = "block") -> str:
    """A spec without errors, in usual style. ``layout``: the wlan lists its hosts as block or in one line."""
    hosts = ["station"]
    if mode != "single-minded":
        hosts += [f"pi-{number:04}" for number in range(1, max(2, robots // EACH))]
    names = [f"bot-{number:05}" for number in range(1, robots + 1)]
    driver = {name: hosts[number // EACH % len(hosts)] for number, name in enumerate(names)}
    parts = (
        _head(mode),
        _hosts(mode, hosts),
        _robots(names, driver),
        ["links:", *_networks(hosts, layout), *_lines(mode, names, driver)],
        _programs(names),
        _islands(hosts) if mode == "combined" else (),
        ["control:", *_control(mode, driver)],
    )
    return "\n".join(line for part in parts for line in (*part, "")) + "\n"


def _head(mode: str) -> Iterator[str]:
    yield from ("version: 1", "name: large", f"mode: {mode}")
    if mode in ("single-minded", "leader"):
        yield "leader: station"
    if mode == "central":
        yield "hub: station"
    if mode in ("standalone", "combined"):
        yield "multimaster: {provider: static}"
    yield "time: {root: station, servers: [ntp.lab.example]}"


def _hosts(mode: str, hosts: Sequence[str]) -> Iterator[str]:
    radios = [f"hci{number}" for number in range(100 if mode == "single-minded" else 1)]
    yield "hosts:"
    for number, name in enumerate(hosts):
        yield f"  {name}:"
        yield f"    address: 10.20.{number // 200}.{number % 200 + 10}"
        yield "    user: robot"
        if name != "station":
            yield "    computer: raspberry-pi-4b"
        yield f"    bluetooth: [{', '.join(radios)}]"


def _robots(names: Sequence[str], driver: dict[str, str]) -> Iterator[str]:
    yield "robots:"
    for number, name in enumerate(names):
        yield f"  {name}:"
        yield f"    type: {('koala', 'khepera3', 'khepera3', 'epuck', 'epuck')[number % EACH]}"
        yield f"    host: {driver[name]}"
        if number % 10 == 0:
            yield "    settings: {limits: {linear: 0.2}}"


def _networks(hosts: Sequence[str], layout: str) -> Iterator[str]:
    yield from ("  - kind: wlan", "    name: field", "    subnet: 10.20.0.0/16", "    capacity_mbps: 300")
    if layout == "block":
        yield from ("    hosts:", *(f"      - {host}" for host in hosts))
    else:
        yield f"    hosts: [{', '.join(hosts)}]"
    yield from ("  - kind: ethernet", "    name: bench", "    subnet: 10.30.0.0/16")
    yield f"    hosts: [{', '.join(hosts[: 1 + len(hosts) // 20])}]"


def _lines(mode: str, names: Sequence[str], driver: dict[str, str]) -> Iterator[str]:
    """Of five robots one uses Bluetooth, one the host's own port, three USB; one host has few adapters."""
    alone = mode == "single-minded"
    for number, name in enumerate(names):
        kind = number % EACH
        wireless = kind == 4 and (not alone or number < 100 * 4 * EACH)  # four on an adapter
        yield f"  - kind: {'bluetooth' if wireless else 'serial'}"
        yield f"    host: {driver[name]}"
        yield f"    robot: {name}"
        if wireless:
            yield f'    mac: "10:00:e8:{number >> 16 & 255:02x}:{number >> 8 & 255:02x}:{number & 255:02x}"'
            yield "    pin: {secret: epuck-pin}"
            yield from [f"    adapter: hci{number // (4 * EACH)}"] if alone else []
        elif kind == 1 and not alone:
            yield from ("    device: /dev/ttyS0", "    baud: 115200")
        else:
            yield f"    usb: {{serial: A60{number:05}}}"


def _programs(names: Sequence[str]) -> Iterator[str]:
    yield from (
        "programs:",
        "  joystick:",
        "    host: station",
        "    use: teleop-joy",
        "    params: {device: /dev/input/js0}",
    )
    for name in names[::100]:
        yield f"  laser-{name}:"
        yield f"    robot: {name}"
        yield "    package: hokuyo_node"
        yield "    executable: hokuyo_node"
        yield "    publishes: [{topic: scan, type: sensor_msgs/LaserScan, rate: 1, size: 3000}]"


def _islands(hosts: Sequence[str]) -> Iterator[str]:
    yield "islands:"
    for start in range(0, len(hosts), ISLAND):
        members = hosts[start : start + ISLAND]
        yield f"  group-{start // ISLAND:03}:"
        yield "    mode: central"
        yield f"    hub: {members[0]}"
        yield from ("    hosts:", *(f"      - {host}" for host in members))


def _control(mode: str, driver: dict[str, str]) -> Iterator[str]:
    """A leader commands all robots, or each host its own; a joystick has a higher priority for some."""
    led = mode in ("single-minded", "leader")
    commanders: dict[str, list[str]] = {}
    for robot, host in driver.items():
        commanders.setdefault("station" if led else host, []).append(robot)
    for by, robots in commanders.items():
        yield from (f"  - by: {by}", "    of:", *(f"      - {robot}" for robot in robots))
    yield from ("  - by: joystick", "    priority: 10")
    yield from ("    of:", *(f"      - {robot}" for robot in list(driver)[::100]))


@dataclass(frozen=True)
class Row:
    """The measurements of one spec."""

    name: str
    robots: int
    bytes: int
    compose: float  # s, as all times here
    validate: float
    process: float
    megabytes: float

    @property
    def ratio(self) -> float:
        return self.validate / self.compose


def measured(name: str, robots: int, text: str, runs: int) -> Row:
    """Measures times in one new process and memory in another."""
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        file = Path(folder, "swarm.yaml")
        file.write_text(text, "utf-8")
        again = [sys.executable, __file__, "--times", str(file), "--runs", str(runs)]
        compose, validate = json.loads(subprocess.run(again, stdout=subprocess.PIPE, check=True).stdout)
        process, megabytes = whole([PROGRAM, "validate", "--quiet", str(file)])
    return Row(name, robots, len(text), compose, validate, process, megabytes)


def whole(command: Sequence[str]) -> tuple[float, float]:
    """CPU time and memory of a process from its start to its end."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)  # so that Popen does not wait for it again
    if child.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {child.returncode}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def times(file: Path, runs: int) -> tuple[float, float]:
    """The least CPU times of ``yaml.compose`` and of the whole check, measured in turn."""
    import yaml

    from swarmctl.yamltext.source import collector_paused
    from tests.loading import load_checked

    text = file.read_text("utf-8")
    _, found = load_checked(file)
    if odd := {one.code: one.message for one in found}:
        raise SystemExit(f"the benchmark's own spec has findings: {odd}")
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    compose, validate = [], []
    for _ in range(runs):
        with collector_paused():
            compose.append(seconds(lambda: yaml.compose(text, Loader=loader)))
        validate.append(seconds(lambda: load_checked(file)))
    return min(compose), min(validate)


def seconds(work: Callable[[], object]) -> float:
    began = time.process_time()
    done = work()
    ended = time.process_time()
    del done  # freed outside the measured time, for both alike
    return ended - began


def rows(sizes: Sequence[int], runs: int) -> Iterator[Row]:
    for mode in ("single-minded", "leader", "central", "standalone", "combined"):
        for robots in sizes:
            yield measured(mode, robots, spec_of(mode, robots), runs)
    for layout in LAYOUTS[1:]:
        for robots in sizes:
            yield measured(f"central, {layout}", robots, spec_of("central", robots, layout), runs)


def verdicts(found: Iterable[Row]) -> Iterator[tuple[bool, str]]:
    """Each bar with its measured value, and whether it holds."""
    named: dict[str, list[Row]] = {}
    for row in found:
        named.setdefault(row.name, []).append(row)
    largest = [group[-1] for group in named.values()]
    ratio, memory = max(row.ratio for row in largest), max(row.megabytes for row in largest)
    yield ratio <= RATIO, f"ratio {ratio:.2f} (bar {RATIO:g})"
    yield memory <= MEMORY, f"memory {memory:.0f} MB (bar {MEMORY})"
    grown = [group[-2:] for group in named.values() if len(group) > 1]
    if grown:
        exponent = max(
            math.log(after.validate / before.validate, after.bytes / before.bytes) for before, after in grown
        )
        yield exponent <= EXPONENT, f"growth: time ~ bytes^{exponent:.2f} (bar {EXPONENT:g})"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="100 and 1 000 robots, as the tests run it")
    parser.add_argument("--robots", type=int, nargs="+", help="other sizes")
    parser.add_argument("--runs", type=int, default=5, help="runs of each measurement")
    parser.add_argument("--times", type=Path, metavar="FILE", help="only the two times of one file, as JSON")
    given = parser.parse_args()
    if given.times:
        print(json.dumps(times(given.times, given.runs)))
        return 0
    print(f"{'':17}{'robots':>7}{'bytes':>10}{'compose s':>11}{'validate s':>11}{'ratio':>7}"
          f"{'command s':>11}{'MB':>6}")  # fmt: skip
    found = []
    for row in rows(given.robots or SIZES[: 2 if given.quick else 3], given.runs):
        found.append(row)
        print(f"{row.name:17}{row.robots:7}{row.bytes:10}{row.compose:11.3f}{row.validate:11.3f}"
              f"{row.ratio:7.2f}{row.process:11.2f}{row.megabytes:6.0f}", flush=True)  # fmt: skip
    held = list(verdicts(found))
    passed = all(holds for holds, _ in held)
    print(f"{'PASS' if passed else 'FAIL'}: {', '.join(text for _, text in held)}")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
