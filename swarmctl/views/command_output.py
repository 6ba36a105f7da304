"""What a command printed on hosts: equal output once, in the order of the spec."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from rich.text import Text

from swarmctl.remote.host_commands import MARK, Ran
from swarmctl.views.equal_hosts import grouped
from swarmctl.views.escape import printable
from swarmctl.yamltext import hostlist

_INDENT = "    "


def results(found: Sequence[Ran], complete: Callable[[str], str]) -> Text:
    """Returns the output by host; hosts with equal output and exit code stand together.

    ``complete`` completes the commands in a hint.
    """
    equal = grouped(found, lambda one: (one.status, one.stdout, one.stderr, one.error and one.host))
    return Text("\n").join([line for group in equal for line in _group(group, complete)])


def followed(host: str, line: str) -> Text:
    """Returns one line of a host, as it comes; one of standard error begins with ``MARK``."""
    return Text.assemble((f"{host}: ", "bold"), (printable(line), "red" if line.startswith(MARK) else ""))


def _group(group: Sequence[Ran], complete: Callable[[str], str]) -> Iterator[Text]:
    one = group[0]
    hosts = f" ({len(group)} hosts)" if len(group) > 1 else ""
    ending = f", exit code {one.status}" if one.status else ", cut off" if one.error and _lines(one) else ""
    if one.status is not None or ending:
        title = f"{hostlist.written(each.host for each in group)}{hosts}"
        yield Text.assemble((title, "bold"), (ending, "red"))
        yield from _lines(one)
    if one.error is not None:
        message = printable(one.error.message.removeprefix(f"{one.host}: "))
        yield Text.assemble((one.host, "bold"), ("  ", ""), (f"{one.error.kind.value}: {message}", "red"))
        if one.error.hint:
            yield Text(f"  help: {printable(complete(one.error.hint))}")


def _lines(one: Ran) -> list[Text]:
    out = [Text(f"{_INDENT}{line}") for line in _printable(one.stdout)]
    return [*out, *(Text(f"{_INDENT}{MARK}{line}", "red") for line in _printable(one.stderr))]


def _printable(output: bytes) -> list[str]:
    text = output.decode("utf-8", "replace").removesuffix("\n")
    return [printable(line.removesuffix("\r")) for line in text.split("\n")] if text else []
