#include "encoder.h"

#include <Arduino.h>
#include <util/atomic.h>

#include "config.h"

namespace {
constexpr float angle = 6.2831853f / config::pulses_per_turn;  // from edge to edge

// A wheel slower than this counts as standing, us from edge to edge.
constexpr uint32_t timeout = 500000;

// Edges sooner than at four times the fastest speed allowed are noise.
constexpr uint32_t glitch = 1e6f * angle * config::wheel_radius / (4 * config::wheel_speed_max);
}  // namespace

void Encoder::begin() { pinMode(pin_, INPUT_PULLUP); }

void Encoder::edge() {
  if (digitalRead(pin_) == LOW) return;  // gone again: a spike
  const uint32_t now = micros();
  const uint32_t gap = now - edge_at_;
  if (moving_ && gap < glitch) return;
  period_ = moving_ ? gap : 0;
  edge_at_ = now;
  moving_ = true;
  ticks_ += direction_;
  ++edges_;
}

void Encoder::turns(int8_t direction) { direction_ = direction; }

int32_t Encoder::ticks() const {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { return ticks_; }
  return 0;  // not reached; the block above is a loop to the compiler
}

Encoder::Motion Encoder::measure() {
  uint32_t waiting, period;
  uint8_t edges;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    waiting = micros() - edge_at_;
    if (waiting > timeout) moving_ = false;
    if (!moving_) period_ = 0;
    period = period_;
    edges = edges_;
    edges_ = 0;
  }
  const float into_slot = period == 0 ? 0.0f : waiting < period ? angle * waiting / period : angle;
  const float turned = edges * angle + into_slot - into_slot_;
  into_slot_ = into_slot;
  if (period < waiting && period) period = waiting;
  return {period ? 1e6f * angle / period : 0.0f, turned};
}

bool Encoder::edge_within(uint32_t us) const {
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { return moving_ && micros() - edge_at_ < us; }
  return true;  // not reached
}
