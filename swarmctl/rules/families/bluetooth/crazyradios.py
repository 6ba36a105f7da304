"""The Crazyradio dongles of hosts: what one of them carries, and their channels."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from swarmctl.analysis.radio_load import dongle_budgets
from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.links.radio_link import Radio
from swarmctl.rules.context import RuleContext, rule

_WIDE = 2_000_000  # bit/s at which a channel takes 2 MHz instead of 1 (nRF24LU1+ product specification)


@rule("RADIO003")
def crowded_dongles(context: RuleContext) -> Iterator[Diagnostic]:
    """More messages than one dongle can exchange."""
    for budget in dongle_budgets(context):
        if budget.share > 1:
            members = ", ".join(f"`{one}`" for one in budget.members)
            yield Diagnostic(
                "RADIO003",
                f"{budget.dongle} of host `{budget.host}` would need {budget.share:.2g} s for what it has to "
                "exchange in one",
                context.span("links", budget.links[-1], "robot"),
                label=f"{sum(budget.exchanges):.0f} exchanges a second with {members}",
                notes=(Note(context.span("hosts", budget.host, key=True), "the host of this dongle"),),
                help=(
                    "give the host another Crazyradio, on another channel, and its number to some links",
                    "or let the Crazyflies send less: the driver turns each kind of message off",
                ),
            )


@rule("RADIO005")
def shared_dongles(context: RuleContext) -> Iterator[Diagnostic]:
    """One dongle that several drivers open, each a process of its own; one finding per dongle."""
    first: dict[tuple[str, str], tuple[int, Radio]] = {}
    reported: set[tuple[str, str]] = set()
    for index, link in context.radios:
        dongle = (link.host, link.dongle)
        earlier, other = first.setdefault(dongle, (index, link))
        if earlier == index or dongle in reported:
            continue
        reported.add(dongle)
        yield Diagnostic(
            "RADIO005",
            f"the drivers of `{other.robot}` and `{link.robot}` both open {link.dongle} of `{link.host}`",
            context.span("links", index, "uri"),
            label="only one process can",
            notes=(Note(context.span("links", earlier, "uri"), f"the driver of `{other.robot}` opens it"),),
            help=(
                f"give `{link.robot}` a Crazyradio of its own: radio://1/...",
                "suppress this if one server opens the dongle for both",
            ),
        )


@rule("RADIO004")
def near_channels(context: RuleContext) -> Iterator[Diagnostic]:
    """Two dongles on one channel, or on channels that overlap; one finding for each pair of dongles."""
    dongles: dict[tuple[str, str], list[tuple[int, Radio]]] = {}
    for index, link in context.radios:
        dongles.setdefault((link.host, link.dongle), []).append((index, link))
    for (first, ours), (second, theirs) in combinations(dongles.items(), 2):
        clash = next(((one, other) for one in ours for other in theirs if _overlap(one[1], other[1])), None)
        if clash is None:
            continue
        (index, one), (later, other) = clash
        same = one.channel == other.channel
        yield Diagnostic(
            "RADIO004",
            f"{first[1]} of `{first[0]}` and {second[1]} of `{second[0]}` "
            + (f"both send on channel {one.channel}" if same else "send on channels that overlap, ")
            + ("" if same else f"{one.channel} and {other.channel}"),
            context.span("links", later, "uri"),
            label="their packets collide",
            notes=(Note(context.span("links", index, "uri"), f"{first[1]} of `{first[0]}`"),),
            help=("give each dongle channels of its own; at 2M two channels apart",),
        )


def _overlap(one: Radio, other: Radio) -> bool:
    apart = 2 if _WIDE in (one.rate, other.rate) else 1
    return abs(one.channel - other.channel) < apart
