// Doubles as they come over the wire; the board's own `double` has 32 bits.
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>

// A little-endian float64, rounded towards zero. NAN for what is no number or too large; 0 for what is too small.
inline float read_float64(const uint8_t *bytes) {
  const int16_t exponent = static_cast<int16_t>((bytes[7] & 0x7f) << 4 | bytes[6] >> 4) - 1023 + 127;
  if (exponent >= 255) return NAN;
  if (exponent <= 0) return 0.0f;
  const uint32_t bits = static_cast<uint32_t>(bytes[7] & 0x80) << 24 | static_cast<uint32_t>(exponent) << 23 |
                        static_cast<uint32_t>(bytes[6] & 0x0f) << 19 | static_cast<uint32_t>(bytes[5]) << 11 |
                        static_cast<uint32_t>(bytes[4]) << 3 | bytes[3] >> 5;
  float value;
  memcpy(&value, &bits, sizeof value);
  return value;
}
