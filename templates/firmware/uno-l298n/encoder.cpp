#include "encoder.h"

#include <Arduino.h>
#include <util/atomic.h>

namespace {
// A wheel slower than this counts as standing, us from tick to tick.
constexpr uint32_t timeout = 500000;

// Ticks sooner than at four times the fastest speed allowed are noise.
constexpr uint32_t glitch = 1e6f * Encoder::angle * config::wheel_radius / (4 * config::wheel_speed_max);
}  // namespace

void Encoder::begin() {
  pinMode(pin_, INPUT_PULLUP);
  high_ = digitalRead(pin_);
}

void Encoder::edge() {
  const bool high = digitalRead(pin_);
  if (high == high_) return;  // gone again: a spike
  high_ = high;
  if (high == (direction_ < 0)) return;  // the other side of the slot
  const uint32_t now = micros();
  const uint32_t gap = now - ticked_at_;
  if (moving_ && gap < glitch) return;
  period_ = moving_ ? gap : 0;
  ticked_at_ = now;
  moving_ = true;
  ticks_ += direction_;
  ++passed_;
}

void Encoder::turns(int8_t direction) { direction_ = direction; }

int32_t Encoder::ticks() const {
  int32_t ticks;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { ticks = ticks_; }
  return ticks;
}

Encoder::Motion Encoder::measure() {
  uint32_t waiting, period;
  uint16_t passed;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    waiting = micros() - ticked_at_;
    if (waiting > timeout) moving_ = false;
    if (!moving_) period_ = 0;
    period = period_;
    passed = passed_;
    passed_ = 0;
  }
  const float into_slot = period == 0 ? 0.0f : waiting < period ? angle * waiting / period : angle;
  const float turned = passed * angle + into_slot - into_slot_;
  into_slot_ = into_slot;
  if (period < waiting && period) period = waiting;
  return {period ? 1e6f * angle / period : 0.0f, turned, passed != 0};
}

bool Encoder::ticked_within(uint32_t us) const {
  bool within;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { within = moving_ && micros() - ticked_at_ < us; }
  return within;
}
