// The speed of one wheel, held by PWM: what the motor is known to need, and a PI loop for the rest.
#pragma once

#include "config.h"

class SpeedLoop {
 public:
  // Where the motor begins to turn, and the wheel's speed on the ground at full PWM.
  SpeedLoop(float pwm_min, float full_speed)
      : pwm_min_(pwm_min), slope_((255.0f - pwm_min) * config::wheel_radius / full_speed) {}

  void reset() { behind_ = 0.0f; }

  // PWM 0..255 for a wheel that is to turn at `target` rad/s (> 0), turns at `speed`, and turned by `turned` rad since
  // the last step. Its sum is the integral of the measured speed, and exact: a wheel that fell behind catches up.
  float step(float target, float speed, float turned) {
    const float behind = behind_ + target * config::control_period - turned;
    const float wanted = pwm_min_ + slope_ * target + config::kp * (target - speed) + config::ki * behind;
    const float pwm = wanted < 0.0f ? 0.0f : wanted > 255.0f ? 255.0f : wanted;
    // Anti-windup: at the limit the integral may only come back.
    if (pwm == wanted || (wanted > pwm) == (behind < behind_)) behind_ = behind;
    return pwm;
  }

 private:
  float pwm_min_;
  float slope_;  // PWM per rad/s
  float behind_ = 0.0f;  // rad
};
