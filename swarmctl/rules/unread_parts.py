"""What is certain about a spec of which a file cannot be read, and what that file may have.

It may add entries, sections and defaults. A contradiction of two entries stays; what is missing may be there.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

import yaml

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.name_repairs import hosts_elsewhere, robots_elsewhere
from swarmctl.spec.model import Mode, Spec
from swarmctl.spec.recovery import Ways
from swarmctl.yamltext.compose import pairs_of
from swarmctl.yamltext.tree_changes import Change

# Rules on entries that are there. Not those on what is missing, on sums, and on settings with defaults.
_CODES = """
REF002 REF003 REF004 MODE003 MODE004 MODE007 MODE008 MODE012 MODE013 MODE017
ID001 ID002 ID003 ID004 ID006 ID007
NET002 NET003 NET007 NET008 NET009 NET010 NET011 NET012 NET016 NET017 NET018
PORT001 PORT003 PORT004 PORT005 TIME005 TIME006 SEC001 SEC002 SEC003
LINK002 LINK003 LINK004 LINK005 LINK006 LINK007 LINK008
DEV001 DEV002 DEV003 DEV004 DEV005 DEV006 DEV007 LINE004 LINE005 RADIO001 RADIO002
PROG002 PROG003 PROG004 PROG005 PROG006 PROG008 PROG009 PROG010 PROG011 PROG012 PROG015 PROG016
PROG017 PROG018 PROG019 PROG020 PROG021 PROG022 PROG023
PKG001 PKG002 PKG003 PKG004 PKG005 PKG006 PKG009 PKG010 PKG011
NAME001 NAME002 NAME003 NAME004 NAME006 NAME007 NAME008 NAME009 NAME010
TOPIC001 TOPIC004 TOPIC006 TOPIC007 TOPIC009 TOPIC010
BOARD001 BOARD002 BOARD003 BOARD004 BOARD005 BOARD006 BOARD007 BOARD008 BOARD009
MM003 MM004 MM005 MM006 MM015 MM016 AUTH002 AUTH003 AUTH007 AUTH009 SAFE003
SET001 SET002 SET003 SET004 SET006
SENSE001 SENSE002 SENSE003 SENSE004 SENSE009 SENSE010 SENSE011 SENSE012 SENSE013 SENSE014 SENSE015 SENSE016
"""
CERTAIN = frozenset(_CODES.split())
#: Errors of a draft that only all of its files can show: a selection of what another file may have.
SHOWN_BY_ALL_FILES = frozenset({"SEL002"})
# Rules that compare an entry with another one, which they name.
_LOOKED_UP = frozenset({"LINK003", "LINK006", "LINK007", "LINK008", "DEV007", "LINE005", "PROG015"})
_NAME = "standin"  # no message shows it
_SETTINGS = {"ros": {"master_port": 11511}, "defaults": {"host": {"port": 2022}}}  # as well as none


def certain(found: Iterable[Diagnostic], unread: Collection[str]) -> list[Diagnostic]:
    """Returns the findings that more entries cannot disprove; those named in ``unread`` are unknown."""
    return [
        one
        for one in found
        if one.code in CERTAIN
        and not (one.code in _LOOKED_UP and any(f"`{name}`" in one.message for name in unread))
    ]


def absent_sections(root: yaml.Node) -> list[Ways]:
    """Returns the ways to add each section that a spec needs, and the settings that another file may have."""
    there = pairs_of(root) if isinstance(root, yaml.MappingNode) else {}
    unknown = [value for key, (_, value) in there.items() if key not in Spec.model_fields]
    if any(isinstance(one, yaml.CollectionNode) for one in unknown):
        return []  # one of them may be a section that is needed
    needed: dict[str, list[object]] = {
        "version": [1],
        "name": [_NAME],
        "mode": [one.value for one in Mode],
        "hosts": [{_NAME: one} for one in hosts_elsewhere(_NAME)],
        "robots": [{_NAME: one} for one in robots_elsewhere([_NAME])],
    }
    ways: list[Ways] = [
        [[Change((key,), value=value)] for value in values]
        for key, values in needed.items()
        if key not in there
    ]
    return ways + [[[], [Change((key,), value=one)]] for key, one in _SETTINGS.items() if key not in there]
