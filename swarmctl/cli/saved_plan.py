"""A plan in a file: ``plan -o FILE`` writes it, ``deploy FILE`` carries out exactly it, or nothing."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from swarmctl.cli import console, exit_codes
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.plan.plan import Plan

_FORMAT = "swarmctl plan 1"
_LARGEST = 64 << 20
_AGAIN = "make it again with `swarmctl plan -o`"


@dataclass(frozen=True)
class SavedPlan:
    """The plans of ``hosts`` as JSON data, and the arguments that they were made with."""

    where: Where
    hosts: list[dict[str, Any]]

    def applied(self, where: Where) -> Where:
        """Returns where a deploy carries the plan out; exits if its options contradict those of the plan."""
        own = self.where
        other_lab = (where.lab, where.lab_name) not in ((False, ""), (own.lab, own.lab_name))
        if where.spec.files[1:] or other_lab or (where.limit and where.limit != own.limit):
            console.fail(
                "the saved plan says which spec and hosts: leave --file, --limit, --lab and --lab-name out",
                code=exit_codes.USAGE,
            )
        return replace(where, spec=own.spec, lab=own.lab, lab_name=own.lab_name, limit=own.limit)

    def write(self, path: Path) -> None:
        """Writes the plan, with the places of the spec's files relative to it; exits if it cannot."""
        files = [os.path.relpath(file, path.parent) for file in self.where.spec.files]
        data = {
            "format": _FORMAT,
            "files": files,
            "lab": self.where.lab,
            "lab_name": self.where.lab_name,
            "limit": self.where.limit,
            "hosts": self.hosts,
        }
        try:
            path.write_text(json.dumps(data, indent=1) + "\n", "utf-8")
        except OSError as error:
            console.fail(console.cannot_write(error, str(path)))


def hosts_of(made: Plan) -> list[dict[str, Any]]:
    """Returns what must not change between a plan and its deploy: releases, steps, problems, last changes."""
    return [
        {**host.to_json(), "last": host.last, "diffs": {}, "notes": [], "problem": _kind(host.problem)}
        for host in made.hosts
    ]


def _kind(problem: Any) -> str | None:
    return problem.kind if problem else None


def read(spec: SpecFiles) -> SavedPlan | None:
    """Returns the plan in a file that was given as SPEC; None for a spec. Exits if the file is damaged."""
    path = spec.first
    try:
        with path.open("rb") as file:
            if not file.read(64).startswith(b'{\n "format": "swarmctl plan'):
                return None
            file.seek(0)
            data = json.loads(file.read(_LARGEST))
        if data["format"] != _FORMAT:
            console.fail(
                f"{path}: a plan of another version of swarmctl", "make it again with `swarmctl plan -o`"
            )
        files = tuple(Path(os.path.normpath(path.parent / name)) for name in data["files"])
        limit = None if data["limit"] is None else [str(one) for one in data["limit"]]
        where = Where(SpecFiles(files), bool(data["lab"]), str(data["lab_name"]), limit)
        return SavedPlan(where, list(data["hosts"]))
    except OSError:
        return None  # the error of a spec that cannot be read says more
    except (ValueError, LookupError, TypeError):
        console.fail(f"{path}: a damaged plan", _AGAIN)


def stale(saved: SavedPlan, now: Plan) -> str:
    """Returns why the plan is stale; empty if nothing has changed since."""
    before, after = ({one["host"]: one for one in hosts} for hosts in (saved.hosts, hosts_of(now)))
    if before.keys() != after.keys():
        return "the spec has other hosts now"
    for name, planned in before.items():
        found = after[name]
        if planned["next"] != found["next"]:
            return f"the spec has changed: {name} would get release {found['next']}, not {planned['next']}"
        if planned["problem"] != found["problem"]:
            return f"{name} is {found['problem'] or 'fit'} now, and was {planned['problem'] or 'fit'}"
        if (planned["previous"], planned["last"]) != (found["previous"], found["last"]):
            return f"somebody has deployed to {name} since"
        if planned["steps"] != found["steps"]:
            return f"{name} was changed by hand since"
    return ""
