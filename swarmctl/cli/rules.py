"""``swarmctl rules`` and ``swarmctl explain``: what a spec is checked for, and why."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from swarmctl.cli import console


class RulesFormat(str, Enum):
    TEXT = "text"
    JSON = "json"
    MARKDOWN = "markdown"


def rules(
    format_: Annotated[RulesFormat, typer.Option("--format", help="How to print them.")] = RulesFormat.TEXT,
) -> None:
    """List the rules that a spec is checked for."""
    from swarmctl.checks.rulebook import pitfalls, rulebook
    from swarmctl.views import rules as view

    match format_:
        case RulesFormat.JSON:
            console.print_json({"v": 1, "rules": [rule.to_json() for rule in rulebook().values()]})
        case RulesFormat.MARKDOWN:
            print(view.page(rulebook(), pitfalls()), end="")
        case RulesFormat.TEXT:
            console.out().print(view.table(rulebook().values()))


def explain(
    rule: Annotated[str, typer.Argument(metavar="ID", help="The rule's id, as a finding shows it.")],
) -> None:
    """Explain one rule: what it finds, why it matters, how to mend it."""
    from swarmctl.checks.rulebook import rulebook
    from swarmctl.spec.suggest import did_you_mean
    from swarmctl.views import rules as view

    found = rulebook().get(rule.upper())
    if found is None:
        near = did_you_mean(rule.upper(), rulebook(), "the rules are")
        console.fail(f"there is no rule `{rule}`", *near, "`swarmctl rules` lists them all")
    console.out().print(view.explained(found), end="")
