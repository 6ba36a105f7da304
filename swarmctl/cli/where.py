"""Which hosts a verb is about, and the way to them: one value, made of the options that verbs share."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import partial, wraps
from typing import TYPE_CHECKING, Any, get_type_hints

from swarmctl.cli import console, exit_codes, next_command, options
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.cli.ssh_targets import NamedHosts
    from swarmctl.remote.transport import HostError, Target, Transport
    from swarmctl.render.bundle import Bundle
    from swarmctl.spec.load import Document
    from swarmctl.swarm.resolved import Swarm

_ABSENT = ("unreachable", "host-key")  # kinds of errors of hosts that exist only in a lab


@dataclass(frozen=True)
class Where:
    """The hosts of a spec, real or of a lab, those of them that were selected, and how they are reached."""

    spec: SpecFiles
    lab: bool = False
    lab_name: str = ""
    limit: list[str] | None = None
    parallel: int = options.PARALLEL
    executor: str = ""
    no_reuse: bool = True

    @property
    def in_lab(self) -> bool:
        """True if the hosts are those of a lab. The journal of real deploys leaves them out."""
        return self.lab or bool(self.lab_name)

    @property
    def options(self) -> list[str]:
        """The options that choose hosts and the way to them, to be repeated in the next command."""
        chosen = ["--lab-name", self.lab_name] if self.lab_name else ["--lab"] if self.lab else []
        way = ["--executor", self.executor] if self.executor else []
        return [*chosen, *way, *(word for name in self.limit or () for word in ("--limit", name))]

    @property
    def complete(self) -> Callable[[str], str]:
        """Completes the commands in a hint, so that they can be typed."""
        return next_command.completing(self.spec, self.options)

    def limited(self, *selections: str) -> Where:
        """The same way to these hosts only; without any, to all."""
        return replace(self, limit=list(selections) or None)

    def command(self, verb: str, *more: str) -> str:
        """Returns the command line of ``verb`` for the same hosts."""
        return self.spec.command(verb, *next_command.fitting(verb, self.options), *more)

    def advise(self, verb: str, *more: str) -> None:
        """Prints the command that comes next, for the same hosts, on a terminal."""
        next_command.advise(verb, self.spec, *self.options, *more)

    def advise_doctor(self, errors: Mapping[str, HostError]) -> bool:
        """Advises to examine the first host that cannot be logged in to; returns False without one."""
        from swarmctl.remote.transport import Kind

        logins = (Kind.UNREACHABLE, Kind.HOST_KEY, Kind.AUTH, Kind.PRIVILEGE)
        away = next((host for host, error in errors.items() if error.kind in logins), None)
        if away is not None:
            next_command.advise("doctor", self.spec, away, *self.options)
        return away is not None

    def lab_of(self, swarm: str) -> str:
        """The name of the lab with the hosts of ``swarm``; empty for the real hosts."""
        return self.lab_name or swarm if self.in_lab else ""

    def swarm(self, document: Document) -> Swarm:
        """The resolved swarm of a document, with the builds and keys of its hosts, or those of the lab."""
        return console.swarm_of(document, self.lab_of(document.spec.name))

    def targets(self, swarm: NamedHosts) -> Mapping[str, Target]:
        """The SSH target of each host. For a lab, this process enters its network namespace."""
        from swarmctl.cli import pin_file

        found = self._lab_targets(swarm) if self.in_lab else self._real_targets(swarm)
        expelled = pin_file.expelled(self.spec, swarm.name, self.lab_of(swarm.name))
        return {name: _without(expelled, target) for name, target in found.items()} if expelled else found

    def guess_lab(self, verb: str, swarm: str, kinds: Iterable[str]) -> None:
        """Prints ``verb`` with ``--lab`` if errors of these ``kinds`` may come from its absence."""
        for name in _running_labs(swarm) if any(kind in _ABSENT for kind in kinds) else ():
            there = replace(self, lab=True, lab_name="" if name == swarm else name, executor="")
            command = there.command(verb)
            console.err().print(f"the lab {name} of this swarm runs on this machine; its hosts: `{command}`")

    def secrets(self, wanted: Mapping[str, Bundle]) -> Mapping[str, str]:
        """The secrets of the hosts that the operator has; exits with an error for an unusable one."""
        from swarmctl.deploy.secrets import SecretError, found

        names = dict.fromkeys(name for bundle in wanted.values() for name in bundle.secrets)
        found_forms = {one for bundle in wanted.values() for one in bundle.secret_forms.items()}
        forms = dict(sorted(found_forms, reverse=True))  # a variable's, `line`, comes after a file's, `text`
        try:
            return found(names, self.spec.first.parent, forms=forms)
        except SecretError as error:
            console.fail(str(error), error.fix)

    @contextmanager
    def transport(self, *, secrets: bool = False) -> Iterator[Transport]:
        """What connects to the hosts: this process, with connections that the verb before kept, or workers.

        ``secrets``: the operator has some of theirs. Exits if there are no workers. No connection is kept if
        ``sudo`` needs a password.
        """
        from swarmctl.cli import ssh_targets

        if not self.executor:
            ssh = ssh_targets.transport()
            if self.no_reuse or os.environ.get(ssh_targets.SUDO_PASSWORD_FILE):
                yield ssh
            else:
                from swarmctl.remote.kept_connections import KeptConnections

                yield KeptConnections(ssh)
            return
        if self.in_lab:
            console.fail(
                "--executor and --lab exclude each other: workers cannot reach the hosts of a lab",
                code=exit_codes.USAGE,
            )
        from swarmctl.remote import dask_cluster
        from swarmctl.remote.either_ssh import EitherSsh

        login = partial(EitherSsh, ssh_targets.choice())
        try:
            address = dask_cluster.address_of(self.executor)
            with dask_cluster.workers(address, login=login, secrets=secrets) as found:
                yield found
        except dask_cluster.ClusterError as error:
            console.fail(f"--executor: {error}", error.fix)

    def _lab_targets(self, swarm: NamedHosts) -> Mapping[str, Target]:
        from swarmctl.lab import lab as labs
        from swarmctl.lab.errors import LabError
        from swarmctl.lab.hosts import network
        from swarmctl.remote.transport import Target

        name = self.lab_of(swarm.name)
        try:
            operator = labs.operator(name)
            network.enter(operator.namespace)
        except LabError as error:
            name = name if name != swarm.name else ""
            console.fail(str(error), *next_command.in_lab_errors(error.help_lines, self.spec, name))
        return {
            host.name: Target(
                host.name,
                operator.addresses.get(host.name, host.address),
                host.user,
                host.port,
                operator.keys.get(host.name, ()),
                (operator.identity,),
            )
            for host in swarm.hosts.values()
        }

    def _real_targets(self, swarm: NamedHosts) -> Mapping[str, Target]:
        from swarmctl.cli import ssh_targets as real

        found, warnings = real.targets(swarm, real.read_known_hosts(self.spec.first))
        for warning in warnings:
            console.err().print(f"warning: {warning}")
        return found


def _without(expelled: Collection[str], target: Target) -> Target:
    jump = _without(expelled, target.jump) if target.jump is not None else None
    return replace(target, expelled=target.host in expelled, jump=jump)


def _running_labs(swarm: str) -> list[str]:
    """The names of running labs of the swarm."""
    from swarmctl.lab import paths, supervisor_client
    from swarmctl.lab.errors import LabError
    from swarmctl.lab.lab_state import read_state

    def belongs(files: paths.LabPaths) -> bool:
        try:
            return read_state(files).plan.swarm == swarm and supervisor_client.status(files) is not None
        except (LabError, OSError):  # one of another account, or one that was never up
            return False

    return [files.name for files in paths.all_labs() if belongs(files)]


_OPTIONS: Mapping[str, Any] = {
    "lab": options.Lab,
    "lab_name": options.LabName,
    "limit": options.Limit,
    "parallel": options.Parallel,
    "executor": options.Executor,
    "no_reuse": options.NoReuse,
}
_DEFAULTS = {one.name: one.default for one in fields(Where)} | {"no_reuse": False}


def with_where(
    *more: str, spec: Any = options.Spec, overlays: Any = options.Overlays, parallel: int = options.PARALLEL
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Gives a function of a verb the options from which its first parameter, ``where``, is made.

    These are SPEC, ``--file``, ``--lab``, ``--lab-name`` and ``more``: other fields of ``Where``.
    """
    names = ("lab", "lab_name", *more)

    def decorated(function: Callable[..., None]) -> Callable[..., None]:
        hints = get_type_hints(function, include_extras=True)

        @wraps(function)
        def called(*, spec: SpecFiles, overlays: object, **values: Any) -> None:
            del overlays  # they are in ``spec``
            function(Where(spec, **{name: values.pop(name) for name in names}), **values)

        kinds = {"spec": spec, "overlays": overlays} | {name: _OPTIONS[name] for name in names}
        defaults = {"overlays": None, **_DEFAULTS, "parallel": parallel, "spec": inspect.Parameter.empty}
        shared = {name: _parameter(name, kind, defaults[name]) for name, kind in kinds.items()}
        own = [
            _parameter(name, hints[name], one.default)
            for name, one in inspect.signature(function).parameters.items()
            if name != "where"
        ]
        listed = [shared.pop("spec"), *own, *shared.values()]
        called.__signature__ = inspect.Signature(listed)  # type: ignore[attr-defined]
        called.__annotations__ = {one.name: one.annotation for one in listed}
        return called

    return decorated


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
