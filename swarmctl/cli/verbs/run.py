"""``swarmctl run``: the trials of an experiment, each kept as a capsule."""

from __future__ import annotations

import shlex
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, extras, options
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from collections.abc import Collection

    from swarmctl.cli.trial import Trial
    from swarmctl.cli.trial_hosts import TrialHosts
    from swarmctl.cli.trial_release import Releases
    from swarmctl.spec.experiment_model import Experiment
    from swarmctl.spec.model import Spec
    from swarmctl.spec.trial_parameters import Values


@with_where("parallel", parallel=options.PARALLEL_URGENT)
def run(
    where: Where,
    name: Annotated[
        str,
        typer.Argument(metavar="EXPERIMENT", show_default=False, help="Its name under `experiments`."),
    ] = "",
    trial: Annotated[
        int, typer.Option(min=0, max=1_000_000, metavar="N", show_default=False, help="Only this trial.")
    ] = 0,
    resume: Annotated[
        bool, typer.Option("--resume", help="Only trials that are not completed yet, by their capsules.")
    ] = False,
    folder: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Keep the capsules here instead of in NAME-trials."),
    ] = None,
    key: Annotated[
        Path | None, typer.Option("--sign", metavar="KEY", help="Sign each capsule with this SSH key.")
    ] = None,
    capsule: Annotated[
        Path | None,
        typer.Option(
            "--replay",
            metavar="CAPSULE",
            help="Deploy the spec in this capsule, if that gives the same releases, and run its trial again; "
            "SPEC is for the pinned keys beside it.",
        ),
    ] = None,
    hash_serials: Annotated[
        bool,
        typer.Option(
            "--hash-serials", help="Write hashes of the serial numbers of USB devices into the capsules."
        ),
    ] = False,
    json: options.Json = False,
) -> None:
    """Run the trials of an experiment, each kept as a capsule.

    Robots start together and stop with proof. The swarm has to be deployed and healthy. Between trials the
    program of `reset`, or a person at a terminal, places the robots. Ctrl-C stops them and keeps what was
    recorded.
    Exit code 5 if a trial failed, or does not succeed by the criteria of the spec.
    """
    from swarmctl.capsule.signature import sign
    from swarmctl.cli import stop_signals, swarm_look, trial_capsule
    from swarmctl.cli.replay import replayed, require_same
    from swarmctl.cli.trial_release import Releases
    from swarmctl.spec.trial_parameters import combinations

    if key is not None and not key.is_file():
        console.fail(f"{key} is no file", "--sign takes an SSH key, such as ~/.ssh/id_ed25519")
    done: dict[Path, Trial] = {}
    operators, index = where, None
    with ExitStack() as stack:
        stack.enter_context(stop_signals.as_interrupt())
        if capsule is not None:
            where, index = stack.enter_context(replayed(where, capsule))
        wanted = swarm_look.expected(where)
        if index is not None:
            name, trial = index.experiment, index.trial
            require_same(wanted, index)
        experiment = experiment_of(wanted.document.spec, name)
        if experiment.success:
            extras.need("`success`", "experiments", "rosbags")
        place = (folder or Path(f"{wanted.swarm.name}-trials")) / name
        varied = combinations(experiment) if index is None else [index.parameters]
        numbers = [trial] if trial else list(range(1, experiment.trials * len(varied) + 1))
        known = trial_capsule.completed(place) if resume else set[int]()
        releases = stack.enter_context(Releases(where, wanted, index))
        releases.check(experiment)
        for number in (one for one in numbers if one not in known):
            if done:
                _between(operators, releases, name, number, [*done.values()][-1].outcome)
            own = place / f"{number:03}-{time.strftime('%Y%m%d-%H%M%S')}"
            values = varied[(number - 1) % len(varied)]
            done[own] = found = _run(operators, releases, values, name, number, own)
            try:
                found.judged = trial_capsule.judged(own, experiment, found)
            except KeyboardInterrupt:
                found.interrupt()
            trial_capsule.write(own, found, name, releases, hash_serials=hash_serials)
            if key is not None and (unsigned := sign(own, key)):
                console.show(f"warning: {own} is not signed: {unsigned}", error=True)
            if not json:
                console.show(f"trial {number}  {_result(found)}  {own}")
            if found.outcome == "interrupted":
                break
    if json:
        trials = [
            {
                "trial": one.number,
                "outcome": one.outcome,
                "cause": one.cause,
                "success": one.success,
                "capsule": str(own),
            }
            for own, one in done.items()
        ]
        console.print_json({"v": 1, "swarm": wanted.swarm.name, "experiment": name, "trials": trials})
    elif done:
        console.show_next(shlex.join(["swarmctl", "capsule", "show", str(place)]))
    raise typer.Exit(_exit(done.values()) if releases.restored else exit_codes.HOSTS_FAILED)


def experiment_of(spec: Spec, name: str) -> Experiment:
    """Returns an experiment of a spec; ends the program if there is none of this name."""
    from swarmctl.suggest import did_you_mean

    if not name:
        listed = ", ".join(spec.experiments) or "none; write one under `experiments`"
        console.fail("missing argument EXPERIMENT", f"the spec has {listed}", code=exit_codes.USAGE)
    if name not in spec.experiments:
        help_ = did_you_mean(name, spec.experiments, "experiments")
        console.fail(
            f"the spec has no experiment `{name}`",
            *(help_ or ("write it under `experiments`",)),
            code=exit_codes.USAGE,
        )
    return spec.experiments[name]


def _between(operators: Where, releases: Releases, name: str, number: int, last: str) -> None:
    """Has the robots brought back to their places: by the program of `reset`, or by a person.

    In a trial whose outcome was not "completed", somebody may have stopped them: then no program drives them.
    """
    from swarmctl.cli.trial import TrialError

    person = console.err().is_terminal and sys.stdin.isatty() and not operators.in_lab
    reset = releases.wanted.document.spec.experiments[name].reset
    if reset is not None and (last == "completed" or operators.in_lab):
        try:
            _hosts(operators, releases, name).reset()
        except TrialError as error:
            console.fail(f"trial {number} did not begin: {error}", code=exit_codes.UNHEALTHY)
    elif person:
        typer.prompt("place the robots, then press Enter", default="", show_default=False, err=True)
    elif reset is not None:
        console.fail(
            f"trial {number} did not begin: program {reset} drives no robots after a trial that failed",
            "place them, then go on by --resume",
            code=exit_codes.UNHEALTHY,
        )


def _run(operators: Where, releases: Releases, values: Values, name: str, number: int, folder: Path) -> Trial:
    from swarmctl.cli.trial import TrialError
    from swarmctl.views.capsule import parameters_text

    varied = parameters_text(values)
    console.show(f"trial {number}" + (f" with {varied}" if varied else ""), error=True)
    try:
        (folder / "bags").mkdir(parents=True)
        if not releases.has(values):
            _hosts(operators, releases, name).stand()
            releases.deploy(values)
        return _hosts(operators, releases, name).run(number, folder)
    except OSError as error:
        console.fail(console.cannot_write(error, folder))
    except TrialError as error:
        with suppress(OSError):  # nothing is in it
            (folder / "bags").rmdir()
            folder.rmdir()
        console.fail(f"trial {number} did not begin: {error}", code=exit_codes.UNHEALTHY)


def _hosts(operators: Where, releases: Releases, name: str) -> TrialHosts:
    from swarmctl.cli import ssh_targets, swarm_look
    from swarmctl.cli.trial_hosts import TrialHosts

    where, wanted = releases.where, releases.wanted
    targets = where.targets(wanted.swarm)
    look = swarm_look.looking_at(
        wanted, targets, ssh_targets.transport(), window=options.WINDOW, parallel=where.parallel
    )
    return TrialHosts(
        wanted.swarm, name, wanted.document.spec.experiments[name], targets, ssh_targets.transport, look,
        complete=operators.complete, parallel=where.parallel,
    )  # fmt: skip


def _result(trial: Trial) -> str:
    from swarmctl.views.capsule import unmet

    cause = trial.cause or unmet(trial.judged)
    outcome = "succeeded" if trial.success else trial.outcome
    return f"{outcome}: {cause}" if cause else outcome


def _exit(trials: Collection[Trial]) -> int:
    if any(one.outcome == "interrupted" for one in trials):
        return exit_codes.INTERRUPTED
    failed = any(one.outcome == "failed" or one.success is False for one in trials)
    return exit_codes.UNHEALTHY if failed else exit_codes.OK
