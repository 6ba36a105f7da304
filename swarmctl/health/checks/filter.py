"""The IP addresses that units may exchange packets with: systemd must enforce their lists. Pure."""

from __future__ import annotations

from collections.abc import Sequence

from swarmctl.health.check_context import CheckContext
from swarmctl.health.root_cause import Findings
from swarmctl.health.verdict import Verdict, bad, listed

TABLE = {
    "filter": (
        (
            "systemd does not enforce the IP addresses of units that run: it cannot load its BPF programs",
            "unhealthy, with the units",
        ),
    )
}
_HINT = (
    "give it a kernel with CONFIG_CGROUP_BPF and cgroups of version 2, or, in a container, allow bpf() "
    "(systemd-nspawn --system-call-filter=bpf), then restart it; or write `security: off`"
)


def compare(found: Findings, context: CheckContext) -> None:
    """Files one finding for each host that has such units."""
    for host, answer in context.hosts:
        units = sorted(name for name, seen in answer.units.items() if seen.unenforced)
        if units:
            found.add("filter", host.name, _verdict(units), host=host)


def _verdict(units: Sequence[str]) -> Verdict:
    text = f"systemd does not enforce the IP addresses of {listed(units)}: it cannot load its BPF programs"
    return bad(text, _HINT)
