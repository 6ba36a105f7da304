"""Lights and sounds: sent once, sent again after a lost line, and never delaying more important requests."""

from __future__ import annotations

from dataclasses import replace

import pytest
from swarm_onboard.driver.actuators import ActuatorSettings, SentSettings
from swarm_onboard.driver.config import Actuator

from tests.onboard.driver.fakes import Bench, Clock, config_for

LEDS = Actuator("leds", "L,{index},{value}", "l", ("led0", "led1"), max=1, momentary=False)
SOUND = Actuator("sound", "T,{value}", "t", ("number",), max=5, momentary=True)
COLOURS = Actuator("colours", "f6 {values:B} 00", "", ("red", "green"), max=100, momentary=False)


def outputs_of(*actuators: Actuator) -> tuple[ActuatorSettings, Clock]:
    clock = Clock()
    return ActuatorSettings(actuators, lambda: None, clock), clock


def shown_by(shown: SentSettings) -> list[tuple[str, int, tuple[int, ...]]]:
    """Returns every change that is sent until none is left."""
    sent = []
    while (change := shown.next()) is not None:
        sent.append((change.actuator.name, change.index, change.values))
        shown.mark_sent(change)
    return sent


def test_only_channels_that_change_are_sent():
    outputs, clock = outputs_of(LEDS)
    shown = SentSettings(outputs, clock.now)
    assert shown_by(shown) == []
    outputs.put(LEDS, [1, 0])
    assert shown_by(shown) == [("leds", 0, (1, 0)), ("leds", 1, (1, 0))]
    outputs.put(LEDS, [1, 1])
    assert shown_by(shown) == [("leds", 1, (1, 1))]
    outputs.put(LEDS, [1, 1])
    assert shown_by(shown) == []


def test_all_at_once_is_one_request():
    outputs, clock = outputs_of(COLOURS)
    shown = SentSettings(outputs, clock.now)
    outputs.put(COLOURS, [5, 200])
    assert shown_by(shown) == [("colours", 0, (5, 100))]


def test_each_sound_is_made_once_and_not_again_on_a_new_line():
    outputs, clock = outputs_of(SOUND)
    shown = SentSettings(outputs, clock.now)
    for _ in range(2):
        outputs.put(SOUND, [3])
        assert shown_by(shown) == [("sound", 0, (3,))]
        clock.now += 1.0
    assert shown_by(SentSettings(outputs, clock.now)) == []


def test_values_are_clamped_and_wrong_lengths_are_refused():
    outputs, _ = outputs_of(LEDS)
    outputs.put(LEDS, [255, 1, 1])
    assert (outputs.settings, outputs.refused) == ({}, 1)
    outputs.put(LEDS, [255, -1])
    assert outputs.settings["leds"].values == (1, 0)


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.run(1.0)
    return bench


def lights(bench: Bench) -> list[str]:
    return [request for _, request in bench.robot.requests if request.startswith("L")]


def test_a_robot_shows_what_is_wanted_at_once(bench: Bench):
    before = bench.clock.now
    bench.outputs.put(bench.config.actuators[0], [1, 0])
    bench.run(0.1)
    assert lights(bench) == ["L,0,1", "L,1,0"]
    assert next(at for at, request in bench.robot.requests if request == "L,1,0") - before < 0.05


def test_it_is_shown_again_after_the_line_was_lost(bench: Bench):
    bench.outputs.put(bench.config.actuators[0], [1, 0])
    bench.run(0.5)
    bench.robot.plugged = False
    bench.run(1.0)
    bench.robot.plugged = True
    bench.robot.requests.clear()
    bench.run(6.0)
    assert lights(bench) == ["L,0,1", "L,1,0"]


def test_a_light_that_the_robot_refuses_is_not_insisted_on(bench: Bench):
    bench.robot.refuses = "L"
    bench.outputs.put(bench.config.actuators[0], [1, 1])
    bench.run(5.0)
    assert lights(bench) == ["L,0,1", "L,1,1"]
    assert bench.sink.reports[-1].values["failed exchanges"] == "2"


def test_a_light_that_is_not_answered_is_tried_again_in_a_while(bench: Bench):
    bench.robot.silent_to = "L"
    bench.outputs.put(bench.config.actuators[0], [1, 1])
    bench.run(5.0)
    assert 3 <= len(lights(bench)) <= 6
    bench.robot.silent_to = ""
    bench.run(2.0)
    assert lights(bench)[-2:] == ["L,0,1", "L,1,1"]


def test_changing_lights_alternate_with_sensors_and_delay_no_speed():
    bench = Bench(config_for("koala", rates={"odom": 10.0}))
    bench.robot.takes = 0.02
    bench.run(1.0)
    given, sent = len(bench.sink.poses), len(bench.robot.requests)
    for step in range(100):
        bench.outputs.put(bench.config.actuators[0], [step % 2, (step + 1) % 2])
        bench.command(0.1 + step / 1000)
        bench.run(0.05)
    assert len(bench.sink.poses) - given >= 45, "of 50 poses in 5 s"
    assert len(lights(bench)) >= 25
    speeds = [request for _, request in bench.robot.requests[sent:] if request.startswith("D,")]
    assert len(set(speeds)) >= 20


def test_a_light_that_keeps_silent_does_not_hold_up_the_dead_man():
    bench = Bench(replace(config_for("koala"), command_timeout=0.5))
    bench.run(1.0)
    bench.robot.silent_to = "L"
    bench.command(0.1)
    bench.run(0.45)
    bench.outputs.put(bench.config.actuators[0], [1, 1])
    bench.run(0.2)
    stopped = [at for at, request in bench.robot.requests if request == "D,0,0"][-1]
    commanded = next(at for at, request in bench.robot.requests if request == "D,22,22")
    assert stopped - commanded == pytest.approx(0.5, abs=0.03)


def test_a_flood_of_unanswered_sounds_does_not_delay_the_stop():
    """A serial port takes 4 KB at once: a stop behind that would come seconds late."""
    beep = Actuator("beep", "T,{value}", None, ("tone",), max=255, momentary=True)
    koala = config_for("koala")
    bench = Bench(replace(koala, actuators=(beep,), serial=replace(koala.serial, baud=9600)))
    bench.run(1.0)
    for number in range(1000):
        bench.outputs.put(beep, [number % 256])
        bench.clock.now += 0.001
        bench.run(0.001)
    beeps = [request + "\r" for _, request in bench.robot.requests if request.startswith("T,")]
    assert len(beeps) > 20
    assert len("".join(beeps)) < 0.5 * 2.0 * 960
