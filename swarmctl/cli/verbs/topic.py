"""``swarmctl topic``: a tool for topics, on a host of the island that has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import console, exit_codes, next_command, options
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.remote.host_commands import Ran
    from swarmctl.remote.transport import HostError
    from swarmctl.render.topic_tool import Listed
    from swarmctl.swarm.resolved import Swarm

topic = typer.Typer(
    name="topic", no_args_is_help=True,
    help="List, show, measure and publish topics, on the hosts.",
)  # fmt: skip

_CODES = exit_codes.epilog(exit_codes.HOSTS_FAILED, exit_codes.HOSTS_UNREACHABLE)
Topic = Annotated[str, typer.Argument(metavar="TOPIC", help="Its full name, such as /k3/odom.")]
IslandName = Annotated[
    str,
    typer.Option(
        "--island", metavar="NAME", help="The island, if the topic is in no robot's namespace."
    ),
]  # fmt: skip
HostName = Annotated[
    str, typer.Option("--host", metavar="HOST", help="This host of the island instead of its hub.")
]


@topic.command("list", epilog=_CODES)
@with_where()
def list_(
    where: Where,
    json: options.Json = False,
) -> None:
    """List the topics of all islands, with their types and how many nodes publish and subscribe."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.cli.topic_host import error_of
    from swarmctl.remote import host_commands
    from swarmctl.remote.parallel_hosts import Finished
    from swarmctl.render.middleware import middleware_of
    from swarmctl.render.topic_tool import listed
    from swarmctl.views import tables as view

    swarm = console.read_spec(where.spec)
    targets = where.targets(swarm)
    names = {one.hub: one.name for one in swarm.islands}
    outcomes: dict[str, Ran] = {}
    failed: dict[str, HostError] = {}
    for distro in swarm.distros:
        hubs = [one.hub for one in swarm.islands if one.distro == distro]
        middleware = middleware_of(distro)
        line = middleware.topic_tool.line(swarm.name, middleware.topic_tool.list())
        for event in host_commands.run(
            [targets[hub] for hub in hubs], line, transport(become=False), parallel=options.PARALLEL
        ):
            if isinstance(event, Finished):
                ran = outcomes[event.host] = host_commands.ran(event)
                if error := error_of(ran, swarm.name, middleware):
                    failed[event.host] = error
    errors = {name: failed[hub] for hub, name in names.items() if hub in failed}
    found = {
        name: tuple(listed(outcomes[hub].stdout.decode("utf-8", "replace")))
        for hub, name in names.items()
        if name not in errors
    }
    if json:
        console.print_json({"v": 1, "swarm": swarm.name, **_document(found, errors)})
    elif found:
        console.out().print(view.topic_table(found))
    for error in errors.values():
        console.show(f"{error.kind.value}: {error.message}", error=True)
        if error.hint:
            console.show(f"  help: {where.complete(error.hint)}", error=True)
    away = {hub: errors[name] for hub, name in names.items() if name in errors}
    if not json and not where.advise_doctor(away) and (one := _published(swarm, found)):
        next_command.advise("topic echo", where.spec, one, *where.options)
    if errors:
        reached = any(error.reached for error in errors.values())
        raise typer.Exit(exit_codes.HOSTS_FAILED if reached else exit_codes.HOSTS_UNREACHABLE)


@topic.command(epilog=_CODES)
@with_where()
def echo(
    where: Where,
    topic: Topic,
    messages: Annotated[
        int | None, typer.Option("-n", min=1, metavar="N", help="End after N messages.")
    ] = None,
    island: IslandName = "",
    host: HostName = "",
) -> None:
    """Print the messages of a topic as they come, until Ctrl-C."""
    from swarmctl.cli.topic_host import TopicHost

    run = TopicHost(where, topic, island, host)
    run.exit(run.middleware.topic_tool.echo(run.topic), messages=messages)


@topic.command(epilog=_CODES)
@with_where()
def hz(
    where: Where,
    topic: Topic,
    island: IslandName = "",
    host: HostName = "",
) -> None:
    """Print every second at which rate the messages of a topic arrive on the host, until Ctrl-C."""
    from swarmctl.cli.topic_host import TopicHost

    run = TopicHost(where, topic, island, host)
    run.exit(run.middleware.topic_tool.hz(run.topic))


@topic.command(epilog=_CODES)
@with_where()
def pub(
    where: Where,
    topic: Topic,
    kind: Annotated[
        str, typer.Argument(metavar="TYPE", help="The message type, such as geometry_msgs/Twist.")
    ],
    values: Annotated[str, typer.Argument(metavar="YAML", help="The message, such as '{linear: {x: 0.1}}'.")],
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", min=0.01, help="Messages per second.")
    ] = None,
    once: Annotated[bool, typer.Option("--once", help="One message, then end.")] = False,
    island: IslandName = "",
    host: HostName = "",
) -> None:
    """Publish messages, until Ctrl-C; without --rate or --once as ROS's own tool does.

    A robot obeys its commanders only. Whether the host may command it is printed before.
    """
    from swarmctl.cli.topic_host import TopicHost

    if rate is not None and once:
        console.fail("--rate and --once exclude each other", code=exit_codes.USAGE)
    run = TopicHost(where, topic, island, host)
    run.say_who_commands()
    named = run.middleware.type_name(kind)
    words = run.middleware.topic_tool.pub(run.topic, named, values, rate=rate, once=once)
    run.exit(words)


def _published(swarm: Swarm, found: Mapping[str, Sequence[Listed]]) -> str:
    """A topic of a robot that is published on its island; empty without one that a terminal can show."""
    for robot in swarm.robots.values():
        for one in found.get(swarm.island_of(robot.host).name, ()):
            named = one.topic.startswith(f"{robot.namespace}/") and one.topic.isprintable()
            if named and one.publishers:
                return one.topic
    return ""


def _document(found: Mapping[str, Sequence[Listed]], errors: Mapping[str, HostError]) -> dict[str, Any]:
    """What ``list --json`` prints: the topics by island, and the error of each island that has none."""
    topics: dict[str, list[dict[str, Any]]] = {}
    for island, listed in found.items():
        for one in listed:
            entry = {"island": island, **asdict(one)}
            topics.setdefault(entry.pop("topic"), []).append(entry)
    return {
        "topics": [{"topic": name, "islands": topics[name]} for name in sorted(topics)],
        "errors": [{"island": island, **one.to_json()} for island, one in errors.items()],
    }
