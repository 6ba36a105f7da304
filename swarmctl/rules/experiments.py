"""What an experiment starts with its trials, varies and judges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.suggest import did_you_mean
from swarmctl.swarm.shipped_programs import INTERACTIVE
from swarmctl.yamltext.source import Loc

WITH_POSES = (
    "nav_msgs/Odometry",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/Pose",
    "geometry_msgs/Pose2D",
)


@rule("EXP001")
def programs_of_people(context: RuleContext) -> Iterator[Diagnostic]:
    """A program in an experiment that only a person starts."""
    for name, experiment in context.spec.experiments.items():
        for place, one in enumerate(experiment.programs):
            program = context.spec.programs[one]
            if program.use in INTERACTIVE or program.lifecycle == "interactive":
                instead = "" if program.use else ", or write `lifecycle: trial`"
                yield Diagnostic(
                    "EXP001",
                    f"experiment `{name}` starts `{one}`, which only a person starts",
                    context.span("experiments", name, "programs", place),
                    label="not started by a trial",
                    notes=(Note(context.span("programs", one, "lifecycle", "use"), "it needs a terminal"),),
                    help=(f"remove it, and start it by hand before the trials{instead}",),
                )


@rule("EXP005", "EXP006")
def programs_of_trials(context: RuleContext) -> Iterator[Diagnostic]:
    """A program of `reset` that runs outside of trials, too; one of trials that no experiment starts."""
    started: set[str] = set()
    for name, experiment in context.spec.experiments.items():
        started.update(experiment.programs)
        if (reset := experiment.reset) is None:
            continue
        started.add(reset)
        if (lifecycle := context.spec.programs[reset].lifecycle) != "trial":
            yield Diagnostic(
                "EXP005",
                f"experiment `{name}` resets the robots by `{reset}`, which runs outside of its trials, too",
                context.span("experiments", name, "reset"),
                notes=(Note(context.span("programs", reset, "lifecycle"), f"a {lifecycle}"),),
                help=(f"write `lifecycle: trial` in program `{reset}`",),
            )
    for name, program in context.spec.programs.items():
        if program.lifecycle == "trial" and name not in started:
            yield Diagnostic(
                "EXP006",
                f"program `{name}` never runs: no experiment has it under `programs` or `reset`",
                context.span("programs", name, "lifecycle"),
                label="runs in trials alone",
                help=("add it to `programs` of an experiment, or remove its `lifecycle`",),
            )


@rule("EXP002", "EXP004")
def criteria(context: RuleContext) -> Iterator[Diagnostic]:
    """A criterion whose topic has no poses, that nothing publishes, or that `success` does not record."""
    for name, experiment in context.spec.experiments.items():
        keys = (("until", experiment.until), ("success", experiment.success))
        for key, place, one in ((key, *each) for key, given in keys for each in enumerate(given)):
            topic = f"/{one.topic.strip('/')}"
            loc = ("experiments", name, key, place)
            types = set(context.publishers.of(topic).values())
            moves = next((part for part in ("reached", "distance") if getattr(one, part) is not None), None)
            recorded = any(fnmatchcase(topic, pattern) for pattern in experiment.record)
            if key == "success" and not recorded:
                yield Diagnostic(
                    "EXP002",
                    f"experiment `{name}` judges `{topic}`, which it does not record",
                    context.span(*loc, "topic"),
                    label="in no bag",
                    notes=(Note(context.span("experiments", name, "record"), "what is recorded"),),
                    help=(f'add "{topic}" to `record`',),
                )
            elif moves is not None and types and types.isdisjoint(WITH_POSES):
                yield Diagnostic(
                    "EXP002",
                    f"`{topic}` has no poses: its type is {min(types)}",
                    context.span(*loc, moves, key=True),
                    help=(f"name a topic of type {', '.join(WITH_POSES[:-1])} or {WITH_POSES[-1]}",),
                )
            elif not types:
                spaces = context.namespaces.items()
                known = [f"{space[1:]}/{own}" for robot, space in spaces for own in context.sensors_of(robot)]
                yield Diagnostic(
                    "EXP004",
                    f"nothing in the spec publishes `{topic}`",
                    context.span(*loc, "topic"),
                    label="no driver, and no `publishes` of a program",
                    help=did_you_mean(one.topic, known, "topics")
                    or ("add it to `publishes` of the program that publishes it",),
                )


@rule("EXP003")
def varied_parameters(context: RuleContext) -> Iterator[Diagnostic]:
    """A parameter with values for trials that its program does not have in the spec."""
    for name, experiment in context.spec.experiments.items():
        for program, varied in experiment.parameters.items():
            group, own = context.spec.programs[program].named_values
            yield from _mappings(context, ("experiments", name, "parameters", program), varied)
            for key in sorted(varied.keys() - own.keys()):
                yield Diagnostic(
                    "EXP003",
                    f"experiment `{name}` varies `{key}`, which program `{program}` does not have",
                    context.span("experiments", name, "parameters", program, key, key=True),
                    notes=(Note(context.span("programs", program, key=True), "the program"),),
                    help=(
                        *did_you_mean(key, own, f"its {group}"),
                        f"or add it to `{group}` of the program, with its value outside of the trials",
                    ),
                )


def _mappings(context: RuleContext, loc: Loc, varied: Mapping[str, Sequence[object]]) -> Iterator[Diagnostic]:
    for key, values in varied.items():
        for place, value in enumerate(values):
            if isinstance(value, Mapping):
                yield Diagnostic(
                    "EXP003",
                    f"a value of `{key}` is a mapping, of which a trial would replace single keys",
                    context.span(*loc, key, place),
                    label="not a value of its own",
                    help=("vary a single parameter, as a number, a text or a list",),
                )
