"""Notes on hosts as text: each once, with the hosts that have it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from rich.text import Text

from swarmctl.views.equal_hosts import Names, grouped, merged
from swarmctl.views.escape import printable
from swarmctl.views.width import wrapped
from swarmctl.yamltext import hostlist


def notes(
    noted: Sequence[tuple[str, str]],
    names: Mapping[str, Names],
    *,
    details: bool,
    width: int | None,
    complete: Callable[[str], str],
) -> Text:
    """One line for equal notes of ``(host, note)``, which may differ in names; with ``details`` for each."""
    texts = [(host, printable(complete(note))) for host, note in noted]
    rows = [(host, (names.get(host) or Names(host)).about(text), text) for host, text in texts]
    text = Text()
    for group in grouped(rows, lambda row: (row[0], row[2]) if details else row[1].pattern_of(row[2])):
        hosts, own, same = zip(*group, strict=True)
        line = Text(f"note: {hostlist.written(hosts)}: {merged(same, own)}", "dim")
        text.append_text(wrapped(line, width, 6)).append("\n")
    return text
