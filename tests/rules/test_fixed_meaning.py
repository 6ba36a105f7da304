"""A spec that safe fixes make valid means what the original meant: it renders the same bytes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

from swarmctl.diagnostics import has_errors
from swarmctl.linter.fixes import Findings, Texts, fixable
from swarmctl.render.build_bundle import bundles
from swarmctl.spec.load import load
from swarmctl.swarm.resolve import resolve
from swarmctl.yamltext.files import Read, content
from tests import ROOT
from tests.loading import lint_files
from tests.mutations.text_mutations import Mutation, mutations

EXAMPLES = sorted(ROOT.glob("examples/*/swarm.yaml"))
SEED, MOST = 11, 3
ENOUGH = 300  # mutations of all examples together
FLOOR = 0.85  # of those that make a spec invalid, how many are corrected without a guess


def mutations_of(spec: Path) -> list[Mutation]:
    return list(mutations(spec.read_text("utf-8"), SEED, MOST))


@cache
def original(spec: Path) -> object:
    return rendered(spec, {})


def reader(texts: Texts) -> Read:
    """Reads files as they are, but for some texts."""
    changed = {Path(file): text.encode() for file, text in texts.items()}
    return lambda path: changed[path] if path in changed else content(path)


def rendered(spec: Path, texts: Texts) -> object:
    document, _ = load((spec,), reader(texts))
    assert document is not None
    return bundles(resolve(document))


def corrected(spec: Path, mutation: Mutation) -> bool | None:
    """Whether safe fixes make a mutation valid; None if it is valid without any."""

    def found_with(texts: Texts) -> Findings:
        return lint_files([spec], reader({str(spec): mutation.text, **texts}))

    before = found_with({})
    safe = fixable(found_with, lambda _: mutation.text).safe
    if not safe.made:
        return False if has_errors(before.diagnostics) else None
    if has_errors(found_with(safe.texts).diagnostics):
        return False
    if set(safe.texts.items()) != {(str(spec), spec.read_text("utf-8"))}:  # the original renders as itself
        assert rendered(spec, safe.texts) == original(spec), f"{mutation.kind}: {mutation.what}"
    return True if has_errors(before.diagnostics) else None


@pytest.mark.parametrize("spec", EXAMPLES, ids=lambda spec: spec.parent.name)
@pytest.mark.slow
def test_a_spec_made_valid_renders_what_the_original_renders(spec: Path) -> None:
    outcomes = [(one.kind, one.what, corrected(spec, one)) for one in mutations_of(spec)]
    wrong = [one for one in outcomes if one[2] is not None]
    left = [f"{kind}: {what}" for kind, what, done in wrong if not done]
    rate = 1 - len(left) / len(wrong)
    assert rate >= FLOOR, f"{rate:.0%} of {len(wrong)} corrected; not: " + "; ".join(left)


def test_there_are_many_mutations() -> None:
    assert sum(len(mutations_of(spec)) for spec in EXAMPLES) >= ENOUGH
