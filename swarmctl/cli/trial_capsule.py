"""The capsules of trials: written from what came of one, and read to see which are completed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarmctl.capsule import folder as capsules
from swarmctl.capsule.capsule_index import CapsuleError
from swarmctl.capsule.git_state import git_state
from swarmctl.cli import console, trial_spec
from swarmctl.deploy.host_systems import with_hashes
from swarmctl.remote import operators
from swarmctl.swarm.topic_island import full_name
from swarmctl.version import __version__

if TYPE_CHECKING:
    from swarmctl.capsule.capsule_index import Judged
    from swarmctl.cli.trial import Trial
    from swarmctl.cli.trial_release import Releases
    from swarmctl.deploy.host_systems import System
    from swarmctl.spec.experiment_model import Experiment


def write(folder: Path, trial: Trial, experiment: str, releases: Releases, *, hash_serials: bool) -> None:
    """Makes a folder, which has the bags already, the capsule of a trial.

    Ends the program if it cannot be written.
    """
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views.sbom import cyclonedx

    wanted, files = releases.wanted, releases.where.spec.files
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, look in (("before", trial.before), ("after", trial.after)):
            if look is not None:
                text = json.dumps(look.status.to_json(), indent=1) + "\n"
                (folder / f"status-{name}.json").write_text(text, "utf-8")
        costs = {host: [asdict(one) for one in units] for host, units in trial.costs.items()}
        (folder / "costs.json").write_text(json.dumps(costs, indent=1) + "\n", "utf-8")
        made = bundles(wanted.swarm)
        (folder / "sbom.json").write_text(cyclonedx(wanted.swarm, made), "utf-8")
        spec = trial_spec.write(folder, wanted.document, files)
        types = {name: one.type_name for name, one in wanted.swarm.robots.items()}
        facts = _facts(trial, types, hash_serials=hash_serials)
        own = {
            "swarm": wanted.swarm.name,
            "experiment": experiment,
            "seconds": wanted.document.spec.experiments[experiment].duration,
            "spec": spec,
            "parameters": releases.values,
            "git": git_state(files[0].absolute().parent),
        }
        capsules.write(folder, {**facts, **own})
    except OSError as error:
        console.fail(console.cannot_write(error, folder))
    except CapsuleError as error:
        console.fail(str(error), error.help)


def judged(folder: Path, experiment: Experiment, trial: Trial) -> list[Judged]:
    """Returns what the bags show of a trial, from its start on; a bag that cannot be read is named."""
    if not experiment.success:
        return []
    from swarmctl.capsule.bag_topics import read  # needs what `extras` asks for
    from swarmctl.capsule.success import judge

    wanted = {full_name(one.topic) for one in experiment.success}
    found = read(folder / "bags", wanted, lambda host: trial.began.get(host, trial.start))
    for trouble in found.troubles:
        console.show(f"warning: {trouble}", error=True)
    return judge(experiment.success, found.topics)


def _system(known: System | None, *, hash_serials: bool) -> dict[str, Any]:
    """What the index has of a host's system."""
    if known is None:
        return {}
    one = with_hashes(known) if hash_serials else known
    return {
        "platform": one.platform, "python": one.python, "kernel": one.kernel, "model": one.model,
        "devices": [device._asdict() for device in one.devices], "packages": one.packages,
    }  # fmt: skip


def _of_robot(trial: Trial, host: str, robot: str) -> dict[str, str]:
    known = trial.systems.get(host)
    if known is None:
        return {}
    return {"port": known.ports.get(robot, ""), "firmware": known.firmware.get(robot, "")}


def _facts(trial: Trial, types: Mapping[str, str], *, hash_serials: bool) -> dict[str, Any]:
    hosts = {
        row.name: {
            "address": row.address, "release": row.release or "", "began": trial.began.get(row.name),
            "clock": trial.clocks[row.name]._asdict() if row.name in trial.clocks else None,
            **_system(trial.systems.get(row.name), hash_serials=hash_serials),
        }
        for row in trial.before.status.hosts
    }  # fmt: skip
    robots = {
        one.robot: {
            "host": one.host, "type": types[one.robot],
            "state": one.state, "proof": one.proof, "seconds": one.seconds,
            **_of_robot(trial, one.host, one.robot),
        }
        for one in trial.stops
    }  # fmt: skip
    return {
        "trial": trial.number,
        "began": trial.start,
        "ended": trial.ended,
        "outcome": trial.outcome,
        "cause": trial.cause,
        "success": trial.success,
        "judged": trial.judged,
        "swarmctl": __version__,
        "operator": operators.person(operators.this_one()),
        "skew": trial.skew,
        "hosts": hosts,
        "robots": robots,
    }


def completed(place: Path) -> set[int]:
    """Returns the numbers of the trials whose capsules in this folder are of completed ones."""
    found = set()
    for one in capsules.below(place, levels=1):
        try:
            index = capsules.read(one)
        except CapsuleError as error:
            console.show(f"warning: {error}", error=True)
            continue
        if index.outcome == "completed":
            found.add(index.trial)
    return found
