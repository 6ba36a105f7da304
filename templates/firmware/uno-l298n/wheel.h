// A wheel with its motor, its encoder and the loop between them.
#pragma once

#include "encoder.h"
#include "motor.h"
#include "pi.h"

class Wheel {
 public:
  Wheel(uint8_t encoder_pin, const Motor &motor, float pwm_min) : encoder(encoder_pin), motor_(motor), loop_(pwm_min) {}

  void begin();

  // The speed to hold from now on, rad/s.
  void order(float speed) { ordered_ = speed; }

  // One step of the loop, every control_period.
  void control();

  Encoder encoder;

 private:
  void stop();
  bool stands() const;

  Motor motor_;
  SpeedLoop loop_;
  float ordered_ = 0.0f;
  int8_t direction_ = 0;  // the way the wheel turns, 0 once it stands
  uint32_t driven_at_ = 0;  // us
};
