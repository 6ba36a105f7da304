"""Limits on the size of a spec: they bound what hostile or broken input can cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

MAX_BYTES = 4 << 20
"""Bytes of all files together. 10 000 robots are 2.5 MB; wide characters take four times the memory."""

MAX_NODES = 232_000
"""Keys, values, lists and mappings of all files together. 10 000 robots on 2 000 hosts are 230 000; with as
many that are all wrong, a check stays below 200 MB."""

MAX_DEPTH = 64
"""Nested lists and mappings. A spec needs seven. libyaml composes recursively, on its stack."""

MAX_REPEATED = 100_000
"""Values that aliases may add to those in the text: nine lists of nine aliases are 3 * 10^8."""

MAX_NUMBER = 100
"""Characters of a number. Python converts thousands of digits slowly, and no quantity needs them."""

MAX_FINDINGS = 1_000
"""Findings per pass over one spec. Each takes a kilobyte, and more are not readable."""

MAX_FIXABLE = 200_000
"""Characters of a file that fixes are computed for, token by token. Programs write larger ones."""

MAX_FILES = 1_000
"""Files of one spec, so that each robot of a large swarm may have its own."""

MAX_CHAIN = 16
"""Depth of nested includes."""

MAX_CODEC_BYTES = 64 << 10
"""Bytes of a robot type's Python class, which Python parses in 0.5 s and 100 MB at worst."""

MAX_CODECS_BYTES = 2 * MAX_CODEC_BYTES
"""Bytes of all Python classes of a spec together: some 3 000 lines."""

MAX_ENTRIES = 10_000
"""Names that are looked at in a folder of a spec."""

MAX_SECONDS = 60
"""Time that a pipe has to bring a whole spec."""


SourceTexts: TypeAlias = dict[str, str]


@dataclass
class LoadBudget:
    """What is left of the limits while the files of one spec are read, and their texts by file name."""

    bytes: int = MAX_BYTES
    nodes: int = MAX_NODES
    files: int = MAX_FILES
    codec_bytes: int = MAX_CODECS_BYTES
    texts: SourceTexts = field(default_factory=dict)
