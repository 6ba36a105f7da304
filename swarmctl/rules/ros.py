"""The keys of `ros`: those that the middleware reads, and the hosts that they name."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic, Note
from swarmctl.linter.context import RuleContext, rule
from swarmctl.plugins import MIDDLEWARES
from swarmctl.render.middleware import middleware_of
from swarmctl.yamltext.edits import make_fix, remove


@rule("ROS001")
def unused_settings(context: RuleContext) -> Iterator[Diagnostic]:
    """Settings that the middleware does not read."""
    ros = context.spec.ros
    for key in type(ros).model_fields:
        if key in ros.model_fields_set and key not in {"distro", *context.middleware.settings}:
            others = [name for name in MIDDLEWARES if key in middleware_of(name).settings]
            named = " or ".join(f"`distro: {name}`" for name in others)
            yield Diagnostic(
                "ROS001",
                f"`{ros.distro}` does not use `{key}`",
                context.span("ros", key, key=True),
                label="has no effect",
                notes=(Note(context.span("ros", "distro"), "the distribution"),)
                if "distro" in ros.model_fields_set
                else (),
                help=(f"remove it, or write {named}" if named else "remove it",),
                fix=make_fix(f"remove `{key}`", remove(context.source, ("ros", key)), safe=not others),
            )


@rule("ROS002")
def servers_outside(context: RuleContext) -> Iterator[Diagnostic]:
    """A host that is to run a discovery server, and runs no ROS."""
    if "servers" not in context.middleware.settings:
        return
    for number, host in enumerate(context.spec.ros.servers):
        loc = ("ros", "servers", number)
        if host not in context.home:
            yield Diagnostic(
                "ROS002",
                f"`{host}` is to run a discovery server, and runs no ROS",
                context.span(*loc),
                label="belongs to no island",
                help=(f"name one of: {', '.join(f'`{one}`' for one in context.home)}",)
                if context.home
                else (),
                fix=make_fix(f"remove `{host}`", remove(context.source, loc), safe=False),
            )


@rule("ROS003")
def undelivered_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """Packages beside the spec that this distribution cannot build."""
    distro = context.spec.ros.distro
    if "catkin" not in context.middleware.capabilities:
        for name in context.spec.packages:
            yield Diagnostic(
                "ROS003",
                f"package `{name}` is not delivered: swarmctl builds none of `{distro}`",
                context.span("packages", name, key=True),
                label="stays where it is",
                help=("build it in a workspace on its hosts, and name that as `ros.workspace`",),
            )
