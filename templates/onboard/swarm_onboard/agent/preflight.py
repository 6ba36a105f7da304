"""The state of a host beside ROS: installed programs, the clock, wireless interfaces."""

from __future__ import annotations

import os

from .texts import is_name

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Callable, Iterable, Literal

    Outside = Callable[[str], str]

_FOLDERS = ("/usr/sbin", "/usr/bin", "/sbin", "/bin")
_CAP_SYS_TIME = 1 << 25  # linux/capability.h
_TIME_ERROR = 5  # adjtimex(2): the clock is not synchronised


def found(wants: Iterable[str], outside: Outside) -> dict[str, str | None]:
    """Where each wanted program lies; whoever logs in may have no `sbin` in the search path."""
    names = [name for name in wants if is_name(name, "._-", 61)]
    return {name: _program(name, outside) for name in names}


def power_save(iw: str | None, outside: Outside) -> dict[str, str]:
    """Returns whether each wireless interface has power saving `on` or `off`; ``iw``: the program."""
    return {name: _power_save(iw, name) for name in wireless(outside)}


def _program(name: str, outside: Outside) -> str | None:
    places = (f"{folder}/{name}" for folder in _FOLDERS)
    return next((place for place in places if os.access(outside(place), os.X_OK)), None)


def clock() -> Literal["follows", "alone", "borrowed"]:
    """Returns whether the clock ``follows`` another one or goes ``alone``.

    ``borrowed``: it is a container's, which cannot set it.
    """
    with open("/proc/self/status", encoding="ascii", errors="replace") as file:
        lines = dict(line.split(":", 1) for line in file if ":" in line)
    if not int(lines["CapEff"], 16) & _CAP_SYS_TIME:
        return "borrowed"
    import ctypes  # noqa: PLC0415  (takes long to load, and few need it)

    # The state is what the call returns; the struct, which differs between machines, is not looked into.
    state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(512))
    return "alone" if state == _TIME_ERROR else "follows"


def wireless(outside: Outside) -> list[str]:
    """Returns the wireless interfaces: those with a radio."""
    folder = outside("/sys/class/net")
    try:
        names = sorted(os.listdir(folder))
    except FileNotFoundError:
        return []
    return [name for name in names if os.path.exists(f"{folder}/{name}/phy80211")]


def _power_save(iw: str | None, interface: str) -> str:
    """Returns ``on``, ``off``, or empty text if it cannot be read."""
    if iw is None:
        return ""
    from . import command  # noqa: PLC0415  (takes long to load, and few hosts have a radio that swarmctl sets)

    output = command.output_of([iw, "dev", interface, "get", "power_save"], 3)
    return next((state for state in ("on", "off") if f"Power save: {state}" in output), "")
