"""The packages that a spec delivers can be delivered."""

from __future__ import annotations

from collections.abc import Iterator

from swarmctl.diagnostics import Diagnostic
from swarmctl.ros_packages.builds import with_dependencies
from swarmctl.rules.context import RuleContext, rule


@rule("PKG017", ros1=True)
def delivered_packages(context: RuleContext) -> Iterator[Diagnostic]:
    """A package under `packages` that cannot travel with a release."""
    for name, reason in context.document.packages.refused.items():
        source = context.spec.packages[name]
        if "catkin refuses" in reason:
            help_ = "correct the file: where catkin refuses one package, `rosrun` and `roslaunch` find none"
        elif source.all:
            help_ = "every folder with a package.xml in it is delivered; docs/hosts.md has the limits"
        elif "package.xml" in reason:
            help_ = f"name the folder of {name} alone; for a folder of several packages add `all: true`"
        else:
            help_ = f"name the folder in which the package.xml of {name} lies"
        yield Diagnostic(
            "PKG017",
            f"`{source.folder}` {reason}",
            context.span("packages", name, "from"),
            help=(help_,),
        )


@rule("PKG018", ros1=True)
def unbuildable(context: RuleContext) -> Iterator[Diagnostic]:
    """A package that has to be built, in a spec that names no builder."""
    if context.spec.ros.builders:
        return
    first = next(iter(context.spec.hosts))
    delivered = context.document.packages.delivered
    drivers = (driver.packages for driver in context.ros_drivers.values())
    programs = ((one.package or "", *one.requires) for one in context.spec.programs.values())
    used = with_dependencies((name for names in (*drivers, *programs) for name in names), delivered)
    of_workspaces = {one.name for one in used}
    for name, package in delivered.items():
        if package.built_by and (not package.entry or name in of_workspaces):
            yield Diagnostic(
                "PKG018",
                f"`{name}` has to be built ({package.built_by} in its CMakeLists.txt), and no host builds",
                context.span("packages", package.entry or name, key=True),
                help=(f"name a host that builds for those of its kind: ros: {{builders: [{first}]}}",),
            )
