"""Faults of a host: of its network, its power and its system."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from swarmctl.lab.errors import LabError
from swarmctl.lab.faults.fault_kind import FaultKind, FaultOption, RunningLab, scripted
from swarmctl.lab.hosts import network
from swarmctl.lab.hosts.processes import run

if TYPE_CHECKING:
    from swarmctl.lab.lab_plan import LabPlan
    from swarmctl.lab.paths import LabPaths


_BUCKET = ("burst", "8kb", "latency", "400ms")  # more than a packet of 1 500 B fits, and none waits for ever
# Neighbours of IPv6 are found by multicast: without them there is no network at all.
_NEIGHBOURS = "ip6 daddr { ff02::1, ff02::2, ff02::1:ff00:0/104 } accept"
_MULTICAST = ("ip daddr 224.0.0.0/4 drop", "ip6 daddr ff00::/8 drop")


def percent(text: str) -> float:
    """Reads a share, in percent."""
    if not re.fullmatch(r"\d+(\.\d+)?", text) or not 0.1 <= float(text) <= 100:
        raise ValueError("write a number from 0.1 to 100, in percent")
    return float(text)


def rate(text: str) -> str:
    """Reads a bandwidth, such as 1Mbit or 1Mbit/s (per second in either case)."""
    if not re.fullmatch(r"(?=.*[1-9])\d+(\.\d+)?[kMG]bit(/s)?", text):
        raise ValueError("write a number with kbit, Mbit or Gbit, such as 1Mbit: it is per second")
    return text.removesuffix("/s")


def _rules(table: str, *rules: str, in_front: str = "") -> str:
    """A shell script that puts rules in place of ``table``, in both directions; without rules, of nothing."""
    lines = [f"table inet {table}", f"delete table inet {table}"]
    if rules:
        lines.append(f"table inet {table} {{")
        for hook, remote in (("input", 'iif != "lo"'), ("output", 'oif != "lo"')):
            lines += [f"  chain {hook} {{", f"    type filter hook {hook} priority -300", f"    {in_front}"]
            lines += [f"    {remote} {rule}" for rule in rules]
            lines.append("  }")
        lines.append("}")
    return "nft -f - <<'END'\n" + "\n".join(filter(str.strip, lines)) + "\nEND"


def loss_script(share: float) -> str:
    """Returns the script that loses ``share`` percent of the packets from and to a host."""
    return _rules("lab_loss", f"numgen random mod 100000 <= {round(1000 * share) - 1} drop")


def no_multicast_script() -> str:
    """Returns the script that loses the multicast packets from and to a host."""
    return _rules("lab_multicast", *_MULTICAST, in_front=_NEIGHBOURS)


def rate_argvs(plan: LabPlan, files: LabPaths, host: str, limit: str | None) -> Iterator[tuple[str, ...]]:
    """Yields the ``tc`` commands for both ends of a host's cables: ``limit`` bit/s, or no limit for None."""
    shape = ("noqueue",) if limit is None else ("tbf", "rate", limit, *_BUCKET)
    for interface in plan.host(host).interfaces:
        ends = (
            (files.namespace(), network.port(plan, host, interface.network)),
            (files.namespace(host), interface.name),
        )
        for namespace, device in ends:
            yield ("tc", "-n", namespace, "qdisc", "replace", "dev", device, "root", *shape)


def _link_down(lab: RunningLab, host: str, name: str | None) -> str:
    off = network.set_cable(lab.plan, lab.files, host, up=False, network=name)
    return f"disconnected from {', '.join(off)}"


def _link_up(lab: RunningLab, hosts: Sequence[str]) -> None:
    for host in hosts:
        network.set_cable(lab.plan, lab.files, host, up=True)


def _limit(lab: RunningLab, host: str, limit: str) -> str:
    _set_rate(lab, host, limit)
    return f"its networks carry {limit}/s"


def _unlimited(lab: RunningLab, hosts: Sequence[str]) -> None:
    for host in hosts:
        _set_rate(lab, host, None)


def _set_rate(lab: RunningLab, host: str, limit: str | None) -> None:
    for argv in rate_argvs(lab.plan, lab.files, host, limit):
        run(argv)


LINK_DOWN = FaultKind(
    "link-down",
    "Disconnect hosts from their networks.",
    _link_down,
    _link_up,
    option=FaultOption(
        "network",
        "NAME",
        "Only this network; by default all networks of the host.",
        needed=False,
    ),
)
LOSS = scripted(
    "loss",
    "Lose packets from and to hosts, at random.",
    loss_script,
    _rules("lab_loss"),
    outcome=lambda share: f"loses {share:g} % of the packets in each direction",
    option=FaultOption("percent", "N", "How many packets are lost, in percent.", percent),
)
BANDWIDTH = FaultKind(
    "bandwidth",
    "Limit the bandwidth of each cable of hosts, in both directions.",
    _limit,
    _unlimited,
    option=FaultOption("rate", "RATE", "Bits per second, such as 1Mbit or 500kbit.", rate),
)
NO_MULTICAST = scripted(
    "no-multicast",
    "Lose the multicast packets from and to hosts.",
    lambda _: no_multicast_script(),
    _rules("lab_multicast"),
    outcome=lambda _: "no multicast",
)


REBOOT_SCRIPT = "systemctl --no-block reboot"


def _reboot(lab: RunningLab, host: str, _: Any) -> str:
    boots = lab.hosts()[lab.plan.host(host).name]["boots"]
    lab.in_host(host, REBOOT_SCRIPT)
    _until(lambda: lab.hosts()[host]["boots"] > boots, f"host {host} does not reboot")
    return "boots again"


def power_off(lab: RunningLab, host: str, _: Any = None) -> str:
    """Cuts a host's power and waits until it has stopped. Its disk is kept. Raises ``LabError``."""
    lab.ask("kill", lab.plan.host(host).name)
    _until(lambda: lab.hosts()[host]["state"] == "stopped", f"host {host} does not stop")
    return "power off"


def power_on(lab: RunningLab, hosts: Sequence[str]) -> None:
    """Starts those hosts that are off, and waits until systemd runs on all. Raises ``LabError``."""
    state = lab.hosts()
    for host in hosts:
        if state[host]["state"] == "stopped":
            lab.ask("start", host)

    def run() -> bool:
        found = lab.hosts()
        return all(found[host]["state"] == "running" or not found[host]["wanted"] for host in hosts)

    _until(run, "a host does not start")


def _until(condition: Callable[[], bool], complaint: str) -> None:
    from swarmctl.lab.preparation import BOOT_TIMEOUT  # noqa: PLC0415  (large)

    deadline = time.monotonic() + BOOT_TIMEOUT
    while not condition():
        if time.monotonic() > deadline:
            raise LabError(complaint)
        time.sleep(0.02)


REBOOT = FaultKind("reboot", "Reboot hosts.", _reboot, power_on)
POWER_OFF = FaultKind("power-off", "Cut the power of hosts; their disks stay.", power_off, power_on)


PLACE = "/opt/swarm"
# Every Python loads it when it starts, also with -I and -S, as the agent of swarmctl does.
_LOADED = "/usr/lib/python3.*/encodings/__init__.py"
_MARK = "# a fault of the lab"


def step(text: str) -> float:
    """Reads by how many seconds a clock is ahead; negative: behind."""
    if not re.fullmatch(r"[-+]?\d+(\.\d+)?", text) or not float(text):
        raise ValueError("write seconds, such as 5 or -0.5")
    return float(text)


END_OF_CLOCK = f"sed -i '/{_MARK}$/d' {_LOADED}"
END_OF_MOUNT = f"while mountpoint -q {PLACE}; do umount --lazy {PLACE}; done"


def clock_script(seconds: float) -> str:
    """Returns the script after which new Python processes of a host see its clock ``seconds`` ahead."""
    ahead = "time.{0} = (lambda now: lambda: now() + {1})(time.{0})"
    code = f"import time; {ahead.format('time', seconds)}; {ahead.format('time_ns', int(seconds * 1e9))}"
    return f"{END_OF_CLOCK}\nsed -i '$ a {code}  {_MARK}' {_LOADED}"


def full_script() -> str:
    """Returns the script that moves a copy of ``PLACE`` in front of it, on a file system without space."""
    return f"""\
set -e
{END_OF_MOUNT}
mkdir -p {PLACE} /run/lab-full
size=$(($(du -sk {PLACE} | cut -f1) + 1024))
mount -t tmpfs -o mode=755,size=${{size}}k lab-full /run/lab-full
cp -a {PLACE}/. /run/lab-full
mount --bind /run/lab-full {PLACE}
umount /run/lab-full
dd if=/dev/zero of={PLACE}/lab-full bs=64k 2>/dev/null || true"""


def read_only_script() -> str:
    """Returns the script that makes ``PLACE`` read-only."""
    return f"""\
set -e
{END_OF_MOUNT}
mkdir -p {PLACE}
mount --bind {PLACE} {PLACE}
mount -o remount,bind,ro {PLACE}"""


def _clock_outcome(seconds: Any) -> str:
    return f"new Python processes see its clock {abs(seconds):g} s {'ahead' if seconds > 0 else 'behind'}"


CLOCK = scripted(
    "clock",
    "Step the clock of hosts for Python processes that start from now on; hosts share the machine's own.",
    clock_script,
    END_OF_CLOCK,
    outcome=_clock_outcome,
    option=FaultOption("step", "SECONDS", "How far the clock is ahead; behind, if negative.", step),
)
DISK_FULL = scripted(
    "disk-full",
    f"Fill the file system of {PLACE} on hosts. What is written there meanwhile is lost in the end.",
    lambda _: full_script(),
    END_OF_MOUNT,
    outcome=lambda _: f"{PLACE} is full",
)
READ_ONLY = scripted(
    "read-only",
    f"Make {PLACE} read-only on hosts.",
    lambda _: read_only_script(),
    END_OF_MOUNT,
    outcome=lambda _: f"{PLACE} is read-only",
)
