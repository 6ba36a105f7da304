#include "wheel.h"

namespace {
// A braked wheel without an edge for so long stands, us.
constexpr uint32_t standstill = 100000;
}  // namespace

void Wheel::begin() {
  motor_.begin();
  encoder.begin();
}

void Wheel::control() {
  const Encoder::Motion measured = encoder.measure();
  const int8_t wanted = ordered_ > 0.0f ? 1 : ordered_ < 0.0f ? -1 : 0;
  if (direction_ != wanted && direction_ != 0 && stands()) direction_ = 0;
  // The encoder does not tell the direction: a wheel has to stand before it may turn the other way, and until then
  // its edges belong to the way it turned.
  if (wanted == 0 || (direction_ != 0 && direction_ != wanted)) {
    stop();
  } else {
    direction_ = wanted;
    driven_at_ = micros();
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

bool Wheel::stands() const { return micros() - driven_at_ > standstill && !encoder.edge_within(standstill); }
