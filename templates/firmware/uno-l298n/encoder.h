// A slotted disc behind a light barrier: one pulse a slot, without the direction.
//
// One side of each slot is counted: the edge that rises as the wheel turns forward, and falls as it turns back. If it
// were the rising edge both ways, each reversal would add up to half a tick, with the same sign as often as not.
#pragma once

#include <stdint.h>

#include "config.h"

class Encoder {
 public:
  static constexpr float angle = 6.2831853f / config::pulses_per_turn;  // rad from tick to tick

  explicit Encoder(uint8_t pin) : pin_(pin) {}

  void begin();

  // From the interrupt of either edge.
  void edge();

  // The way in which the motor turns the wheel now, and so the sign of the ticks: 1, -1, or 0 for a wheel that
  // stands, whose edges are the trembling of a disc that stopped in the middle of one.
  void turns(int8_t direction);

  // Since the start, signed.
  int32_t ticks() const;

  // What has been measured, without sign.
  struct Motion {
    float speed;   // rad/s, from the time between the last two ticks; less when the next one is overdue
    float turned;  // rad since the last call, the way into the slot that is passing now included
    bool ticked;   // since the last call
  };
  Motion measure();

  // Whether it ticked within the last `us` microseconds, half a second at the most.
  bool ticked_within(uint32_t us) const;

 private:
  uint8_t pin_;
  volatile int8_t direction_ = 0;
  volatile bool high_ = false;       // the pin, after its last edge
  volatile bool moving_ = false;     // it ticked, not long ago
  volatile uint32_t ticked_at_ = 0;  // us
  volatile uint32_t period_ = 0;     // us between the last two ticks, 0 if unknown
  volatile int32_t ticks_ = 0;
  volatile uint16_t passed_ = 0;  // ticks since the last call of measure
  float into_slot_ = 0.0f;        // rad, at that call
};
