"""``swarmctl trust``: scans the hosts' SSH keys and pins them in a known_hosts file beside the spec."""

from __future__ import annotations

import dataclasses
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, file_writes, next_command, options, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.remote.known_hosts import KnownHosts
    from swarmctl.remote.transport import HostError, Target
    from swarmctl.swarm.resolved import Swarm

PARALLEL = 32
ADVICE = (
    "compare with what `ssh-keygen -lf /etc/ssh/ssh_host_ed25519_key.pub` prints on the host's own screen"
)


class State(str, Enum):
    """A shown key against the pinned ones."""

    KNOWN = "known"
    NEW = "new"
    CHANGED = "changed"
    REVOKED = "revoked"


@dataclass(frozen=True)
class Scanned:
    """The key that a host shows, compared with the pinned ones; without any, with ``~/.ssh/known_hosts``."""

    target: Target
    key: str
    elsewhere: tuple[str, ...]
    revoked: tuple[str, ...]

    @property
    def state(self) -> State:
        """The state of the key: known, new, changed or revoked."""
        if self.key in self.revoked:
            return State.REVOKED
        if self.key in self.target.keys:
            return State.KNOWN
        if self.target.keys or (self.elsewhere and self.key not in self.elsewhere):
            return State.CHANGED
        return State.NEW

    def lines(self) -> list[str]:
        """What people compare: the key, and the ones that it should be."""
        where = "was pinned:" if self.target.keys else "in ~/.ssh/known_hosts:"
        before = (self.target.keys or self.elsewhere) if self.state is State.CHANGED else ()
        shown = _named(f"{self.state.value:8} {self.target.host}  {self.target.address} ", self.key)
        return [shown, *(_named(f"{'':8} {where}", key) for key in before)]


def _named(text: str, key: str) -> str:
    from swarmctl.remote.known_hosts import fingerprint
    from swarmctl.views.escape import printable

    return printable(f"{text} {key.split(maxsplit=1)[0]} {fingerprint(key)}")


@with_where()
def trust(
    where: Where,
    host: options.HostOrLimit = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Also pin changed keys, of hosts that were re-flashed.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Pin without asking, in a network you trust.")] = False,
) -> None:
    """Show the SSH keys of new hosts and pin them in NAME.known_hosts beside the spec.

    In a sealed swarm, then pin the public WireGuard key of each host, which makes its own, in NAME.wireguard.
    """
    swarm = console.read_spec(where.spec)
    failed: dict[str, HostError] = {}
    refused: list[Scanned] = []
    changed: tuple[str, ...] = ()
    if where.in_lab:  # which knows the SSH keys of its hosts
        chosen = selected.hosts(swarm.candidates, host)
    else:
        chosen, failed, refused = _pin_ssh(where.spec, swarm, host, replace=replace, yes=yes)
    if swarm.overlay:
        from swarmctl.cli import wireguard_pins

        members = {name for island in swarm.islands for name in island.hosts} - failed.keys()
        named = [one for one in chosen if one in members]
        pins = wireguard_pins.pin(where, swarm, named, named if replace else ())
        failed, changed = failed | pins.failed, pins.changed
    _conclude(swarm, failed, refused, changed)
    # Jump hosts of ~/.ssh/config are no hosts of a plan.
    limit = () if set(host or ()) - set(swarm.hosts) else host or ()
    where.limited(*limit).advise("plan")


def _pin_ssh(
    spec: SpecFiles, swarm: Swarm, host: Sequence[str] | None, *, replace: bool, yes: bool
) -> tuple[list[str], dict[str, HostError], list[Scanned]]:
    """Pin new SSH keys; returns the chosen hosts, errors of those that show none, and refused keys."""
    from swarmctl.cli.ssh_targets import known_elsewhere, read_known_hosts, targets, transport
    from swarmctl.remote.known_hosts import path_beside

    path = path_beside(spec.first)
    known = read_known_hosts(spec.first)
    ways, warnings = targets(swarm, known)
    if host:
        host = _selected(swarm, host, _with_hops(ways.values()))
    for text in warnings:
        console.err().print(f"warning: {text}")
    elsewhere = known_elsewhere()
    scan = transport(become=False).scan
    failed: dict[str, HostError] = {}
    refused: list[Scanned] = []
    done: set[str] = set()
    # A host behind a jump host can be scanned only after the jump host's key is pinned.
    while batch := _nearest(_wanted(targets(swarm, known)[0], host), done):
        done.update(target.host for target in batch)
        scanned, missed = _scan_all(scan, batch, elsewhere)
        failed |= missed
        # With --host, no changed key of a jump host on the way is pinned, unless --host names it.
        replaceable = set(host or [target.host for target in batch]) if replace else set()
        fresh, rejected = _judge(scanned, replaceable)
        refused += rejected
        if fresh:
            _confirm(fresh, yes=yes)
            for one in fresh:
                known = known.pinned(one.target.host, one.target.address, one.target.port, (one.key,))
            file_writes.replace(path, known.dump().encode(errors="surrogateescape"))
            console.out().print(f"pinned {len(fresh)} in {path}")
    return list(host or ways), failed, refused


def _selected(swarm: Swarm, selections: Sequence[str], reachable: Iterable[str]) -> list[str]:
    """The selected hosts, and the jump hosts of ~/.ssh/config that are named."""
    jumps = [one for one in reachable if one in selections and one not in swarm.hosts]
    others = [one for one in selections if one not in jumps]
    return [*jumps, *(selected.hosts(swarm.candidates, others) if others else ())]


def _with_hops(targets: Iterable[Target]) -> dict[str, Target]:
    """The targets and every jump host on the way to them, by name."""
    found: dict[str, Target] = {}
    for target in targets:
        step: Target | None = target
        while step is not None:
            found.setdefault(step.host, step)
            step = step.jump
    return found


def _wanted(targets: Mapping[str, Target], names: Sequence[str] | None) -> list[Target]:
    """The named hosts, all without names, and every jump host on the way to them."""
    everything = _with_hops(targets.values())
    return list(_with_hops(everything[name] for name in names or targets).values())


def _nearest(wanted: Iterable[Target], done: set[str]) -> list[Target]:
    """The targets that were not scanned yet and whose jump host, if any, was."""
    return [
        target
        for target in wanted
        if target.host not in done and (target.jump is None or target.jump.host in done)
    ]


def _scan_all(
    scan: Callable[[Target], str], batch: Sequence[Target], elsewhere: KnownHosts
) -> tuple[list[Scanned], dict[str, HostError]]:
    """The key of each host, and the error of each host that shows none."""
    from concurrent.futures import ThreadPoolExecutor

    from swarmctl.remote.known_hosts import REVOKED, ssh_name
    from swarmctl.remote.transport import HostError

    def one(target: Target) -> Scanned | HostError:
        name = [ssh_name(target.address, target.port)]
        others = elsewhere.find(name)
        try:
            # A host with several keys shows one of a type that is known, if it has one.
            key = scan(dataclasses.replace(target, keys=target.keys or others))
            return Scanned(target, key, others, revoked=(*target.revoked, *elsewhere.find(name, REVOKED)))
        except HostError as error:
            return error

    with ThreadPoolExecutor(PARALLEL) as pool:
        outcomes = list(zip(batch, pool.map(one, batch), strict=True))
    scanned = [outcome for _, outcome in outcomes if isinstance(outcome, Scanned)]
    return scanned, {target.host: outcome for target, outcome in outcomes if isinstance(outcome, HostError)}


def _judge(scanned: Sequence[Scanned], replaceable: set[str]) -> tuple[list[Scanned], list[Scanned]]:
    """Print the keys, of many known ones only the hosts; return those to pin and those that are refused."""
    from swarmctl.views.equal_hosts import FEW
    from swarmctl.yamltext import hostlist

    known = [one.target.host for one in scanned if one.state is State.KNOWN]
    folded = known if len(known) > FEW else []
    if folded:
        console.show(f"{State.KNOWN.value:8} {len(folded)} hosts: {hostlist.written(folded)}")
    for one in scanned:
        if one.target.host not in folded:
            console.show("\n".join(one.lines()))
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
    console.show(ADVICE)
    answer = console.out().input(f"type yes to pin {len(fresh)} key{'s' if len(fresh) > 1 else ''}: ")
    if answer.strip() != "yes":
        console.fail("nothing was pinned in this step")


def _conclude(
    swarm: Swarm, failed: Mapping[str, HostError], refused: Sequence[Scanned], other_wireguard: Sequence[str]
) -> None:
    """Print the errors and end with the exit code that fits; return if there is none."""
    from swarmctl.views.equal_hosts import names_of
    from swarmctl.views.rollout import RolloutView
    from swarmctl.yamltext import hostlist

    if failed:
        width = console.err().width if console.err().is_terminal else None
        text = RolloutView(names_of(swarm), width=width).failures(failed)
        text.rstrip()
        console.err().print(text)
    if revoked := [one.target.host for one in refused if one.state is State.REVOKED]:
        listed = hostlist.written(revoked)
        console.show(f"error: {listed}: the host key is revoked (@revoked) and is never pinned", error=True)
        console.err().print("  help: on the host, remove /etc/ssh/ssh_host_* and run `ssh-keygen -A`")
    if changed := [one.target.host for one in refused if one.state is State.CHANGED]:
        ours = [name for name in changed if name in swarm.hosts]
        values = [next_command.selection(ours), *(name for name in changed if name not in ours)]
        options = shlex.join(word for value in values if value for word in ("--host", value))
        console.fail(
            f"{len(changed)} of the hosts show another key than the known one",
            f"re-flashed? add {options} --replace; if not, another machine answers at this address",
        )
    if other_wireguard:
        console.fail(
            f"{hostlist.written(other_wireguard)}: the WireGuard key is another than the pinned one",
            f"re-flashed? add --host {next_command.selection(other_wireguard)} --replace, then deploy to all "
            "hosts; if not, somebody has replaced /etc/swarm on it",
        )
    if refused:
        raise typer.Exit(exit_codes.ERROR)
    if failed:
        raise typer.Exit(exit_codes.HOSTS_UNREACHABLE)
