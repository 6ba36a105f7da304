"""Robots with an address of their own: their link carries what they exchange."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.analysis.ip_link_load import ip_link_budgets
from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.rules.context import RuleContext, rule

_CAREFUL = 0.7  # share of a wireless link above which packets wait for each other


@rule("LINK012")
def full_links(context: RuleContext) -> Iterator[Diagnostic]:
    """A link that is to carry more than its capacity."""
    for budget in ip_link_budgets(context):
        if budget.share is None or budget.share <= _CAREFUL:
            continue
        yield Diagnostic(
            "LINK012",
            f"the link of robot `{budget.robot}` carries {budget.needed_mbps:.3g} of "
            f"{budget.capacity_mbps:g} Mbit/s",
            context.span("links", budget.link, "capacity_mbps"),
            label=f"{budget.share:.0%} of its capacity",
            notes=(Note(context.span("robots", budget.robot, key=True), f"robot `{budget.robot}`"),),
            help=(
                "let the driver publish less, or use a faster network",
                "`load_mbps` of the type's link has what the robot really sends, where it was measured",
            ),
        )
