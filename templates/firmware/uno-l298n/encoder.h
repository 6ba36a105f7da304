// A slotted disc behind a light barrier: one pulse a slot, which does not tell the direction.
#pragma once

#include <stdint.h>

#include "config.h"

class Encoder {
 public:
  static constexpr float angle = 6.2831853f / config::pulses_per_turn;  // rad from edge to edge

  explicit Encoder(uint8_t pin) : pin_(pin) {}

  void begin();

  // From the interrupt of a rising edge.
  void edge();

  // The way in which the motor turns the wheel now, and so the sign of the edges: 1, -1, or 0 for a wheel that
  // stands, whose edges are the trembling of a disc that stopped in the middle of one.
  void turns(int8_t direction);

  // Edges since the start, signed.
  int32_t ticks() const;

  // What has been measured, without sign.
  struct Motion {
    float speed;   // rad/s, from the time between the last two edges; less when the next one is overdue
    float turned;  // rad since the last call, the way into the slot that is passing now included
    bool edges;    // since the last call
  };
  Motion measure();

  // Whether an edge came within the last `us` microseconds.
  bool edge_within(uint32_t us) const;

 private:
  uint8_t pin_;
  volatile int8_t direction_ = 0;
  volatile bool moving_ = false;     // there was an edge, not long ago
  volatile uint32_t edge_at_ = 0;    // us
  volatile uint32_t period_ = 0;     // us between the last two edges, 0 if unknown
  volatile int32_t ticks_ = 0;
  volatile uint8_t edges_ = 0;  // since the last call of measure
  float into_slot_ = 0.0f;      // rad, at that call
};
