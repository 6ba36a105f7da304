"""Stops a process and its children before each system call that changes files: ptrace(2), seccomp(2), x86-64.

One process is stopped at a time; the others of a deploy wait for it.
"""

from __future__ import annotations

import ctypes
import os
import signal
import struct
from collections.abc import Callable, Sequence
from pathlib import Path

MACHINE = "x86_64"
_AT_FDCWD = -100
_CREATING = os.O_CREAT | os.O_TRUNC
# Number of the call on x86-64: its name, and where its arguments name the file. "fd N": a descriptor;
# "path N"; "at N": a folder's descriptor and a path relative to it; "": no file.
CALLS = {
    1: ("write", "fd 0"),
    2: ("open", "path 0"),
    18: ("pwrite64", "fd 0"),
    20: ("writev", "fd 0"),
    40: ("sendfile", "fd 0"),
    74: ("fsync", "fd 0"),
    75: ("fdatasync", "fd 0"),
    76: ("truncate", "path 0"),
    77: ("ftruncate", "fd 0"),
    82: ("rename", "path 0"),
    83: ("mkdir", "path 0"),
    84: ("rmdir", "path 0"),
    86: ("link", "path 1"),
    87: ("unlink", "path 0"),
    88: ("symlink", "path 1"),
    90: ("chmod", "path 0"),
    91: ("fchmod", "fd 0"),
    92: ("chown", "path 0"),
    93: ("fchown", "fd 0"),
    94: ("lchown", "path 0"),
    162: ("sync", ""),
    257: ("openat", "at 0"),
    258: ("mkdirat", "at 0"),
    260: ("fchownat", "at 0"),
    263: ("unlinkat", "at 0"),
    264: ("renameat", "at 0"),
    265: ("linkat", "at 2"),
    266: ("symlinkat", "at 1"),
    268: ("fchmodat", "at 0"),
    280: ("utimensat", "at 0"),
    285: ("fallocate", "fd 0"),
    306: ("syncfs", "fd 0"),
    316: ("renameat2", "at 0"),
    326: ("copy_file_range", "fd 2"),
}

_LIBC = ctypes.CDLL(None, use_errno=True)
_LIBC.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
_LIBC.ptrace.restype = ctypes.c_long
_TRACEME, _CONT, _SETOPTIONS, _SYSCALL_INFO = 0, 7, 0x4200, 0x420E
_OPTIONS = 0x100000 | 0x80 | 0x10 | 0x8 | 0x4 | 0x2  # exit with the tracer; seccomp, exec, clone, vfork, fork
_EVENT_SECCOMP = 7
_WALL = 0x40000000
_NO_NEW_PRIVS, _SET_SECCOMP, _FILTER = 38, 22, 2


def trace(
    command: Sequence[str],
    environment: dict[str, str],
    request: Path,
    below: str,
    before: Callable[[str], None],
) -> int:
    """Runs ``command`` with ``request`` as its input, and calls ``before`` with a text for each system call
    that changes files ``below`` this folder, while the process stands before it. Returns the exit status.

    The calling process has no other children meanwhile.
    """
    first = os.fork()
    if first == 0:
        _become(command, environment, request)
    os.waitpid(first, _WALL)
    _ptrace(_SETOPTIONS, first, _OPTIONS)
    _ptrace(_CONT, first, 0)
    status = 0
    known = {first}
    while True:
        try:
            pid, state = os.waitpid(-1, _WALL)
        except ChildProcessError:
            return status
        if not os.WIFSTOPPED(state):
            status = os.waitstatus_to_exitcode(state) if pid == first else status
            continue
        number = os.WSTOPSIG(state)
        if state >> 16 == _EVENT_SECCOMP:
            text = _described(pid, below)
            if text:
                before(text)
        ours = number == signal.SIGTRAP or (number == signal.SIGSTOP and pid not in known)
        known.add(pid)
        _ptrace(_CONT, pid, 0 if ours else number)


def _become(command: Sequence[str], environment: dict[str, str], request: Path) -> None:
    try:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(os.open(request, os.O_RDONLY), 0)
        os.dup2(nothing, 1)
        os.dup2(nothing, 2)
        _ptrace(_TRACEME, 0, 0)
        os.kill(os.getpid(), signal.SIGSTOP)
        _filter()
        os.execve(command[0], list(command), environment)
    finally:
        os._exit(127)


def _filter() -> None:
    """Has the kernel stop for the tracer at ``CALLS``, and nowhere else."""
    load, equal, give = 0x20, 0x15, 0x06
    program = [(load, 0, 0, 0)]  # the number of the call
    for place, number in enumerate(CALLS):
        program.append((equal, len(CALLS) - place, 0, number))
    program += [(give, 0, 0, 0x7FFF0000), (give, 0, 0, 0x7FF00000)]  # allow, trace
    code = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *one) for one in program))
    head = ctypes.create_string_buffer(struct.pack("HxxxxxxQ", len(program), ctypes.addressof(code)))
    for arguments in ((_NO_NEW_PRIVS, 1, 0), (_SET_SECCOMP, _FILTER, ctypes.addressof(head))):
        words = [ctypes.c_ulong(one) for one in (*arguments, 0, 0)]
        if _LIBC.prctl(*words) != 0:
            raise OSError(ctypes.get_errno(), "prctl")


def _ptrace(request: int, pid: int, data: int, address: int = 0) -> int:
    done: int = _LIBC.ptrace(request, pid, address, data)
    if done < 0 and ctypes.get_errno() != 3:  # ESRCH: it was killed meanwhile
        raise OSError(ctypes.get_errno(), f"ptrace request {request:#x}")
    return done


def _described(pid: int, below: str) -> str:
    """Returns the call at which ``pid`` stands and its file; empty if it changes nothing ``below``."""
    info = ctypes.create_string_buffer(88)
    _ptrace(_SYSCALL_INFO, pid, ctypes.addressof(info), len(info))
    number, *arguments = struct.unpack_from("7Q", info, 24)
    name, where = CALLS[number]
    if not where:
        return name
    kind, place = where.split()
    at = int(place)
    flags = arguments[2 if name == "openat" else 1]
    if name in ("open", "openat") and not flags & _CREATING:
        return ""
    process = Path(f"/proc/{pid}")
    if kind == "fd":
        path = (process / f"fd/{arguments[at]}").readlink()
    elif kind == "path":
        path = (process / "cwd").readlink() / _text(process, arguments[at])
    else:
        descriptor = ctypes.c_int(arguments[at] & 0xFFFFFFFF).value
        folder = "cwd" if descriptor == _AT_FDCWD else f"fd/{descriptor}"
        path = (process / folder).readlink() / _text(process, arguments[at + 1])
    return f"{name} {str(path)[len(below) :]}" if str(path).startswith(below) else ""


def _text(process: Path, address: int) -> str:
    """Returns the text at an address of the process."""
    if not address:
        return ""
    with (process / "mem").open("rb", buffering=0) as memory:
        memory.seek(address)
        found = memory.read(4096 - address % 4096)  # no further than the page
        if b"\0" not in found:
            found += memory.read(4096)
    return os.fsdecode(found.split(b"\0", 1)[0])
