"""The errors of a selection that is well written: a name that does not exist, or nothing that is selected."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

from swarmctl.spec.selection_candidates import Candidates, Kind
from swarmctl.suggest import did_you_mean, nearest
from swarmctl.yamltext.selection_text import PREFIXES, SelectionError, Word

_WHAT = {
    "": ("no host or robot called", "hosts and robots"),
    "host": ("no host called", "the hosts are"),
    "robot": ("no robot called", "the robots are"),
    "program": ("no program called", "the programs are"),
    "type": ("no robot of the type", "the types of its robots are"),
    "@": ("no group or label called", "groups and labels"),
    "island": ("no island called", "the islands are"),
    "mode": ("no island in mode", "the modes are"),
}
_ELSEWHERE = ("program", "@", "island", "type", "mode", "host", "robot")


def with_prefix(prefix: str, name: str) -> str:
    """Returns a name as a selection has it: ``@lab``, ``type:epuck2``, ``k3``."""
    return f"{prefix}{':' if prefix not in ('', '@') else ''}{name}"


def unknown_name(candidates: Candidates, word: Word, name: str) -> SelectionError:
    """Returns the error about a name that does not exist, with the prefix under which it does."""
    what, known = _WHAT[word.prefix]
    help_lines: tuple[str, ...]
    meant = ""
    if (prefix := next((one for one in _ELSEWHERE if name in candidates.named(one)), None)) is not None:
        meant = with_prefix(prefix, name)
        help_lines = (f"write `{meant}`",)
    elif name == "all":
        meant = "*"
        help_lines = ("write `*` for everything",)
    elif not word.prefix and name[:1] == "-" and name[1:] in candidates.hosts_and_robots:
        meant = f"!{name[1:]}"
        help_lines = (f"write `{meant}` to leave it out",)
    else:
        words = [with_prefix(word.prefix, one) for one in candidates.named(word.prefix)]
        help_lines = did_you_mean(with_prefix(word.prefix, name), words, known)
        meant = nearest(with_prefix(word.prefix, name), words) or ""
    error = SelectionError(f"there is {what} `{name}`", word.start, word.end, *help_lines, code="SEL002")
    error.meant = meant if len(word.names) == 1 else ""
    return error


def words_for(candidates: Candidates, begun: str) -> list[str]:
    """Returns words that may be meant by the beginning of one: names, then sets; other prefixes if begun."""
    usual = ("", "@", "island", "type")
    prefixes = [one for one in PREFIXES if begun.startswith(f"{one}:")] or usual
    return [with_prefix(prefix, name) for prefix in prefixes for name in candidates.named(prefix)]


def selects_nothing(
    candidates: Candidates, kind: Kind, texts: Sequence[str], idle: Collection[str]
) -> SelectionError:
    """Returns the error about selections that mean no host or no robot; ``idle`` are words without any."""
    what, shown = kind.removesuffix("s"), ",".join(texts)
    words = " and ".join(f"`{one}`" for one in idle)
    means = "means" if len(idle) == 1 else "mean"
    error = SelectionError(
        f"`{shown}` selects no {what}",
        0,
        len(texts[-1]) if texts else 0,
        *([f"{words} {means} no {what} here"] if words and words != f"`{shown}`" else []),
        *_what_exists(candidates, kind),
        code="SEL002",
    )
    error.number = max(len(texts) - 1, 0)
    return error


def _what_exists(candidates: Candidates, kind: Kind) -> Iterator[str]:
    yield from did_you_mean("", candidates.of(kind), f"the {kind} are")
    sets = [*(f"@{one}" for one in candidates.groups_and_labels)]
    sets += [f"island:{one}" for one in candidates.islands]
    yield from did_you_mean("", sets, "groups, labels and islands")
