"""The state of a host before a change: the release it runs, and how its files and units differ from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from swarm_onboard.agent.messages import BlockDrift, FileDrift, LinkDrift, SecretState
from swarm_onboard.agent.paths import ROOT
from swarm_onboard.agent.record import REMOVING

from swarmctl.adoption.changes import EditedFile
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.render.bundle import Bundle
from swarmctl.render.manifest import FileData, ManifestData
from swarmctl.render.rendered_values import same_meaning

if TYPE_CHECKING:
    from swarm_onboard.agent.deployed import Transaction
    from swarm_onboard.agent.host_list import HostListState
    from swarm_onboard.agent.systemd import UnitState
    from swarm_onboard.agent.verbs import observe
    from swarm_onboard.agent.verbs.observe import Facts


@dataclass(frozen=True)
class Observed:
    """One host before a change. ``manifest`` is that of the release it runs, as ``Bundle.manifest`` wrote it.

    ``drift``, ``links`` and ``blocks`` have by path how the host differs from that manifest. ``secrets``
    has by name how the stored value compares with the operator's; without one ``kept`` or ``missing``.
    ``facts`` is None for a host that was not contacted. ``busy``: why robots must not be touched;
    ``uploaded``: digests of the files that an upload which ended early has left; ``edits``: of what people
    have edited on the host, by path; ``edit_texts``: those texts, as far as the host sent them;
    ``clock_ahead``: s by which its clock is ahead of this machine's; ``foreign_units``: named as units of the
    swarm, and of no release; ``host_list``: its list of the swarm's hosts; ``unknown_keys``: hosts of which
    it does not know a WireGuard key, or not that it is retired.
    """

    digest: str | None = None
    manifest: ManifestData | None = None
    drift: Mapping[str, FileDrift] = field(default_factory=dict)
    links: Mapping[str, LinkDrift] = field(default_factory=dict)
    blocks: Mapping[str, BlockDrift] = field(default_factory=dict)
    units: Mapping[str, UnitState] = field(default_factory=dict)
    contents: Mapping[str, str] = field(default_factory=dict)
    transaction: Transaction | None = None
    secrets: Mapping[str, SecretState] = field(default_factory=dict)
    facts: Facts | None = None
    busy: Mapping[str, str] = field(default_factory=dict)
    uploaded: frozenset[str] = frozenset()
    edits: Mapping[str, str] = field(default_factory=dict)
    edit_texts: Mapping[str, str] = field(default_factory=dict)
    clock_ahead: float = 0.0
    foreign_units: tuple[str, ...] = ()
    host_list: HostListState | None = None
    unknown_keys: tuple[str, ...] = ()

    @property
    def last_txid(self) -> str:
        """The name of the last change; empty if there was none."""
        return self.transaction.txid if self.transaction else ""

    @property
    def unfinished(self) -> str:
        """The change that was interrupted, or waits for its confirmation; empty if there is none."""
        last = self.transaction
        if last is None or last.state in ("", "applied", "undone"):
            return ""
        who = last.who or "someone"
        if last.state == REMOVING:
            return f"the removal of the swarm is not finished, by {who}"
        releases = f"{last.previous or 'nothing'} -> {last.next or 'nothing'}"
        return f"an earlier deploy was interrupted: {releases} by {who}"

    @property
    def files(self) -> Mapping[str, FileData]:
        """The files of the deployed release, by path; empty without a release."""
        return self.manifest["files"] if self.manifest else {}

    @property
    def unit_digests(self) -> Mapping[str, str]:
        """The digests of the deployed units, by name; empty without a release."""
        units = self.manifest["units"] if self.manifest else ()
        return {unit["name"]: unit["digest"] for unit in units}

    @property
    def kept(self) -> frozenset[str]:
        """The digests of the host's intact files, deployed or ``uploaded``: these need not be sent."""
        deployed = (file["sha256"] for path, file in self.files.items() if path not in self.drift)
        return self.uploaded.union(deployed)

    def takes(self, path: str) -> bool:
        """Returns True if the host has the program, if any, to which the place of ``path`` belongs."""
        absent = self.facts.absent if self.facts else ()
        return not any(path == place or path.startswith(f"{place}/") for place in absent)


NOTHING = Observed()


def from_answer(answer: observe.Answer, bundle: Bundle, *, received: float) -> Observed:
    """Returns the agent's answer to ``observe``, which came when this machine's clock was ``received``.

    It leaves the manifest out when the host runs ``bundle`` already.
    """
    return Observed(
        digest=answer.release,
        manifest=bundle.manifest if answer.release == bundle.digest else answer.manifest,
        drift=answer.drift.files,
        links=answer.drift.links,
        blocks=answer.drift.blocks,
        units=answer.units,
        contents=answer.files,
        transaction=answer.transaction,
        secrets=answer.secrets,
        facts=answer.facts,
        busy=answer.busy,
        uploaded=frozenset(answer.uploaded),
        edits=answer.edits,
        edit_texts=answer.edit_texts,
        clock_ahead=answer.facts.time - received,
        foreign_units=tuple(answer.foreign_units),
        host_list=answer.host_list,
        unknown_keys=tuple(answer.wireguard_keys),
    )


EDITED = "edited"
_SHOWN = 3


def lost(bundle: Bundle, observed: Observed) -> str:
    """Returns which edits on the host the bundle would replace with other content, as text; empty if none."""
    paths = _paths(bundle, observed)
    if not paths:
        return ""
    more = f" and {len(paths) - _SHOWN} more" if len(paths) > _SHOWN else ""
    return f"{', '.join(paths[:_SHOWN])}{more} {'was' if len(paths) == 1 else 'were'} edited on the host"


def edited_files(bundle: Bundle, observed: Observed) -> list[EditedFile]:
    """Returns those edits as files of the release."""
    return [
        EditedFile(
            bundle.host,
            inside := bundle.blocks.get(path, path),
            path,
            observed.edit_texts.get(path),
            observed.files[inside]["sha256"] if inside in observed.files else "",
        )
        for path in _paths(bundle, observed)
    ]


def _paths(bundle: Bundle, observed: Observed) -> list[str]:
    """The edited files and blocks that the bundle would replace with what means something else."""
    wanted = {file.path: file for file in bundle.files}
    wanted |= {path: wanted[inside] for path, inside in bundle.blocks.items()}

    def is_lost(path: str, digest: str) -> bool:
        file, text = wanted.get(path), observed.edit_texts.get(path)
        if file is None or text is None or file.digest == digest:
            return file is None or file.digest != digest
        return not same_meaning(path, text, file.content.decode("utf-8", "replace"))

    return [path for path, digest in observed.edits.items() if is_lost(path, digest)]


def not_edited(plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
    """Returns the plan, with a problem if it would replace an edit with other content."""
    text = lost(bundle, observed) if plan.steps else ""
    return replace(plan, problem=Problem(EDITED, text, hint(bundle.swarm))) if text else plan


NEWER = "newer"


def not_newer(plan: HostPlan, observed: Observed, issued: float) -> HostPlan:
    """Returns the plan, with a problem if the host has another release, which was chosen after ``issued``."""
    last = observed.transaction
    if last is None or observed.digest in (None, plan.next) or last.chosen <= issued:
        return plan
    text = f"release {observed.digest} was deployed later, by {last.who or 'someone'}"
    return replace(
        plan, problem=Problem(NEWER, text, "deploy again if this spec is what the swarm should have")
    )


def hint(swarm: str) -> str:
    """Returns what to do about an edit on a host."""
    return (
        "`swarmctl adopt` shows it as a change of the spec, and `deploy --adopt` makes that first; "
        f"`deploy --overwrite-edits` replaces it, with a copy in {ROOT}/{swarm}/state/edits"
    )
