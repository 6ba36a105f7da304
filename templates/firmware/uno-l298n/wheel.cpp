#include "wheel.h"

namespace {
// A wheel that is let go stands when it has not ticked for so long, ms: with its motor shorted, and with its ends open.
// If it were taken for standing too soon, it would roll over an edge that nobody counts.
constexpr uint32_t braked = 200;
constexpr uint32_t coasted = 1000;

// A driven one that does not tick for so long, s, or for that many slots at the speed commanded, is blocked.
constexpr float patience = 1.0f;
constexpr float slots = 3.0f;
constexpr float slowest = 0.01f;  // rad/s, that a command is taken for here
}  // namespace

void Wheel::begin() {
  motor_.begin();
  encoder.begin();
}

void Wheel::control(float commanded) {
  commanded_ = commanded;
  const Encoder::Motion measured = encoder.measure();
  const uint32_t now = millis();
  const int8_t wanted = commanded_ > 0.0f ? 1 : commanded_ < 0.0f ? -1 : 0;
  if (direction_ != wanted && direction_ != 0 && stands()) direction_ = 0;
  // The encoder does not measure the direction: a wheel has to stand before it may turn the other way, and until then
  // its edges belong to the way it turned.
  if (wanted == 0 || (direction_ != 0 && direction_ != wanted)) {
    let_go(config::brake || wanted != 0, now);
    waiting_ = now;
  } else {
    direction_ = wanted;
    braking_ = false;
    let_go_at_ = now;
    if (measured.ticked) waiting_ = now;
    motor_.drive(direction_, static_cast<uint8_t>(loop_.step(fabs(commanded_), measured.speed, measured.turned)));
  }
  encoder.turns(direction_);
}

void Wheel::let_go(bool brake, uint32_t now) {
  loop_.reset();
  if (brake != braking_) let_go_at_ = now;
  braking_ = brake;
  if (brake) {
    motor_.brake();
  } else {
    motor_.coast();
  }
}

bool Wheel::stands() const {
  const uint32_t enough = braking_ ? braked : coasted;
  return millis() - let_go_at_ > enough && !encoder.ticked_within(1000 * enough);
}

bool Wheel::blocked() const {
  if (commanded_ == 0.0f) return false;
  const float due = slots * Encoder::angle / fmax(fabs(commanded_), slowest);
  return millis() - waiting_ > static_cast<uint32_t>(1000.0f * fmax(due, patience));
}
