"""What an experiment starts with its trials."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.swarm.shipped_programs import INTERACTIVE


@rule("EXP001")
def programs_of_people(context: RuleContext) -> Iterator[Diagnostic]:
    """A program in an experiment that only a person starts."""
    for name, experiment in context.spec.experiments.items():
        for place, one in enumerate(experiment.programs):
            program = context.spec.programs[one]
            if program.use in INTERACTIVE or program.lifecycle == "interactive":
                yield Diagnostic(
                    "EXP001",
                    f"experiment `{name}` starts `{one}`, which only a person starts",
                    context.span("experiments", name, "programs", place),
                    label="not started by a trial",
                    notes=(Note(context.span("programs", one, "lifecycle", "use"), "it needs a terminal"),),
                    help=("remove it, and start it by hand before the trials, or make it a service",),
                )
