#include "kinematics.h"

#include <math.h>

#include "config.h"

namespace {
constexpr float absurd = 1000.0f;  // m/s or rad/s

bool sane(float speed) { return isfinite(speed) && fabs(speed) < absurd; }
}  // namespace

WheelSpeeds wheel_speeds(float v, float omega) {
  if (!sane(v) || !sane(omega)) return {0.0f, 0.0f};
  constexpr float lever = config::wheel_separation / 2;
  constexpr float limit = config::wheel_speed_max / config::wheel_radius;
  const float left = wheel_speed(v, omega, -lever, config::wheel_radius);
  const float right = wheel_speed(v, omega, lever, config::wheel_radius);
  const float fastest = fmax(fabs(left), fabs(right));
  const float scale = fastest > limit ? limit / fastest : 1.0f;
  return {left * scale, right * scale};
}

WheelSpeeds approach(WheelSpeeds from, WheelSpeeds to) {
  constexpr float step = config::acceleration_max * config::control_period / config::wheel_radius;
  const float way = fmax(fabs(to.left - from.left), fabs(to.right - from.right));
  if (way <= step || (to.left == 0.0f && to.right == 0.0f)) return to;
  const float part = step / way;
  return {from.left + part * (to.left - from.left), from.right + part * (to.right - from.right)};
}
