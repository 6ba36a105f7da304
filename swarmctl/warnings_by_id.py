"""Which rules are warnings: all others are errors.

Each finding needs it, and the texts of the rules take long to read: so it is code, not part of `rules.yaml`.
"""

from __future__ import annotations

WARNINGS = frozenset({
    "AUTH003", "AUTH005", "AUTH008", "AUTH011",
    "BOARD004",
    "CAP003", "CAP005",
    "DEV001", "DEV004", "DEV007", "DEV008", "DEV009",
    "FILE005",
    "ID007",
    "LINE002", "LINE003", "LINE004", "LINE007",
    "LINK008", "LINK012", "LINK013",
    "MM004", "MM012", "MM013", "MM015",
    "NAME009", "NAME010",
    "NET004", "NET007", "NET011", "NET012", "NET014", "NET015",
    "PKG002", "PKG007", "PKG009", "PKG011", "PKG012", "PKG013", "PKG016", "PKG020",
    "PORT002", "PORT005",
    "PROG007", "PROG009", "PROG013", "PROG015", "PROG020", "PROG021", "PROG024", "PROG033",
    "RADIO002", "RADIO003", "RADIO004", "RADIO005",
    "REF003", "REF004",
    "SAFE001", "SAFE002", "SAFE004",
    "SEC003", "SEC004",
    "SENSE002", "SENSE010",
    "SET001",
    "SET006", "SET008",
    "SIL001",
    "TIME002", "TIME003", "TIME005", "TIME008",
    "TOPIC002", "TOPIC003", "TOPIC004", "TOPIC005", "TOPIC008", "TOPIC009", "TOPIC010",
    "URDF005",
    "YAML015",
})  # fmt: skip
