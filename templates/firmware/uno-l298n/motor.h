// One half of an L298N: an enable pin with PWM, and two pins for the direction. Its jumper on the enable pin is off.
#pragma once

#include <Arduino.h>

class Motor {
 public:
  Motor(uint8_t enable, uint8_t forward, uint8_t backward) : enable_(enable), forward_(forward), backward_(backward) {}

  void begin() const {
    const uint8_t pins[] = {enable_, forward_, backward_};
    for (const uint8_t pin : pins) {
      digitalWrite(pin, LOW);
      pinMode(pin, OUTPUT);
    }
  }

  void drive(int8_t direction, uint8_t pwm) const {
    digitalWrite(direction > 0 ? backward_ : forward_, LOW);  // first, so that both are never high
    digitalWrite(direction > 0 ? forward_ : backward_, HIGH);
    analogWrite(enable_, pwm);
  }

  void brake() const {  // both ends of the motor on the same side
    digitalWrite(forward_, LOW);
    digitalWrite(backward_, LOW);
    digitalWrite(enable_, HIGH);
  }

  void coast() const {
    digitalWrite(enable_, LOW);
    digitalWrite(forward_, LOW);
    digitalWrite(backward_, LOW);
  }

 private:
  uint8_t enable_, forward_, backward_;
};
