"""The checks of the operator's machine, for ``swarmctl doctor``."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from typing import TYPE_CHECKING

from swarmctl.cli import extras, ssh_targets

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.health.first_aid import Step
    from swarmctl.health.verdict import Verdict
    from swarmctl.remote.transport import Target

_PATIENCE = 5.0  # s


def steps(spec: SpecFiles, targets: Sequence[Target]) -> list[Step]:
    """What the spec and this machine need for logins to the targets, and what verbs need beyond that."""
    from swarmctl.health.first_aid import Step

    return [
        Step("spec", lambda: _errors(spec)),
        Step("pinned keys", lambda: _pinned(targets)),
        Step("private keys", lambda: _private(targets)),
        Step("clock", _synchronised),
        Step("ssh", _program),
        Step("extras", _extras),
    ]


def _errors(spec: SpecFiles) -> Verdict:
    from swarmctl.health.verdict import bad, ok
    from swarmctl.linter.runner import check_files
    from swarmctl.rulebook import Severity

    _, found = check_files(*spec.files, workspaces=spec.workspaces)
    number = sum(one.severity is Severity.ERROR for one in found.diagnostics)
    errors = "1 error" if number == 1 else f"{number} errors"
    return bad(f"{spec.first} has {errors}", f"`{spec.command('validate')}`") if number else ok("no errors")


def _pinned(targets: Sequence[Target]) -> Verdict:
    from swarmctl.health.verdict import bad, ok
    from swarmctl.yamltext import hostlist

    without = {one.host: None for target in targets for one in target.way() if not one.keys}
    if without:
        return bad(f"{hostlist.written(without)} has none", "`swarmctl trust SPEC`")
    return ok("every host has one")


def _private(targets: Sequence[Target]) -> Verdict:
    """Raises ``HostError`` for a key that is named and cannot be used."""
    from swarmctl.health.verdict import ok
    from swarmctl.remote.either_ssh import needs_program
    from swarmctl.remote.ssh_errors import no_private_key

    keyring = ssh_targets.keyring()
    for target in {one.identities: one for one in targets}.values():
        beyond = needs_program(target) or keyring.beyond_paramiko(target.identities)
        if not beyond and not keyring.identities(target.identities):
            raise no_private_key(target)
    return ok("there is one to log in with")


def _synchronised() -> Verdict:
    """As systemd sees it: timedatectl(1)."""
    from swarmctl.health.verdict import State, Verdict, ok, warning

    argv = ("timedatectl", "show", "--property=NTPSynchronized", "--value")
    try:
        done = subprocess.run(argv, capture_output=True, text=True, check=False, timeout=_PATIENCE)
    except (OSError, subprocess.TimeoutExpired):
        done = None
    answer = done.stdout.strip() if done else ""
    if answer == "no":
        return warning("not synchronised", "`timedatectl set-ntp true`")
    return ok("synchronised") if answer == "yes" else Verdict(State.SKIPPED, "`timedatectl` does not answer")


def _program() -> Verdict:
    from swarmctl.health.verdict import State, Verdict, ok

    if shutil.which("ssh"):
        return ok("installed")
    return Verdict(State.SKIPPED, "`swarmctl ssh` needs it", "`apt install openssh-client`")


def _extras() -> Verdict:
    from swarmctl.health.verdict import State, Verdict, ok

    missing = [name for name in extras.LIBRARIES if extras.missing(name)]
    if not missing:
        return ok("installed")
    names = ", ".join(missing)
    return Verdict(
        State.SKIPPED, f"{names} not installed", f"`pip install 'swarmctl[{names.replace(' ', '')}]'`"
    )
