#include "wheel.h"

namespace {
// A braked wheel without an edge for so long stands, ms.
constexpr uint32_t standstill = 100;

// A driven one without an edge for so long, s, or for that many slots at the speed ordered, is blocked.
constexpr float patience = 1.0f;
constexpr float slots = 3.0f;
constexpr float slowest = 0.01f;  // rad/s, that an order is taken for here
}  // namespace

void Wheel::begin() {
  motor_.begin();
  encoder.begin();
}

void Wheel::control(float ordered) {
  ordered_ = ordered;
  const Encoder::Motion measured = encoder.measure();
  const uint32_t now = millis();
  const int8_t wanted = ordered_ > 0.0f ? 1 : ordered_ < 0.0f ? -1 : 0;
  if (direction_ != wanted && direction_ != 0 && stands()) direction_ = 0;
  // The encoder does not tell the direction: a wheel has to stand before it may turn the other way, and until then
  // its edges belong to the way it turned.
  if (wanted == 0 || (direction_ != 0 && direction_ != wanted)) {
    stop();
    waiting_ = now;
  } else {
    direction_ = wanted;
    driven_at_ = now;
    if (measured.edges) waiting_ = now;
    motor_.drive(direction_, static_cast<uint8_t>(loop_.step(fabs(ordered_), measured.speed, measured.turned)));
  }
  encoder.turns(direction_);
}

void Wheel::stop() {
  loop_.reset();
  if (config::brake || ordered_ != 0.0f) {
    motor_.brake();
  } else {
    motor_.coast();
  }
}

bool Wheel::stands() const {
  return millis() - driven_at_ > standstill && !encoder.edge_within(1000 * standstill);
}

bool Wheel::blocked() const {
  if (ordered_ == 0.0f) return false;
  const float due = slots * Encoder::angle / fmax(fabs(ordered_), slowest);
  return millis() - waiting_ > static_cast<uint32_t>(1000.0f * fmax(due, patience));
}
