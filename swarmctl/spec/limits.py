"""How much a spec may be. What hostile or broken input can cost is decided here, and nowhere else."""

from __future__ import annotations

from dataclasses import dataclass, field

MAX_BYTES = 4 << 20
"""Of all files together. 10 000 robots are 2.5 MB; wide characters take four times as much in memory."""

MAX_NODES = 232_000
"""Keys, values, lists and mappings of all files together. 10 000 robots on 2 000 hosts are 230 000; with as
many that are all wrong, a check stays below 200 MB."""

MAX_DEPTH = 64
"""Lists and mappings within each other. A spec needs seven. libyaml composes recursively, and ends the
process where its stack ends."""

MAX_REPEATED = 100_000
"""Values that aliases may add to those that stand in the text: nine lists of nine aliases are 3 * 10^8."""

MAX_NUMBER = 100
"""Characters of a number. Python converts thousands of digits slowly, and no quantity needs them."""

MAX_FINDINGS = 1_000
"""Findings of one kind of work on one spec. Nobody reads more, and each takes a kilobyte."""

MAX_MENDED = 200_000
"""Characters of a file that is looked into token by token, to mend it. A program writes larger ones."""

MAX_FILES = 1_000
"""Files of one spec, so that each robot of a large swarm may have its own."""

MAX_CHAIN = 16
"""Files that include each other in a row."""


@dataclass
class Room:
    """What is left of the limits while the files of one spec are read, and the texts that were."""

    bytes: int = MAX_BYTES
    nodes: int = MAX_NODES
    files: int = MAX_FILES
    texts: dict[str, str] = field(default_factory=dict)
