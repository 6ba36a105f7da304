"""``swarmctl trust``: scans the hosts' SSH keys and pins them in a known_hosts file beside the spec."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options

if TYPE_CHECKING:
    from swarmctl.remote.known_hosts import KnownHosts
    from swarmctl.remote.transport import HostError, Target
    from swarmctl.swarm.resolved import Swarm

PARALLEL = 32
ADVICE = (
    "compare with what `ssh-keygen -lf /etc/ssh/ssh_host_ed25519_key.pub` prints on the host's own screen"
)


class State(str, Enum):
    KNOWN = "known"
    NEW = "new"
    CHANGED = "changed"
    REVOKED = "revoked"


@dataclass(frozen=True)
class Scanned:
    """The key that a host shows, compared with the pinned ones."""

    target: Target
    key: str

    @property
    def state(self) -> State:
        if self.key in self.target.revoked:
            return State.REVOKED
        if not self.target.keys:
            return State.NEW
        return State.KNOWN if self.key in self.target.keys else State.CHANGED

    def line(self) -> str:
        from swarmctl.remote.host_keys import fingerprint
        from swarmctl.views.escape import printable

        kind = self.key.split(maxsplit=1)[0]
        text = (
            f"{self.state.value:8} {self.target.host}  {self.target.address}  "
            f"{printable(kind)} {fingerprint(self.key)}"
        )
        if self.state is State.CHANGED:
            text += "".join(
                f"\n{'':8} was pinned: {key.split()[0]} {fingerprint(key)}" for key in self.target.keys
            )
        return text


def trust(
    spec: options.Spec,
    overlays: options.Overlays = None,
    host: Annotated[
        list[str] | None, typer.Option("--host", metavar="HOST", help="Only this host (repeatable).")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Also pin changed keys, of hosts that were re-flashed.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Pin without asking, in a network you trust.")] = False,
) -> None:
    """Show the SSH keys of new hosts and pin them in NAME.known_hosts beside the spec."""
    from swarmctl.cli.ssh_targets import read_known_hosts, targets
    from swarmctl.remote.known_hosts import path_beside
    from swarmctl.remote.ssh import SshTransport

    swarm = console.read_spec(spec)
    path = path_beside(spec.first)
    _convert(spec.first, swarm)
    known = read_known_hosts(spec.first)
    ways, warnings = targets(swarm, known)
    _check_names(host or (), _with_hops(ways.values()), str(spec))
    for text in warnings:
        console.err().print(f"warning: {text}")
    transport = SshTransport()
    failed: dict[str, HostError] = {}
    refused: list[Scanned] = []
    done: set[str] = set()
    # A host behind a jump host can be scanned only after the jump host's key is pinned.
    while batch := _nearest(_wanted(targets(swarm, known)[0], host), done):
        done.update(target.host for target in batch)
        scanned, missed = scan_all(transport.scan, batch)
        failed |= missed
        fresh, rejected = _judge(scanned, replaceable=_replaceable(replace, host, batch))
        refused += rejected
        if fresh:
            _confirm(fresh, yes=yes)
            known = pin(known, fresh)
            _write(path, known)
            console.out().print(f"pinned {len(fresh)} in {path}")
    _conclude(failed, refused)


def _convert(spec: Path, swarm: Swarm) -> None:
    """Convert, once, the keys that an earlier version pinned in NAME.lock.yaml, all of them."""
    from swarmctl.cli.ssh_targets import targets
    from swarmctl.remote.known_hosts import KnownHosts, old_path_beside, parse_old_file, path_beside
    from swarmctl.remote.openssh_files import OpenSshFileError, read_text

    old, path = old_path_beside(spec), path_beside(spec)
    if path.exists() or not old.exists():
        return
    try:
        keys = parse_old_file(read_text(old), str(old))
    except OpenSshFileError as error:
        console.fail(str(error), "correct it, or remove it and run `swarmctl trust` again")
    ways = _with_hops(targets(swarm, KnownHosts())[0].values())
    known = KnownHosts()
    for host, pinned in keys.items():
        way = ways.get(host)
        known = known.pinned(host, way.address if way else host, way.port if way else 22, pinned)
    _write(path, known)
    console.out().print(f"converted the keys of {len(keys)} hosts from {old} to {path}; remove {old.name}")


def _write(path: Path, known: KnownHosts) -> None:
    from swarmctl.remote.known_hosts import write

    try:
        write(path, known)
    except OSError as error:
        console.fail(f"cannot write {path}: {error.strerror}")


def _with_hops(targets: Iterable[Target]) -> dict[str, Target]:
    """The targets and every jump host on the way to them, by name."""
    found: dict[str, Target] = {}
    for target in targets:
        step: Target | None = target
        while step is not None:
            found.setdefault(step.host, step)
            step = step.jump
    return found


def _check_names(names: Sequence[str], known: Mapping[str, Target], spec: str) -> None:
    """End the program if ``--host`` names neither a host of the spec nor a jump host."""
    if unknown := sorted(set(names) - set(known)):
        console.fail(f"{spec} has no host {', '.join(unknown)}", f"its hosts are {', '.join(known)}")


def _wanted(targets: Mapping[str, Target], names: Sequence[str] | None) -> list[Target]:
    """The named hosts, all without names, and every jump host on the way to them."""
    everything = _with_hops(targets.values())
    return list(_with_hops(everything[name] for name in names or targets).values())


def _replaceable(replace: bool, names: Sequence[str] | None, batch: Sequence[Target]) -> set[str]:
    """The hosts whose changed keys may be pinned: with ``--host``, not the jump hosts on the way to them."""
    return set(names or [target.host for target in batch]) if replace else set()


def _nearest(wanted: Iterable[Target], done: set[str]) -> list[Target]:
    """The targets that were not scanned yet and whose jump host, if any, was."""
    return [
        target
        for target in wanted
        if target.host not in done and (target.jump is None or target.jump.host in done)
    ]


def scan_all(
    scan: Callable[[Target], str], batch: Sequence[Target]
) -> tuple[list[Scanned], dict[str, HostError]]:
    """The key of each host, and the error of each host that shows none."""
    from concurrent.futures import ThreadPoolExecutor

    from swarmctl.remote.transport import HostError

    def one(target: Target) -> Scanned | HostError:
        try:
            return Scanned(target, scan(target))
        except HostError as error:
            return error

    with ThreadPoolExecutor(PARALLEL) as pool:
        outcomes = list(zip(batch, pool.map(one, batch), strict=True))
    scanned = [outcome for _, outcome in outcomes if isinstance(outcome, Scanned)]
    return scanned, {target.host: outcome for target, outcome in outcomes if isinstance(outcome, HostError)}


def pin(known: KnownHosts, fresh: Iterable[Scanned]) -> KnownHosts:
    """The known_hosts file with the scanned keys in it."""
    for one in fresh:
        known = known.pinned(one.target.host, one.target.address, one.target.port, (one.key,))
    return known


def _judge(scanned: Sequence[Scanned], *, replaceable: set[str]) -> tuple[list[Scanned], list[Scanned]]:
    """Print every key; return those to pin and those that are refused."""
    for one in scanned:
        console.out().print(one.line())
    changed = [one for one in scanned if one.state is State.CHANGED]
    replaced = [one for one in changed if one.target.host in replaceable]
    fresh = [one for one in scanned if one.state is State.NEW] + replaced
    revoked = [one for one in scanned if one.state is State.REVOKED]
    return fresh, [one for one in changed if one not in replaced] + revoked


def _confirm(fresh: Sequence[Scanned], *, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        console.fail("there is no terminal to ask on", f"{ADVICE}, then run the same command with --yes")
    console.out().print(ADVICE)
    answer = console.out().input(f"type yes to pin {len(fresh)} key{'s' if len(fresh) > 1 else ''}: ")
    if answer.strip() != "yes":
        console.fail("nothing was pinned in this step")


def _conclude(failed: Mapping[str, HostError], refused: Sequence[Scanned]) -> None:
    """Print the errors and end with the exit code that fits; return if there is none."""
    from swarmctl.views.escape import printable

    for error in failed.values():
        console.err().print(f"error: {printable(error.message)}")
        if error.hint:
            console.err().print(f"  help: {printable(error.hint)}")
    if revoked := [one.target.host for one in refused if one.state is State.REVOKED]:
        console.err().print(
            f"error: {', '.join(revoked)}: the host key is revoked (@revoked) and is never pinned"
        )
        console.err().print("  help: on the host, remove /etc/ssh/ssh_host_* and run `ssh-keygen -A`")
    if changed := [one.target.host for one in refused if one.state is State.CHANGED]:
        console.fail(
            f"{len(changed)} of the hosts show another key than the pinned one",
            f"re-flashed? add {' '.join(f'--host {name}' for name in changed)} --replace; "
            "if not, another machine answers at this address",
        )
    if refused:
        raise typer.Exit(exit_codes.ERROR)
    if failed:
        raise typer.Exit(exit_codes.HOSTS_UNREACHABLE)
