"""The machine that a compiled file is for, from its ELF header (elf.h)."""

from __future__ import annotations

_MAGIC = b"\x7fELF"
_BIG_ENDIAN = 2
#: ``e_machine`` -> what ``uname -m`` prints on hosts that run it.
_MACHINES = {
    3: ("i386", "i486", "i586", "i686", "x86_64"),
    40: ("armv6l", "armv7l", "armv8l"),
    62: ("x86_64",),
    183: ("aarch64",),
    243: ("riscv64",),
}


def machines_of(content: bytes) -> tuple[str, ...]:
    """Returns the machines that run a compiled file; none for other files and for unknown machines."""
    if not content.startswith(_MAGIC) or len(content) < 20:
        return ()
    number = content[18:20] if content[5] == _BIG_ENDIAN else content[19:17:-1]
    return _MACHINES.get(int.from_bytes(number, "big"), ())
