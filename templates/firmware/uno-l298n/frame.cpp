#include "frame.h"

#include "config.h"

namespace {
// A frame has to be complete within this time, ms: 20 as rosserial has it, and twice the time of the longest frame.
constexpr uint32_t longest = 2 * 10 * 1000 * (FrameReader::capacity + 8UL) / config::baud;
constexpr uint32_t window = longest > 20 ? longest : 20;
}  // namespace

bool FrameReader::take(uint8_t byte, uint32_t now) {
  if (state_ != State::kSync && now - started_ > window) state_ = State::kSync;
  switch (state_) {
    case State::kSync:
      drop(byte, now);
      return false;
    case State::kVersion:
      if (byte == 0xfe) {
        state_ = State::kLengthLow;
      } else {
        drop(byte, now);
      }
      return false;
    case State::kLengthLow:
      length_ = byte;
      sum_ = byte;
      state_ = State::kLengthHigh;
      return false;
    case State::kLengthHigh:
      length_ |= static_cast<uint16_t>(byte) << 8;
      sum_ += byte;
      state_ = State::kLengthCheck;
      return false;
    case State::kLengthCheck:
      sum_ += byte;
      if (sum_ == 0xff && length_ <= capacity) {
        state_ = State::kIdLow;
      } else {
        drop(byte, now);
      }
      return false;
    case State::kIdLow:
      id_ = byte;
      sum_ = byte;
      state_ = State::kIdHigh;
      return false;
    case State::kIdHigh:
      id_ |= static_cast<uint16_t>(byte) << 8;
      sum_ += byte;
      index_ = 0;
      state_ = length_ ? State::kPayload : State::kCheck;
      return false;
    case State::kPayload:
      payload_[index_++] = byte;
      sum_ += byte;
      if (index_ == length_) state_ = State::kCheck;
      return false;
    case State::kCheck:
      sum_ += byte;
      if (sum_ == 0xff) {
        state_ = State::kSync;
        return true;
      }
      drop(byte, now);
      return false;
  }
  return false;
}

void FrameReader::drop(uint8_t byte, uint32_t now) {
  state_ = byte == 0xff ? State::kVersion : State::kSync;
  started_ = now;
}
