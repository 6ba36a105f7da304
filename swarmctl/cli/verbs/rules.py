"""``swarmctl rules`` and ``swarmctl explain``: lists the rules and explains one."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from swarmctl.cli import complete, console, options


class RulesFormat(str, Enum):
    """The values of ``rules --format``."""

    TEXT = "text"
    JSON = "json"
    MARKDOWN = "markdown"


def rules(
    form: Annotated[
        RulesFormat | None, typer.Option("--format", help="How to print them; by default as text.")
    ] = None,
    json: options.FormatJson = False,
) -> None:
    """List the rules that check a spec."""
    from swarmctl.rulebook import pitfalls, rulebook
    from swarmctl.views import rules as view

    match options.format_of(form, json, RulesFormat.TEXT):
        case RulesFormat.JSON:
            console.print_json({"v": 1, "rules": [rule.to_json() for rule in rulebook().values()]})
        case RulesFormat.MARKDOWN:
            print(view.page(rulebook(), pitfalls()), end="")
        case RulesFormat.TEXT:
            console.out().print(view.table(rulebook().values()))


def explain(
    rule: Annotated[
        str,
        typer.Argument(
            metavar="ID", help="The id of the rule, as in a finding.", autocompletion=complete.rule_ids
        ),
    ],
) -> None:
    """Explain one rule: what it finds, why it matters, how to fix it."""
    from swarmctl.rulebook import rulebook
    from swarmctl.suggest import did_you_mean
    from swarmctl.views import rules as view

    found = rulebook().get(rule.upper())
    if found is None:
        near = did_you_mean(rule.upper(), rulebook(), "the rules are")
        console.fail(f"there is no rule `{rule}`", *near, "`swarmctl rules` lists them all")
    text = view.explained(found)
    text.rstrip()
    console.show(text)
