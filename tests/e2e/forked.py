"""Runs swarmctl in processes forked from one that has imported the package: a start costs no second import.

Each run is a process of its own with its own environment and output files, as the console script has them.
Tests of how a process starts or what its terminal shows run the console script itself.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import json
import os
import pkgutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, NoReturn

from tests import ROOT

_LONGEST_REQUEST = 1 << 20
_STARTING = threading.Lock()

Process = Callable[[Sequence[str], Mapping[str, str], float], subprocess.CompletedProcess[str]]


def console_script(
    argv: Sequence[str], env: Mapping[str, str], timeout: float
) -> subprocess.CompletedProcess[str]:
    """Run the console script ``argv`` itself. Raises subprocess.TimeoutExpired."""
    return subprocess.run(argv, capture_output=True, text=True, env=env, timeout=timeout, check=False)


def swarmctl(argv: Sequence[str], env: Mapping[str, str], timeout: float) -> subprocess.CompletedProcess[str]:
    """Run what the console script ``argv`` would run; SIGKILL ends it after ``timeout`` s.

    Raises subprocess.TimeoutExpired.
    """
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        status = _status(argv, env, (out, err), timeout)
        texts = [_text(stream) for stream in (out, err)]
    return subprocess.CompletedProcess(argv, status, *texts)


def _text(stream: BinaryIO) -> str:
    stream.seek(0)
    return stream.read().decode()


def _status(
    argv: Sequence[str], env: Mapping[str, str], outputs: tuple[BinaryIO, BinaryIO], timeout: float
) -> int:
    """Run to the end; the exit code, or minus the number of the signal that ended the process."""
    with _STARTING:
        server = _server()
    ours, theirs = socket.socketpair()
    with ours:
        with theirs:
            socket.send_fds(server, [b"."], [theirs.fileno(), *(stream.fileno() for stream in outputs)])
        answers = ours.makefile("rw")
        answers.write(json.dumps([list(argv), dict(env), str(Path.cwd())]) + "\n")
        answers.flush()
        pid = int(answers.readline())
        ours.settimeout(timeout)
        try:
            return int(answers.readline())
        except TimeoutError:
            os.kill(pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired(list(argv), timeout) from None


@lru_cache
def _server() -> socket.socket:
    """The socket of the process that forks, one for each test process; it ends when this socket closes."""
    ours, theirs = socket.socketpair(type=socket.SOCK_SEQPACKET)
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", "tests.e2e.forked", str(theirs.fileno())],
            cwd=ROOT, pass_fds=[theirs.fileno()], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        )  # fmt: skip
    atexit.register(process.wait)
    atexit.register(ours.close)
    return ours


def _serve(requests: socket.socket) -> None:
    """Fork for each request until the test process is gone."""
    import swarmctl

    for module in pkgutil.walk_packages(swarmctl.__path__, "swarmctl."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    gc.freeze()  # a collection in a child would copy every page
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the tests, which then close the socket
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel removes children that have ended
    while True:
        message, files, _, _ = socket.recv_fds(requests, 1, 3)
        if not message:
            return
        if os.fork() == 0:
            requests.close()
            _watch(socket.socket(fileno=files[0]), files[1:])
        for file in files:
            os.close(file)


def _watch(asker: socket.socket, outputs: Sequence[int]) -> NoReturn:
    """Run one request in a child; send its pid, and its exit code at the end."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    stream = asker.makefile("rw")
    argv, env, folder = json.loads(stream.readline(_LONGEST_REQUEST))
    pid = os.fork()
    if pid == 0:
        asker.detach()
        os.chdir(folder)
        _run(argv, env, outputs)
    print(pid, file=stream, flush=True)
    _, status = os.waitpid(pid, 0)
    with suppress(BrokenPipeError):  # the asker gave up after its timeout
        print(os.waitstatus_to_exitcode(status), file=stream, flush=True)
    os._exit(0)


def _run(argv: list[str], env: dict[str, str], outputs: Sequence[int]) -> NoReturn:
    from swarmctl.__main__ import main

    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.clear()
    os.environ.update(env)
    for number, file in enumerate(outputs, 1):
        os.dup2(file, number)
        os.close(file)
    sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))  # noqa: SIM115
    sys.argv = argv
    code = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
