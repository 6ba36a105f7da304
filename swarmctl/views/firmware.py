"""Firmwares as text: a build, the steps of a flash, its result."""

from __future__ import annotations

import shlex

from rich.text import Text

from swarmctl.deploy.flash import PATIENCE, Flashed, Job
from swarmctl.firmware.compiler import FLASH, RAM, Built
from swarmctl.remote.transport import HostError
from swarmctl.render.bundle import ROOT
from swarmctl.views.escape import printable


def built(robot: str, digest: str, one: Built) -> str:
    """A firmware, and its use of the board's flash and RAM."""
    return (
        f"{robot}: {one.hex}, firmware {digest}\n"
        f"  flash {one.flash} of {FLASH} B ({one.flash / FLASH:.0%})\n"
        f"  RAM   {one.data} of {RAM} B ({one.data / RAM:.0%}), without the stack"
    )


def steps(job: Job, login: str) -> str:
    """The steps of a flash on a host, in order. ``login``: account and address."""
    folder = f"{ROOT}/{job.swarm}/state/firmware"
    sizes = [f"{folder}/{name} ({len(content)} B)" for name, content in job.writing.files.items()]
    done = [
        ("copy", sizes[0]),
        *(("", size) for size in sizes[1:]),
        ("stop", f"{job.unit}, if it runs"),
        ("run", shlex.join(job.writing.command)),
        ("start", f"{job.unit}, if it ran, also after an error"),
        ("check", f"avrdude: the board at {job.port} contains the firmware"),
        ("", f"{job.unit}: the board reports `swarmctl firmware {job.digest}` within {PATIENCE:g} s"),
    ]
    return "\n".join([f"{job.robot}, on {login}:", *(f"  {verb:<5}  {what}" for verb, what in done)])


def verdict(job: Job, result: Flashed | HostError) -> Text:
    """The result for one board, and how to fix an error."""
    name = (job.robot, "bold")
    if isinstance(result, HostError):
        return _trouble(job, result.kind.value, printable(result.message), printable(result.hint))
    if result.reported:
        return Text.assemble(name, "  ", ("runs", "bold green"), f" firmware {job.digest}")
    if not result.runs:
        note = f" firmware {job.digest}; {job.unit} is not running, so the board's report was not checked"
        return Text.assemble(name, "  ", ("holds", "bold green"), note)
    silent = f"the board was written and read back, but {job.unit} has received nothing from it since"
    return _trouble(job, "silent", silent, f"on {job.host}: sudo journalctl -u {job.unit}")


def _trouble(job: Job, kind: str, message: str, hint: str) -> Text:
    text = Text.assemble((job.robot, "bold"), "  ", (kind, "bold red"), f": {job.host}: {message}")
    return text.append_text(Text.assemble("\n", ("  help", "bold green"), f": {hint}")) if hint else text
