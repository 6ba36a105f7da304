"""``swarmctl trust``: look at the keys that hosts show, and pin them beside the spec."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import access, console, exits

if TYPE_CHECKING:
    from swarmctl.remote.hostkeys import LockFile
    from swarmctl.remote.transport import HostError, Target

AT_ONCE = 32
ADVICE = (
    "compare with what `ssh-keygen -lf /etc/ssh/ssh_host_ed25519_key.pub` prints on the host's own screen"
)


class State(str, Enum):
    KNOWN = "known"
    NEW = "new"
    CHANGED = "changed"


@dataclass(frozen=True)
class Shown:
    """The key that a host shows, against the pinned ones."""

    target: Target
    key: str

    @property
    def state(self) -> State:
        if not self.target.keys:
            return State.NEW
        return State.KNOWN if self.key in self.target.keys else State.CHANGED

    def line(self) -> str:
        from swarmctl.remote.hostkeys import fingerprint

        kind = self.key.split(maxsplit=1)[0]
        text = (
            f"{self.state.value:8} {self.target.host}  {self.target.address}  {kind} {fingerprint(self.key)}"
        )
        if self.state is State.CHANGED:
            text += "".join(
                f"\n{'':8} was pinned: {key.split()[0]} {fingerprint(key)}" for key in self.target.keys
            )
        return text


def trust(
    spec: access.Spec,
    overlays: access.Overlays = None,
    host: Annotated[
        list[str] | None, typer.Option("--host", metavar="HOST", help="Only this host (repeatable).")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Also pin keys that changed, of hosts you re-flashed.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Pin without asking, in a network you trust.")] = False,
) -> None:
    """Show the SSH keys of new hosts and pin them in NAME.lock.yaml beside the spec."""
    from swarmctl.cli.targets import read_lock, targets
    from swarmctl.remote.hostkeys import lock_path, write_lock
    from swarmctl.remote.ssh import SshTransport

    swarm = console.read_spec(spec)
    if unknown := sorted(set(host or ()) - set(swarm.hosts)):
        console.fail(f"{spec} has no host {', '.join(unknown)}", f"its hosts are {', '.join(swarm.hosts)}")
    transport = SshTransport()
    lock = read_lock(spec.first)
    failed: dict[str, HostError] = {}
    refused: list[Shown] = []
    done: set[str] = set()
    for text in targets(swarm, lock)[1]:
        console.err().print(f"warning: {text}")
    # Nearest hosts first: a host behind another is seen only once the one in front is pinned.
    while batch := _nearest(_wanted(targets(swarm, lock)[0], host), done):
        done.update(target.host for target in batch)
        shown, missed = look(transport.scan, batch)
        failed |= missed
        fresh, changed = _judge(shown, replace=replace)
        refused += changed
        if fresh:
            _confirm(fresh, yes=yes)
            lock = pin(lock, fresh)
            try:
                write_lock(lock_path(spec.first), lock)
            except OSError as error:
                console.fail(f"cannot write {lock_path(spec.first)}: {error.strerror}")
            console.out().print(f"pinned {len(fresh)} in {lock_path(spec.first)}")
    _conclude(failed, refused)


def _wanted(targets: Mapping[str, Target], names: Sequence[str] | None) -> list[Target]:
    """The hosts asked for and every hop on the way to them."""
    found: dict[str, Target] = {}
    for name in names or targets:
        step: Target | None = targets[name]
        while step is not None:
            found.setdefault(step.host, step)
            step = step.jump
    return list(found.values())


def _nearest(wanted: Iterable[Target], done: set[str]) -> list[Target]:
    """Those not looked at yet whose hop, if any, has been."""
    return [
        target
        for target in wanted
        if target.host not in done and (target.jump is None or target.jump.host in done)
    ]


def look(scan: Callable[[Target], str], batch: Sequence[Target]) -> tuple[list[Shown], dict[str, HostError]]:
    """The key of each host, or why it cannot be seen."""
    from swarmctl.remote.transport import HostError

    def one(target: Target) -> Shown | HostError:
        try:
            return Shown(target, scan(target))
        except HostError as error:
            return error

    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(AT_ONCE) as pool:
        outcomes = list(zip(batch, pool.map(one, batch), strict=True))
    seen = [outcome for _, outcome in outcomes if isinstance(outcome, Shown)]
    return seen, {target.host: outcome for target, outcome in outcomes if isinstance(outcome, HostError)}


def pin(lock: LockFile, shown: Iterable[Shown]) -> LockFile:
    """The lock file with the shown keys in it."""
    for one in shown:
        lock = lock.pinned(one.target.host, (one.key,))
    return lock


def _judge(shown: Sequence[Shown], *, replace: bool) -> tuple[list[Shown], list[Shown]]:
    """Print every key; those to pin, and those that changed and may not be replaced."""
    for one in shown:
        console.out().print(one.line())
    changed = [one for one in shown if one.state is State.CHANGED]
    fresh = [one for one in shown if one.state is State.NEW] + (changed if replace else [])
    return fresh, [] if replace else changed


def _confirm(fresh: Sequence[Shown], *, yes: bool) -> None:
    if yes:
        return
    if not sys.stdin.isatty():
        console.fail("there is no terminal to ask on", f"{ADVICE}, then run the same command with --yes")
    console.out().print(ADVICE)
    answer = console.out().input(f"type yes to pin {len(fresh)} key{'s' if len(fresh) > 1 else ''}: ")
    if answer.strip() != "yes":
        console.fail("nothing was pinned in this step")


def _conclude(failed: Mapping[str, HostError], refused: Sequence[Shown]) -> None:
    for error in failed.values():
        console.err().print(f"error: {error.message}")
        if error.hint:
            console.err().print(f"  help: {error.hint}")
    if refused:
        names = " ".join(f"--host {one.target.host}" for one in refused)
        console.fail(
            f"{len(refused)} of the hosts show another key than the pinned one",
            f"re-flashed? add {names} --replace; if not, another machine answers at this address",
        )
    if failed:
        raise typer.Exit(exits.HOSTS_UNREACHABLE)
