// A differential drive under ROS: commands come in as Twist, wheel pulses go out, and two loops hold the speeds between.
// Wiring and numbers stand in config.h.
#include <Arduino.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "config.h"
#include "kinematics.h"
#include "rosserial.h"
#include "wheel.h"

namespace {

constexpr uint32_t ms(float seconds) { return static_cast<uint32_t>(seconds * 1000.0f + 0.5f); }

Wheel left(config::left_encoder, Motor(config::left_enable, config::left_forward, config::left_backward),
           SpeedLoop(config::left_pwm_min, config::left_full_speed));
Wheel right(config::right_encoder, Motor(config::right_enable, config::right_forward, config::right_backward),
            SpeedLoop(config::right_pwm_min, config::right_full_speed));

WheelSpeeds commanded{0.0f, 0.0f};
uint32_t commanded_at = 0;           // ms
WheelSpeeds driven{0.0f, 0.0f};    // on the way to what was commanded
bool blocked = false;              // a wheel did not turn: both stand until a command to stop, or none, has come

void obey(float v, float omega) {
  if (v == 0.0f && omega == 0.0f) blocked = false;
  commanded = blocked ? WheelSpeeds{0.0f, 0.0f} : wheel_speeds(v, omega);
  commanded_at = millis();
}

RosserialClient host(obey);

// The dead-man. It asks nobody else: a host that is connected and silent has fallen asleep.
void stop_unless_commanded(uint32_t now) {
  if (!host.connected() || now - commanded_at > ms(config::dead_man)) obey(0.0f, 0.0f);
}

constexpr char left_blocked[] PROGMEM = "the left wheel is driven and gives no pulses: is it blocked, or its encoder off?";
constexpr char right_blocked[] PROGMEM = "the right wheel is driven and gives no pulses: is it blocked, or its encoder off?";

// A motor that is held burns its driver, and a wheel whose encoder is off would run ever faster.
void stop_if_blocked() {
  if (!left.blocked() && !right.blocked()) return;
  host.complain(left.blocked() ? left_blocked : right_blocked);
  commanded = driven = {0.0f, 0.0f};
  blocked = true;
}

// Whether `period` (ms) has passed since `last`, which moves on with it; turns that were missed are not made up for.
bool due(uint32_t now, uint32_t period, uint32_t &last) {
  if (now - last < period) return false;
  last = now - last < 2 * period ? last + period : now;
  return true;
}

}  // namespace

// Before anything else: a watchdog that has bitten still runs, and would bite again while the program starts.
void disarm_watchdog() __attribute__((naked, used, section(".init3")));
void disarm_watchdog() {
  MCUSR = 0;
  wdt_disable();
}

ISR(INT0_vect) { (config::left_encoder == 2 ? left : right).encoder.edge(); }
ISR(INT1_vect) { (config::left_encoder == 3 ? left : right).encoder.edge(); }

void setup() {
  left.begin();
  right.begin();
  wdt_enable(WDTO_250MS);
  EICRA = _BV(ISC00) | _BV(ISC10);  // both edges
  EIMSK = _BV(INT0) | _BV(INT1);
  Serial.begin(config::baud);
  host.introduce();
  set_sleep_mode(SLEEP_MODE_IDLE);
}

void loop() {
  static uint32_t fed = 0;
  static uint32_t controlled = 0;
  static uint32_t published = 0;
  host.spin(millis());
  const uint32_t now = millis();  // not before the commands that were just received
  if (now != fed) wdt_reset();  // not while time stands: a storm of pulses starves the clock, and with it the dead-man
  fed = now;
  stop_unless_commanded(now);
  if (due(now, ms(config::control_period), controlled)) {
    driven = approach(driven, commanded);
    left.control(driven.left);
    right.control(driven.right);
    stop_if_blocked();
  }
  if (due(now, ms(1.0f / config::ticks_rate), published)) {
    host.publish(RosserialClient::left_ticks, left.encoder.ticks());
    host.publish(RosserialClient::right_ticks, right.encoder.ticks());
  }
  sleep_mode();  // until the next interrupt, a millisecond at the most
}
