// A wheel with its motor, its encoder and the loop between them.
#pragma once

#include "encoder.h"
#include "motor.h"
#include "pi.h"

class Wheel {
 public:
  Wheel(uint8_t encoder_pin, const Motor &motor, const SpeedLoop &loop)
      : encoder(encoder_pin), motor_(motor), loop_(loop) {}

  void begin();

  // One step of the loop, every control_period, towards a speed in rad/s.
  void control(float commanded);

  // True if it is driven but does not turn, or its encoder fails: no pulse where several were due.
  bool blocked() const;

  Encoder encoder;

 private:
  void let_go(bool brake, uint32_t now);
  bool stands() const;

  Motor motor_;
  SpeedLoop loop_;
  float commanded_ = 0.0f;
  int8_t direction_ = 0;  // the way the wheel turns, 0 once it stands
  bool braking_ = false;    // shorted, to slow it down
  uint32_t let_go_at_ = 0;  // ms, when it was driven last, or since when it is braked
  uint32_t waiting_ = 0;    // ms, since when a driven wheel has given no pulse
};
