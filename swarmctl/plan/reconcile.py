"""Compares a bundle with an observed host: the steps to write, stop, start and restart, with their causes.

Such a change restarts and reloads nothing, and cannot lock the operator out: it needs no confirmation.

The host's agent makes files, links and blocks those of the manifest; the steps describe the effect.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Sequence

from swarm_onboard.agent.paths import READERS
from swarm_onboard.agent.steps import Kind, Step

from swarmctl.health import unit_faults
from swarmctl.plan import observed_host, preflight
from swarmctl.plan.host_needs import install_hints
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle, File, in_words, package
from swarmctl.render.elf import machines_of

_OF_FILES = (Kind.CREATE, Kind.UPDATE, Kind.DELETE)
_AT_LOGIN = ("setup.bash",)  # people read it in the files of their shells, so that it may end a login


def files_only(steps: Sequence[Step], bundle: Bundle, observed: Observed) -> bool:
    """Returns True if the steps exchange nothing but files that no unit needs and no link or block shows."""
    old, new = observed.manifest, bundle.manifest
    if old is None or observed.digest in (None, bundle.digest) or observed.unfinished:
        return False
    if any(step.kind not in (*_OF_FILES, Kind.ACTIVATE) for step in steps):
        return False
    if any(old[part] != new[part] for part in ("units", "links", "blocks", "secrets")):
        return False
    if observed.links or observed.blocks:
        return False
    needed = {path for unit in new["units"] for path in unit["needs"]}
    used = {*needed, *new["links"].values(), *new["blocks"].values(), *_AT_LOGIN}
    return not any(step.kind in _OF_FILES and step.target in used for step in steps)


_DRIFT = {
    "changed": "was changed on the host",
    "missing": "is missing on the host",
    "damaged": "is damaged on the host",
    "broken": "lacks one of its marker lines",
    "foreign": "exists and was not written by swarmctl",
    "extra": "is not part of the release",
}
_SECRETS = {"new": "not on the host yet", "other": "has changed"}


def reconcile(bundle: Bundle, observed: Observed, *, diff: bool = False) -> HostPlan:
    """The steps from ``observed`` to ``bundle`` in order; none if they are equal.

    ``diff`` adds unified diffs of the files that change.
    """
    secrets = [
        Step(Kind.SECRET, name, _SECRETS[state])
        for name, state in observed.secrets.items()
        if state in _SECRETS
    ]
    keys = [Step(Kind.KEY, name, "its WireGuard keys have changed") for name in observed.unknown_keys]
    files = list(_file_steps(bundle, observed))
    system = list(_link_steps(bundle, observed)) + list(_block_steps(bundle, observed))
    units = list(_unit_steps(bundle, observed))
    steps = [*secrets, *keys, *files, *(step for step in units if step.kind == Kind.STOP)]
    never_part = observed.digest is None and not bundle.files
    if files or (observed.digest != bundle.digest and not never_part) or observed.unfinished:
        steps.append(_activation(bundle, observed))
    steps += [*system, *_reload_steps(bundle, observed, files, system)]
    steps += [step for step in units if step.kind != Kind.STOP]
    return HostPlan(
        host=bundle.host,
        previous=observed.digest,
        next=bundle.digest,
        steps=tuple(steps),
        diffs=_diffs(bundle, observed) if diff else {},
        notes=_notes(bundle, observed),
        problem=_unfit(bundle, observed),
        last=observed.last_txid,
        files_only=files_only(steps, bundle, observed),
    )


def _file_steps(bundle: Bundle, observed: Observed) -> Iterator[Step]:
    wanted = {file.path: file for file in bundle.files}
    for path, file in wanted.items():
        if path not in observed.files:
            yield Step(Kind.CREATE, path, _origin(file, "new"))
        elif observed.files[path]["sha256"] != file.digest:
            yield Step(Kind.UPDATE, path, _origin(file, "changed"))
        elif observed.files[path]["mode"] != file.mode:
            yield Step(Kind.UPDATE, path, "its mode changes")
        elif path in observed.drift:
            yield Step(Kind.UPDATE, path, _DRIFT[observed.drift[path]])
    for path in observed.files:
        if path not in wanted:
            yield Step(Kind.DELETE, path, "no longer part of the spec")
    for path, state in observed.drift.items():
        if state == "extra" and path not in wanted and path not in observed.files:
            yield Step(Kind.DELETE, path, _DRIFT[state])


def _origin(file: File, what: str) -> str:
    return (
        f"{what}, from {file.origin}"
        if file.origin
        else f"{what} in this version of swarmctl"
        if what == "changed"
        else what
    )


def _activation(bundle: Bundle, observed: Observed) -> Step:
    if observed.unfinished:
        return Step(Kind.ACTIVATE, bundle.digest, observed.unfinished)
    if observed.digest is None:
        return Step(Kind.ACTIVATE, bundle.digest, "first release on this host")
    if observed.digest == bundle.digest:
        return Step(Kind.ACTIVATE, bundle.digest, "the release on the host is damaged")
    return Step(Kind.ACTIVATE, bundle.digest, f"replaces {observed.digest}")


def _link_steps(bundle: Bundle, observed: Observed) -> Iterator[Step]:
    known = observed.manifest["links"] if observed.manifest else {}
    for path, inside in bundle.links.items():
        if not observed.takes(path):
            continue
        if known.get(path) != inside:
            yield Step(Kind.LINK, path, "new" if path not in known else f"points to {inside} now")
        elif path in observed.links:
            yield Step(Kind.LINK, path, _DRIFT[observed.links[path]])
    for path in {**known, **observed.links}:
        if path not in bundle.links:
            yield Step(Kind.UNLINK, path, "no longer part of the spec" if path in known else _DRIFT["extra"])


def _block_steps(bundle: Bundle, observed: Observed) -> Iterator[Step]:
    """A block holds a release file's text; it is written when that file changes or the block was edited."""
    known = observed.manifest["blocks"] if observed.manifest else {}
    files = bundle.manifest["files"]
    for path, inside in bundle.blocks.items():
        if not observed.takes(path):
            continue
        before = observed.files.get(known.get(path, ""))
        if before is None:
            yield Step(Kind.BLOCK, path, "new")
        elif before["sha256"] != files[inside]["sha256"]:
            yield Step(Kind.BLOCK, path, f"{inside} changes")
        elif path in observed.blocks:
            yield Step(Kind.BLOCK, path, f"its block {_DRIFT[observed.blocks[path]]}")
    for path in {**known, **observed.blocks}:
        if path not in bundle.blocks and observed.takes(path):
            yield Step(Kind.BLOCK, path, "no longer part of the spec")


def _reload_steps(
    bundle: Bundle, observed: Observed, files: list[Step], system: list[Step]
) -> Iterator[Step]:
    """Reloads a daemon if one of its files changed."""
    shown = {inside: path for path, inside in bundle.links.items() if observed.takes(path)}
    changed = {step.target: step.target for step in system}
    changed |= {shown[step.target]: step.target for step in files if step.target in shown}
    for reader, folder in READERS.items():
        because = next((cause for path, cause in changed.items() if path.startswith(folder)), "")
        if because:
            yield Step(Kind.RELOAD, reader, f"{because} changes")


def _unit_steps(bundle: Bundle, observed: Observed) -> Iterator[Step]:
    optional = {unit.name: [package(one) for one in unit.packages] for unit in bundle.units if unit.packages}
    in_trials = {unit.name for unit in bundle.units if unit.in_trials}
    complete = {name for name, packages in optional.items() if not _absent(packages, observed)}
    before, wanted = observed.unit_digests, {unit["name"]: unit for unit in bundle.manifest["units"]}
    deployed = observed.manifest["units"] if observed.manifest else ()
    fixed = {unit["name"]: unit["fixed"] for unit in deployed if "fixed" in unit}
    changed = {
        unit.name: [one for one in unit.secrets if observed.secrets.get(one) in _SECRETS]
        for unit in bundle.units
    }
    for name in reversed(tuple(before)):
        if name not in wanted:
            yield Step(Kind.STOP, name, "no longer part of the spec")
    for name, unit in wanted.items():
        state = None if name in in_trials else observed.units.get(name)  # started by no deploy
        damaged = [path for path in unit["needs"] if path in observed.drift]
        if name not in before:
            yield Step(Kind.START, name, "new")
        elif secrets := changed.get(name):
            yield Step(Kind.RESTART, name, f"the secret {secrets[0]} changes")
        elif before[name] != unit["digest"]:
            cause = _changed_needs(unit["needs"], bundle, observed)
            if fixed.get(name, "") == unit.get("fixed") and state is not None and state.up and not damaged:
                yield Step(Kind.RELOAD_UNIT, name, f"{cause}, and it takes that while it runs")
            else:
                yield Step(Kind.RESTART, name, cause)
        elif damaged:
            yield Step(Kind.RESTART, name, f"{damaged[0]} {_DRIFT[observed.drift[damaged[0]]]}")
        elif state is not None and not state.up and not state.skipped:
            yield Step(Kind.START, name, f"is {state.active}")
        elif name in complete and state is not None and state.skipped:
            yield Step(Kind.START, name, "the host now has its ROS packages")
        elif name not in optional and state is not None and state.skipped and not state.unmet:
            yield Step(Kind.START, name, "its conditions are met now")


def _changed_needs(needs: list[str], bundle: Bundle, observed: Observed) -> str:
    digests = {file.path: file.digest for file in bundle.files}
    known = {path: file["sha256"] for path, file in observed.files.items()}
    changed = [path for path in needs if known.get(path) != digests[path]]
    if not changed:
        return "it needs a different set of files"
    return f"{changed[0]} changes" + (f", and {len(changed) - 1} more" if len(changed) > 1 else "")


def _diffs(bundle: Bundle, observed: Observed) -> dict[str, str]:
    """Unified diffs of the files that change; none for a file whose content the host did not send."""
    diffs: dict[str, str] = {}
    wanted = {file.path: file for file in bundle.files}
    for path in sorted({*wanted, *observed.files}):
        old_known = observed.files.get(path)
        new = wanted[path].content.decode("utf-8", "replace") if path in wanted else ""
        if old_known is not None and path not in observed.contents:
            continue
        old = observed.contents.get(path, "")
        if old != new:
            diffs[path] = "".join(
                difflib.unified_diff(
                    old.splitlines(keepends=True),
                    new.splitlines(keepends=True),
                    f"{bundle.host}:{path}" if old_known is not None else "/dev/null",
                    f"spec:{path}" if path in wanted else "/dev/null",
                )
            )
    return diffs


def _notes(bundle: Bundle, observed: Observed) -> tuple[str, ...]:
    optional = {unit.name: unit for unit in bundle.units if unit.packages}
    skipped = [
        (name, unit_faults.unmet_conditions(bundle.host, name, state.unmet))
        for name, state in observed.units.items()
        if state.skipped and state.unmet and name not in optional
        if not unit_faults.waits_for_trial(name, state.unmet)
    ]
    edited = observed_host.lost(bundle, observed)
    return (
        *([f"{edited}; {observed_host.hint(bundle.swarm)}"] if edited else []),
        *(f"{name} is skipped: {why}; {repair}" for name, (why, repair) in skipped),
        *(
            f"program `{unit.program}` is skipped: the host lacks {in_words(absent)}; "
            + _install_hint(bundle, absent)
            for unit in optional.values()
            if (absent := _absent(map(package, unit.packages), observed))
        ),
        *preflight.notes(bundle, observed),
        *(bundle.by_hand if observed.digest != bundle.digest else ()),
    )


def _absent(requirements: Iterable[str], observed: Observed) -> list[str]:
    """The requirements that the host lacks; none if it was not contacted."""
    return [one for one in requirements if not observed.facts.has.get(one)] if observed.facts else []


def _unfit(bundle: Bundle, observed: Observed) -> Problem | None:
    """Why this host cannot run its part of the swarm."""
    facts = observed.facts
    if bundle.unbuilt:
        names = ", ".join(bundle.unbuilt)
        message = f"{names} {'are' if len(bundle.unbuilt) > 1 else 'is'} not built for it"
        return Problem(preflight.UNFIT, message, "`swarmctl prepare` builds and keeps it")
    if bundle.unsigned:
        message = f"the permissions of {', '.join(bundle.unsigned)} are not signed as the spec has them"
        return Problem(preflight.UNFIT, message, "`swarmctl keys` signs them")
    if bundle.unpinned:
        message = f"the WireGuard keys of {', '.join(bundle.unpinned)} are not pinned"
        return Problem(preflight.UNFIT, message, "`swarmctl trust` pins them")
    if not facts:  # the host was not contacted
        return None
    if problem := preflight.unusable(facts):
        return problem
    for file in bundle.files:
        machines = machines_of(file.content)
        if machines and facts.machine not in machines:
            message = f"its machine is {facts.machine}, and {file.path} is compiled for {machines[0]}"
            hint = f"build {file.origin or 'it'} for {facts.machine}"
            return Problem(preflight.UNFIT, message, hint)
    if bundle.platform and (platform := facts.platform or bundle.platform) != bundle.platform:
        message = f"it is {platform}, and its packages are built for {bundle.platform}"
        return Problem(preflight.UNFIT, message, "`swarmctl prepare` builds them for it")
    if missing := _absent(bundle.requires, observed):
        hint = f"{preflight.PREPARE_INSTALLS}; by hand: {_install_hint(bundle, missing)}"
        return Problem(preflight.UNFIT, f"it lacks {in_words(missing)}", hint)
    return preflight.without_secret(bundle, observed)


def _install_hint(bundle: Bundle, missing: Sequence[str]) -> str:
    return "; ".join(install_hints(bundle.distro, missing))
