"""What `lab shell` runs: on a host with the ROS of its swarm, as operator in the lab's network. Pure."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from swarmctl.render.bundle import ROOT


def setup_file(swarm: str) -> str:
    """Returns the path on every host of the file that sets up the ROS of ``swarm``."""
    return f"{ROOT}/{swarm}/current/setup.bash"


def operator_argv(command: Sequence[str], shell: str) -> tuple[str, ...]:
    """Returns what runs for the operator; a single text is a line for ``shell``, as hosts take it."""
    if not command:
        return (shell,)
    return tuple(command) if len(command) > 1 else (shell, "-c", command[0])


def host_line(setup: str, command: Sequence[str]) -> str:
    """Returns the line that a host's shell runs: the file ``setup`` if it is there, then ``command``.

    Without a command it opens a shell.
    """
    line = " ".join(command) or 'exec "$SHELL"'
    return f"[ ! -r {shlex.quote(setup)} ] || . {shlex.quote(setup)}; {line}"
