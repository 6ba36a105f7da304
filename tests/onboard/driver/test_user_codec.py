"""A protocol class of the user's own: whatever it does, the driver lives and the robot can be stopped."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from swarm_onboard.command.report import Level
from swarm_onboard.driver import user_codec
from swarm_onboard.driver.codec import BadReplyError, Reply
from swarm_onboard.driver.config import Config, parse
from swarm_onboard.driver.driver import Phase
from swarm_onboard.driver.protocols import PythonProtocol
from swarm_onboard.driver.user_codec import InterruptionError, UserCodec

from tests.onboard.driver.driver_process import running, wired
from tests.onboard.driver.fakes import Bench, config_for, params_for
from tests.timing import PATIENCE


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit of time for one call of a class, for a busy machine."""
    monkeypatch.setattr(user_codec, "_TIME_LIMIT", PATIENCE)


CODEC = """\
from swarm_onboard.driver.codec import BadReplyError, Reply, Request
from swarm_onboard.driver.line_protocol import LineBuffer


class KoalaCodec:
    def __init__(self, options):
        pass

    def speed(self, left, right):
        return self.ask(f"D,{left},{right}")

    def query(self, name):
        return self.ask({"position": "H", "proximity": "N"}[name])

    def actuator(self, actuator, index, values):
        return self.ask(f"L,{index},{values[0]}")

    def identify(self):
        return self.ask("B")

    def ask(self, text):
        return Request(text.encode() + b"\\n", text, lambda: Reader(text[0].lower()))


class Reader:
    noise = 0
    stray = ""

    def __init__(self, head):
        self.head = head
        self.lines = LineBuffer()

    def feed(self, data):
        for line in self.lines.feed(data):
            head, _, rest = line.decode("latin-1").partition(",")
            if head == self.head:
                numbers = rest.split(",") if head in "hn" else ()
                return Reply(tuple(int(one) for one in numbers), rest)
        return None
"""
ASK = "        return Request("
FEED = "        for line in self.lines"
AHEAD, STOP = "D,44,44", "D,0,0"


@pytest.fixture
def config(tmp_path: Path) -> Callable[..., Config]:
    """The parameters of a Koala that is spoken to through a class; its text with changes made to it."""

    def made(*changes: tuple[str, str]) -> Config:
        text = CODEC
        for before, after in changes:
            assert before in text
            text = text.replace(before, after)
        module = tmp_path / "koala.py"
        module.write_text(text)
        protocol = PythonProtocol(0.15, module, "KoalaCodec", {}, True, {"position": 2, "proximity": 16})
        koala = config_for("koala")
        sensors = tuple(one for one in koala.sensors if one.read in protocol.values)
        return replace(koala, protocol=protocol, sensors=sensors, actuators=())

    return made


def driving(config: Config) -> Bench:
    bench = Bench(config)
    bench.run(1.0)
    for _ in range(10):
        bench.command(0.2)
        bench.run(0.1)
    return bench


def test_it_drives_as_a_protocol_of_lines_does(config: Callable[..., Config]) -> None:
    bench = driving(config())
    assert bench.driver.phase is Phase.READY
    assert bench.robot.speed == (44, 44)
    assert bench.sink.reports[-1].values["firmware"] == "5,1"
    assert bench.sink.readings[-1] == ("proximity", (7,) * 16)
    bench.run(1.0)
    assert bench.robot.speed == (0, 0)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ((ASK, "        1 / 0\n" + ASK), "koala.py:23: ZeroDivisionError: division by zero"),
        ((ASK, "        import sys; sys.exit()\n" + ASK), "koala.py:23: SystemExit"),
        (
            (ASK, "        return None\n" + ASK),
            "koala.py:12: `query` returns a NoneType instead of a Request of",
        ),
        (
            (ASK, "        return Request('H', 'H', None)\n" + ASK),
            "returns a Request instead of a Request of",
        ),
        (
            (ASK, "        return Request(b'H' * 5000, 'H', Reader)\n" + ASK),
            "makes a request of 5000 bytes, 4096 at most",
        ),
        (
            (FEED, "        data.decode('ascii').nonsense\n" + FEED),
            "koala.py:35: AttributeError: 'str' object",
        ),
        ((FEED, "        return 7\n" + FEED), "koala.py:33: `feed` returns a int instead of a Reply or None"),
        ((FEED, "        return Reply((1,))\n" + FEED), "koala.py:33: `feed` returns 1 values instead of"),
        ((FEED, "        return Reply((float('nan'), 1))\n" + FEED), "which are not numbers"),
        ((FEED, "        return Reply((10**400, 1))\n" + FEED), "which are not numbers"),
        ((FEED, "        return Reply((True, 1))\n" + FEED), "which are not numbers"),
        ((FEED, "        raise BadReplyError('bad sum')\n" + FEED), "bad sum"),
    ],
    ids=lambda value: value[-40:] if isinstance(value, str) else "",
)
def test_a_fault_in_a_request_is_a_failed_exchange_with_its_place(
    config: Callable[..., Config], change: tuple[str, str], expected: str
) -> None:
    """The fault is there for questions alone: commands go out, and the robot stops in time."""
    before, after = change
    fault, _, rest = after.partition("\n")
    asks = "text" if before == ASK else "self.head"
    only = f"        if {asks} in ('H', 'N', 'h', 'n'):\n    {fault}\n{rest}"
    bench = driving(config((before, only)))
    assert bench.driver.phase is Phase.READY
    assert bench.robot.speed == (44, 44)
    bench.run(1.0)
    assert bench.robot.speed == (0, 0)
    bench.run(2.0)
    report = bench.sink.reports[-1]
    assert report.level is Level.WARN
    assert expected in report.values["last error"]


def test_a_class_that_fails_on_the_stop_stops_the_robot_all_the_same(config: Callable[..., Config]) -> None:
    """Once it has been able to make a stop: those bytes are kept."""
    later = (
        "        self.stops = getattr(self, 'stops', 0) + (text == 'D,0,0')\n        assert self.stops < 3\n"
    )
    bench = driving(config((ASK, later + ASK)))
    assert bench.robot.speed == (44, 44)
    bench.run(0.7)
    assert bench.robot.speed == (0, 0)
    bench.run(5.0)
    assert any("koala.py:23: AssertionError" in text for _, text in bench.sink.events)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("class KoalaCodec", "class KaolaCodec"), "AttributeError"),
        (("        pass", "        raise OSError('no such dongle')"), "koala.py:7: OSError: no such dongle"),
        (("import LineBuffer", "import LineBufer"), "koala.py:2: ImportError"),
        (("class Reader:", "class Reader"), "koala.py:25: SyntaxError"),
        ((ASK, "        0 / 0\n" + ASK), "koala.py:22: ZeroDivisionError"),
        (("        pass", "        raise SystemExit(0)"), "koala.py:7: SystemExit"),
        (("        pass", "        raise KeyboardInterrupt"), "koala.py:7: KeyboardInterrupt"),
        (("class Reader:", "quit()\nclass Reader:"), "koala.py:25: SystemExit"),
        (("def speed", "def speeds"), "koala.py: AttributeError: 'KoalaCodec' object has no attribute"),
    ],
    ids=lambda value: value[-40:] if isinstance(value, str) else "",
)
def test_a_class_that_cannot_be_made_is_reported_and_retried(
    config: Callable[..., Config],
    change: tuple[str, str],
    expected: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)  # a file changed within a second is read anew
    bench = Bench(config(change))
    bench.run(10.0)
    assert bench.robot.requests == []
    report = bench.sink.reports[-1]
    assert report.level is Level.ERROR
    assert expected in report.message
    assert bench.robot.opened > 3
    config()  # fixed meanwhile
    bench.run(10.0)
    assert bench.driver.phase is Phase.READY


@pytest.mark.parametrize("method", ["speed", "query", "identify", "feed", "setup"])
@pytest.mark.parametrize("raised", ["SystemExit(0)", "KeyboardInterrupt", "GeneratorExit"])
def test_no_method_can_end_the_driver(config: Callable[..., Config], method: str, raised: str) -> None:
    """After the first stop, which is kept: the robot is stopped whatever the class does then."""
    ends = f"        if getattr(KoalaCodec, 'late', False): raise {raised}\n        KoalaCodec.late = True\n"
    if method == "setup":  # which the class lacks
        change = ("    def speed", f"    def setup(self):\n        raise {raised}\n\n    def speed")
    else:
        head = next(line for line in CODEC.splitlines() if f"def {method}(" in line) + "\n"
        change = (head, head + (ends if method != "identify" else f"        raise {raised}\n"))
    bench = driving(config(change))
    bench.run(3.0)
    assert bench.robot.speed == (0, 0)
    name = raised.partition("(")[0]
    report = bench.sink.reports[-1]
    texts = [*(text for _, text in bench.sink.events), report.values["last error"], report.message]
    assert any(name in text for text in texts)


SETUP = "    def setup(self):\n        return {}\n\n    def speed"
NO_REQUEST = "`{}` returns a {} instead of a Request of bytes"
FAULTS = {
    "the file as Python": (("class Reader:", "class Reader"), 25, "SyntaxError"),
    "the file as it is imported": (("class Reader:", "1 / 0\n\nclass Reader:"), 25, "ZeroDivisionError"),
    "__init__": (("        pass", "        1 / 0"), 7, "ZeroDivisionError"),
    "speed": (('self.ask(f"D', 'self.nothing(f"D'), 10, "AttributeError"),
    "what speed returns": (
        ('return self.ask(f"D', 'self.ask(f"D'),
        9,
        NO_REQUEST.format("speed", "NoneType"),
    ),
    "the request of speed": (("text.encode() + b", "text + "), 9, NO_REQUEST.format("speed", "Request")),
    "query": (('"position": ', '"place": '), 13, "KeyError"),
    "what query returns": (('return self.ask({"', '({"'), 12, NO_REQUEST.format("query", "NoneType")),
    "actuator": (("values[0]", "values[9]"), 16, "IndexError"),
    "what actuator returns": (('self.ask(f"L', 'str(f"L'), 15, NO_REQUEST.format("actuator", "str")),
    "identify": (('self.ask("B")', "self.ask(None)"), 22, "AttributeError"),
    "what identify returns": (('self.ask("B")', "b''"), 18, NO_REQUEST.format("identify", "bytes")),
    "setup": (("    def speed", SETUP.format("1 / 0")), 10, "ZeroDivisionError"),
    "what setup returns": (("    def speed", SETUP.format("7")), 9, "a int instead of a list of Requests"),
    "what setup lists": (("    def speed", SETUP.format("[7]")), 9, NO_REQUEST.format("setup", "int")),
    "the maker of a reader": (("text[0]", "text.nothing"), 22, "AttributeError"),
    "what it makes": (("lambda: Reader(text[0].lower())", "lambda: 7"), 22, "a int, which has no `feed`"),
    "__init__ of a reader": (("LineBuffer()", "LineBuffer(1)"), 31, "TypeError"),
    "feed": ((FEED, "        1 / 0\n" + FEED), 34, "ZeroDivisionError"),
    "what feed returns": ((FEED, "        return 7\n" + FEED), 33, "a int instead of a Reply or None"),
    "its numbers": ((FEED, "        return Reply('12')\n" + FEED), 33, "a str, which are not numbers"),
    "how many": ((FEED, "        return Reply((1, 2, 3))\n" + FEED), 33, "3 values instead of 2"),
    "an error without words": ((FEED, "        raise BadReplyError\n" + FEED), 34, "BadReplyError"),
    "an error that cannot be shown": (
        ("        pass", "        class Odd(Exception):\n            __str__ = 7\n        raise Odd"),
        9,
        "Odd",
    ),
}


@pytest.mark.parametrize("path", FAULTS)
def test_an_error_on_any_path_names_the_file_and_its_line(config: Callable[..., Config], path: str) -> None:
    change, line, expected = FAULTS[path]
    with pytest.raises(BadReplyError) as raised:
        call_everything(config(change).protocol)
    assert str(raised.value).startswith(f"koala.py:{line}: ")
    assert expected in str(raised.value)


def test_every_path_of_the_class_is_called_without_a_fault(config: Callable[..., Config]) -> None:
    call_everything(config().protocol)


def call_everything(protocol: PythonProtocol) -> None:
    """Calls all that a driver does."""
    codec = UserCodec(protocol)
    position = codec.query("position")
    codec.speed(1, 1)
    codec.actuator(config_for("koala").actuators[0], 0, (1,))
    codec.setup()
    codec.identify()
    assert position.reader().feed(b"h,1,2\r\n") == Reply((1, 2), "1,2")


def test_what_a_signal_raises_is_no_fault_of_the_class(config: Callable[..., Config]) -> None:
    """Else a test that is broken off would go on."""
    calls = (
        "        from swarm_onboard.driver import user_codec\n        raise user_codec.InterruptionError\n"
    )
    with pytest.raises(InterruptionError):
        UserCodec(config(("        pass\n", calls)).protocol)


def test_what_the_class_prints_is_not_among_the_results(
    config: Callable[..., Config], capfd: pytest.CaptureFixture[str]
) -> None:
    UserCodec(config(("        pass\n", "        print('made')\n")).protocol)
    assert capfd.readouterr().out == ""


def test_a_file_that_is_gone(config: Callable[..., Config]) -> None:
    gone = config()
    gone.protocol.module.unlink()
    with pytest.raises(BadReplyError, match=r"koala\.py: FileNotFoundError"):
        UserCodec(gone.protocol)


def test_the_parameters_name_the_file_from_their_own_folder(config: Callable[..., Config]) -> None:
    data = yaml.safe_load(
        """{kind: python, module: ../codecs/koala.py, codec: KoalaCodec, options: {a: 1}, identify: false,
        reply_timeout: 0.2, set_speed: {}, queries: {position: {values: 2}}}"""
    )
    parsed = parse({**params_for("koala"), "protocol": data}, Path("/opt/x/params")).protocol
    assert parsed == PythonProtocol(
        0.2, Path("/opt/x/params/../codecs/koala.py"), "KoalaCodec", {"a": 1}, False, {"position": 2}
    )


def test_a_class_that_hangs_ends_the_driver_and_the_motors_stop(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """As systemd does it: what runs after the driver stops the robot."""
    hangs = "        while self.left and text == 'H' and self.left != '0': pass\n"
    notes = "        self.left = text.split(',')[1] if text[0] == 'D' else getattr(self, 'left', None)\n"
    (tmp_path / "koala.py").write_text(CODEC.replace(ASK, notes + hangs + ASK))
    with wired("koala", tmp_path) as wiring:
        params = yaml.safe_load(wiring.config.read_text())
        values = {name: {"values": one["values"]} for name, one in params["protocol"]["queries"].items()}
        params["protocol"] = {
            "kind": "python", "module": "koala.py", "codec": "KoalaCodec", "options": {}, "identify": True,
            "reply_timeout": 0.15, "queries": values,
        }  # fmt: skip
        wiring.config.write_text(yaml.safe_dump(params))
        with running(wiring.config) as node:
            node.wait_until_ready()
            node.command(0.2)
            assert node.process.wait(PATIENCE) == -signal.SIGALRM
        assert f'{tmp_path / "koala.py"}", line 23 in ask' in capfd.readouterr().err
        assert wiring.moving()
        assert wiring.stop_motors().returncode == 0
        assert not wiring.moving()


def test_stop_motors_ends_in_time_with_a_class_that_hangs(tmp_path: Path) -> None:
    """No driver moves such a robot; and nothing waits for the class before the next one starts."""
    (tmp_path / "koala.py").write_text(CODEC.replace(ASK, "        while True: pass\n" + ASK))
    with wired("koala", tmp_path) as wiring:
        params = yaml.safe_load(wiring.config.read_text())
        params["protocol"] = {
            "kind": "python", "module": "koala.py", "codec": "KoalaCodec", "options": {}, "identify": True,
            "reply_timeout": 0.15, "queries": {"position": {"values": 2}},
        }  # fmt: skip
        wiring.config.write_text(yaml.safe_dump(params))
        ran = wiring.stop_motors()
        assert ran.returncode == -signal.SIGALRM
        assert f'{tmp_path / "koala.py"}", line 22 in ask' in ran.stderr


def test_only_a_query_may_send_nothing(config: Callable[..., Config]) -> None:
    """A query of no bytes waits for a line that the robot sends by itself; a command would be lost."""
    silent = (ASK, "        if text[0] in 'HD':\n            text = ''\n        return Request(")
    end = ('.encode() + b"\\n"', ".encode()")
    with pytest.raises(
        BadReplyError, match="`speed` makes a request of 0 bytes; only a query may send nothing"
    ):
        UserCodec(config(silent, end).protocol)
    silent = (ASK, "        if text == 'H':\n            text = ''\n        return Request(")
    assert UserCodec(config(silent, end).protocol).query("position").data == b""
