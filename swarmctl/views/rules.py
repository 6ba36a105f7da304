"""The rulebook for people: one rule on a screen, all rules as a table, the whole book as a page."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

from rich.table import Table
from rich.text import Text

from swarmctl.checks.rulebook import Pitfall, RuleText

_STYLE = {"error": "bold red", "warning": "bold yellow"}
_HEAD = """# Rules: what a spec is checked for

`swarmctl validate` runs every rule on every spec; `swarmctl explain ID` shows one of them. The examples
change a few lines of a small swarm that is right, [`example.yaml`](../swarmctl/checks/rules/example.yaml),
as an overlay does; the tests run all of them. Made by `swarmctl rules --format markdown`.
"""
_LAST = "- [Known pitfalls, and what answers them](#known-pitfalls-and-what-answers-them)\n"
_PITFALLS = """## Known pitfalls, and what answers them

What has cost robotics people days, as they tell it in public threads, and what becomes of it here: a
**rule** finds it in the spec; the **generator** writes files in which it cannot occur; the **vocabulary**
has no words for it; **health** finds it on the running swarm, where no spec can show it; **not** says why
nothing is done yet.

| # | pitfall | answer | by |
|---|---|---|---|
"""


def explained(rule: RuleText) -> Text:
    """One rule on a screen."""
    style = _STYLE[rule.severity.value]
    text = Text.assemble((f"{rule.severity.value}[{rule.id}]", style), (f": {rule.what}", "bold"), "\n\n")
    text.append(f"{rule.why}\n\n")
    text.append("Mend: ", "bold green").append(f"{rule.mend}\n")
    if rule.fails is not None:
        text.append("\nBrings it:\n", "bold").append(_indented(rule.fails))
    if rule.passes is not None:
        text.append("\nIs right:\n", "bold").append(_indented(rule.passes))
    if rule.shown:
        text.append(f"\n{rule.shown}\n")
    text.append("\nSeen in:\n", "bold").append("".join(f"  {link}\n" for link in rule.links))
    if rule.firm:
        text.append("\nIt cannot be silenced.\n")
    else:
        text.append(f"\nSilence it with a reason: # swarmctl: allow {rule.id} why it is fine here\n")
    return text


def table(rules: Iterable[RuleText]) -> Table:
    """All rules, one a line."""
    made = Table(box=None, show_edge=False, pad_edge=False)
    for heading in ("rule", "severity", "family", "what"):
        made.add_column(heading, no_wrap=heading != "what")
    for rule in rules:
        style = _STYLE[rule.severity.value]
        made.add_row(rule.id, Text(rule.severity.value, style), rule.family, rule.what)
    return made


def page(rules: Mapping[str, RuleText], pitfalls: Sequence[Pitfall]) -> str:
    """The page of docs/: every rule by family, then the pitfalls."""
    by_family = groupby(rules.values(), key=lambda rule: rule.family)
    families = [(title, list(members)) for title, members in by_family]
    parts = [_HEAD, "\n", *(_entry(title, members) for title, members in families), _LAST]
    for title, members in families:
        parts.append(f"\n## {title}\n")
        parts += [part for rule in members for part in _section(rule)]
    parts.append("\n" + _PITFALLS + "".join(_row(one) for one in pitfalls))
    return "".join(parts)


def _entry(title: str, members: Sequence[RuleText]) -> str:
    """One line of the contents."""
    ids = " ".join(f"[{rule.id}](#{rule.id.lower()})" for rule in members)
    return f"- [{title}](#{_anchor(title)}): {ids}\n"


def _anchor(title: str) -> str:
    """How a heading is linked to: in lower case, blanks as hyphens, the rest left out."""
    return "".join(char for char in title.lower().replace(" ", "-") if char.isalnum() or char == "-")


def _section(rule: RuleText) -> Iterator[str]:
    yield f"\n### {rule.id}\n\n**{rule.severity.value}.** {rule.what}\n\n{rule.why}\n\n*Mend:* {rule.mend}\n"
    if rule.fails is not None:
        yield f"\nBrings it:\n\n```yaml\n{rule.fails}```\n"
    if rule.passes is not None:
        yield f"\nIs right:\n\n```yaml\n{rule.passes}```\n"
    if rule.shown:
        yield f"\n{rule.shown}\n"
    pairs = zip(rule.threads, rule.links, strict=True)
    seen = ", ".join(f"<{link}>" if name == link else f"[{name}]({link})" for name, link in pairs)
    yield f"\nSeen in: {seen}.{' It cannot be silenced.' if rule.firm else ''}\n"


def _row(pitfall: Pitfall) -> str:
    rules = ", ".join(f"[{one}](#{one.lower()})" for one in pitfall.rules)
    told = ". ".join(filter(None, (rules, pitfall.how)))
    return f"| {pitfall.number} | {_cell(pitfall.what)} | {pitfall.answer} | {_cell(told)} |\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _indented(text: str) -> str:
    return "".join(f"  {line}\n" for line in text.splitlines())
