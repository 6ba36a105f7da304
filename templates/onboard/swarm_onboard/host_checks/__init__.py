"""Checks of a host itself, a module each; its name is that of the check.

A module has ``Seen``, the type of what a host reports; ``observe(home)``, which runs on the host and returns
a list of them, empty where the host has no such thing; ``judge(seen, host)``, which runs at the operator; and
``TABLE``, what it can find and what that means, for docs/checks.md.
"""

from __future__ import annotations

from swarm_onboard.agent.named_tuple import NamedTuple


class Judged(NamedTuple):
    """What a check makes of a value: ``ok``, ``warning`` or ``bad``, and how to repair it.

    ``about``: the part of the host, where a host has several; ``peer``: another host that it depends on.
    """

    state: str
    message: str
    hint: str = ""
    about: str = ""
    peer: str = ""
