"""The release of a trial: the spec's own, or one with other parameters, which is deployed before."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import typer

from swarmctl.capsule.capsule_index import plain
from swarmctl.cli import console, deploy_steps, exit_codes, left_hosts, rollout_output, swarm_look
from swarmctl.cli.trial import TrialError
from swarmctl.spec import trial_parameters
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarmctl.capsule.capsule_index import Index
    from swarmctl.cli.swarm_look import Expected
    from swarmctl.cli.where import Where
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.spec.trial_parameters import Values


class Releases:
    """The releases of an experiment: ``where`` and ``wanted`` are of that with ``values``, which hosts have.

    When its trials are over, hosts have the spec's own again; ``restored`` is False if they may not. The one
    of a capsule, with the parameters of its ``index``, is deployed before its trial.
    """

    def __init__(self, where: Where, own: Expected, index: Index | None = None) -> None:
        self._own, self._values = (where, own), index.parameters if index is not None else {}
        self._folder = tempfile.TemporaryDirectory(prefix="swarmctl-trial-")
        self.where, self.wanted = self._own
        self.values: Values | None = self._values if index is None else None
        self.restored = True

    def __enter__(self) -> Releases:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self.values is not None and not self.has(self._values):
                self.restored = False
                self.deploy(self._values)
                self.restored = True
        except TrialError as failed:
            console.show(f"the spec was not deployed again: {failed}", error=True)
        finally:
            if not self.restored:
                again = self._own[0].command("deploy")
                console.show(f"hosts may still have the parameters of a trial; `{again}`", error=True)
            self._folder.cleanup()
        if not self.restored and isinstance(error, typer.Exit):
            raise typer.Exit(exit_codes.HOSTS_FAILED)

    def has(self, values: Values) -> bool:
        """Returns whether hosts have the spec with these parameters."""
        return json.dumps(values) == json.dumps(self.values)

    def check(self, experiment: Experiment) -> None:
        """Ends the program if a value in `parameters` makes the spec invalid, or cannot be in a capsule."""
        from swarmctl.linter.runner import check_files

        for program, keys in experiment.parameters.items():
            for key, values in keys.items():
                for value in values:
                    try:
                        plain(value)
                    except ValueError as error:
                        console.fail(f"a trial cannot have {program}.{key} {value!r}: {error}")
                    spec = self._with({program: {key: value}}).spec
                    if check_files(*spec.files, workspaces=spec.workspaces)[0] is None:
                        console.read_document(spec)  # ends the program

    def deploy(self, values: Values) -> None:
        """Deploys the spec with these parameters. Its robots have to stand. Raises ``TrialError``."""
        where, wanted = self._own
        if values != self._values:
            where = self._with(values)
            wanted = swarm_look.expected(where)
        self.where, self.wanted, self.values = where, wanted, values
        deploy(where, wanted)

    def _with(self, values: Values) -> Where:
        where, wanted = self._own
        file = Path(self._folder.name, "parameters.yaml")
        file.write_text(trial_parameters.overlay(values, wanted.document.spec), "utf-8")
        return replace(where, spec=replace(where.spec, files=(*where.spec.files, file)))


def deploy(where: Where, wanted: Expected) -> None:
    """Deploys a spec whose robots stand. Raises ``TrialError``; a stop by a person is a KeyboardInterrupt."""
    from swarmctl.deploy.deployment import Deployment
    from swarmctl.deploy.outcome import Rules
    from swarmctl.plan.robots_in_use import Dependents
    from swarmctl.plan.waves import order
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.remote.transport import HostError
    from swarmctl.render.build_bundle import bundles

    swarm = wanted.swarm
    made, stop = bundles(swarm), Stop()
    secrets = where.secrets(made)
    rules = Rules(optional=[name for name in made if swarm.hosts[name].optional], stop_robots=True)
    view = deploy_steps.View("deploy", swarm, where, details=False, json=True)
    with where.transport(secrets=bool(secrets)) as transport:
        deployment = Deployment(
            made, where.targets(swarm), transport, rules=rules, parallel=where.parallel, stop=stop,
            secrets=secrets, host_lists=left_hosts.lists_of(swarm), dependents=Dependents(swarm),
        )  # fmt: skip
        found = view.executed(
            deployment, stop, lambda one: order(one.due, (), (), "all"), dry_run=False, yes=True
        )
    if stop.requested:
        raise KeyboardInterrupt
    absent = rollout_output.absent(found, swarm.hosts)
    for host in absent:
        console.show(f"{host} does not answer and is optional: it keeps the release that it has", error=True)
    for host, one in found.items():
        if isinstance(one, HostError) and host not in absent:
            raise TrialError(printable(f"{host}: {one.message}"))
