// The board's end of the protocol that `wheel_board.py` describes: it needs nothing of Arduino, and is tested on a PC.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace wheel_board {

constexpr uint8_t VERSION = 1;
constexpr uint8_t HELLO = 0x01, DRIVE = 0x02, BOARD_HELLO = 0x81, BOARD_STATE = 0x82;
constexpr uint8_t GREETED = 1, FAILED = 2, STANDS = 4;
constexpr uint8_t START = 0x7E;
constexpr uint8_t LONGEST = 32;           // bytes of a payload
constexpr size_t FRAME = LONGEST + 6;     // bytes of the longest frame
constexpr uint16_t SILENCE = 200;         // [ms] without a `drive`, after which the motors stop
constexpr float PATIENCE = 0.3f;          // [s] for which a wheel may turn the wrong way, or stand at full power
constexpr uint16_t CRC_BEGIN = 0xFFFF;

inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  crc ^= static_cast<uint16_t>(byte) << 8;
  for (uint8_t bit = 0; bit < 8; ++bit) {
    crc = static_cast<uint16_t>(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
  }
  return crc;
}

struct Speeds {  // [ticks/s]
  int16_t left = 0;
  int16_t right = 0;
};

// Finds frames in bytes, one at a time; after a wrong checksum it looks for the next start among the same bytes.
class FrameReader {
 public:
  // Takes a byte; returns true while a whole frame is there: take it, and call `next` until that returns false.
  bool take(uint8_t byte) {
    if (length_ == sizeof(bytes_)) {
      drop(1);
    }
    bytes_[length_++] = byte;
    return find();
  }

  bool next() {
    drop(bytes_[1] + 6u);
    return find();
  }

  uint8_t type() const { return bytes_[3]; }
  uint8_t size() const { return bytes_[1]; }
  const uint8_t* payload() const { return bytes_ + 4; }

 private:
  bool find() {
    while (length_ > 0) {
      if (bytes_[0] != START || (length_ > 1 && bytes_[1] > LONGEST)) {
        drop(1);
        continue;
      }
      if (length_ < 2 || length_ < bytes_[1] + 6u) {
        return false;
      }
      const uint8_t end = bytes_[1] + 4;
      uint16_t crc = CRC_BEGIN;
      for (uint8_t at = 1; at < end; ++at) {
        crc = crc16(crc, bytes_[at]);
      }
      if ((crc & 0xFF) == bytes_[end] && (crc >> 8) == bytes_[end + 1]) {
        return true;
      }
      drop(1);
    }
    return false;
  }

  void drop(size_t count) {
    length_ = static_cast<uint8_t>(length_ - count);
    for (uint8_t at = 0; at < length_; ++at) {
      bytes_[at] = bytes_[at + count];
    }
  }

  uint8_t bytes_[FRAME] = {};
  uint8_t length_ = 0;
};

// What the board decides. Times are those of `millis()`, which may begin again at 0.
class Board {
 public:
  // Takes a byte from the host.
  void take(uint8_t byte, uint32_t now) {
    for (bool is_whole = reader_.take(byte); is_whole; is_whole = reader_.next()) {
      obey(now);
    }
  }

  // The speeds that the wheels should have now.
  Speeds wanted(uint32_t now) {
    if (is_driven_ && now - heard_ > SILENCE) {
      is_driven_ = false;  // and not again when the clock has gone round
    }
    return is_driven_ && !has_failed_ && !is_blocked_ ? speeds_ : Speeds();
  }

  // Stops the motors for good: one of them has failed. Only a restart of the board forgets that.
  void fail() { has_failed_ = true; }

  // Stops the motors until the host wants both wheels to rest: one of them is blocked.
  void block() { is_blocked_ = true; }

  // Writes a hello into `out`, if the host wants one; returns how many bytes it has.
  size_t hello(uint8_t* out) {
    if (!wants_hello_) {
      return 0;
    }
    wants_hello_ = false;
    const uint8_t payload[] = {VERSION, SILENCE & 0xFF, SILENCE >> 8};
    return frame(out, BOARD_HELLO, payload, sizeof(payload));
  }

  // Writes the state into `out`, 50 times a second; returns how many bytes it has.
  size_t state(uint8_t* out, int32_t left, int32_t right, uint16_t millivolts) {
    const uint32_t positions[] = {static_cast<uint32_t>(left), static_cast<uint32_t>(right)};
    uint8_t payload[11];
    for (uint8_t at = 0; at < 8; ++at) {
      payload[at] = static_cast<uint8_t>(positions[at / 4] >> (8 * (at % 4)));
    }
    payload[8] = static_cast<uint8_t>(millivolts & 0xFF);
    payload[9] = static_cast<uint8_t>(millivolts >> 8);
    const bool is_failed = has_failed_ || is_blocked_;
    payload[10] = (is_greeted_ ? GREETED : 0) | (is_failed ? FAILED : 0) | (is_driven_ ? 0 : STANDS);
    return frame(out, BOARD_STATE, payload, sizeof(payload));
  }

 private:
  void obey(uint32_t now) {
    const uint8_t* payload = reader_.payload();
    if (reader_.type() == HELLO && reader_.size() == 1) {
      wants_hello_ = true;
      is_greeted_ = payload[0] == VERSION;
      is_driven_ = false;
    } else if (reader_.type() == DRIVE && reader_.size() == 4 && is_greeted_) {
      speeds_.left = number(payload);
      speeds_.right = number(payload + 2);
      heard_ = now;
      is_driven_ = true;
      is_blocked_ = is_blocked_ && (speeds_.left != 0 || speeds_.right != 0);
    }
  }

  static int16_t number(const uint8_t* bytes) {
    return static_cast<int16_t>(static_cast<uint16_t>(bytes[0]) | static_cast<uint16_t>(bytes[1]) << 8);
  }

  size_t frame(uint8_t* out, uint8_t type, const uint8_t* payload, uint8_t size) {
    out[0] = START;
    out[1] = size;
    out[2] = number_++;
    out[3] = type;
    for (uint8_t at = 0; at < size; ++at) {
      out[4 + at] = payload[at];
    }
    uint16_t crc = CRC_BEGIN;
    for (uint8_t at = 1; at < size + 4; ++at) {
      crc = crc16(crc, out[at]);
    }
    out[size + 4] = static_cast<uint8_t>(crc & 0xFF);
    out[size + 5] = static_cast<uint8_t>(crc >> 8);
    return size + 6u;
  }

  FrameReader reader_;
  Speeds speeds_;
  uint32_t heard_ = 0;
  uint8_t number_ = 0;
  bool is_greeted_ = false, is_driven_ = false, has_failed_ = false, is_blocked_ = false, wants_hello_ = false;
};

// A PI controller of one wheel, from speeds [ticks/s] to a PWM of -255 to 255; at 0 the motor is off.
class WheelControl {
 public:
  WheelControl(float feed, float proportional, float integral) : feed_(feed), p_(proportional), i_(integral) {}

  int16_t update(int16_t wanted, int32_t ticks, float dt) {
    const int32_t turned = is_known_ ? ticks - ticks_ : 0;
    const float measured = dt > 0.0f ? static_cast<float>(turned) / dt : 0.0f;
    ticks_ = ticks;
    is_known_ = true;
    if (wanted == 0) {
      sum_ = against_ = blocked_ = 0.0f;
      return 0;
    }
    const float error = static_cast<float>(wanted) - measured;
    sum_ = within(sum_ + i_ * error * dt);
    const int16_t power = static_cast<int16_t>(within(feed_ * static_cast<float>(wanted) + p_ * error + sum_));
    watch(wanted > 0 ? turned : -turned, wanted > 0 ? power : -power, dt);
    return power;
  }

  // Whether it turns the wrong way: its encoder or its motor is swapped.
  bool is_swapped() const { return against_ > PATIENCE; }

  // Whether it stands at full power: it is held, or its motor or its encoder is dead.
  bool is_blocked() const { return blocked_ > PATIENCE; }

 private:
  static float within(float value) { return value > 255.0f ? 255.0f : value < -255.0f ? -255.0f : value; }

  // Takes how far it has turned, and its power, in the wanted direction. One that slows down turned that way before.
  void watch(int32_t turned, int power, float dt) {
    blocked_ = turned == 0 && power == 255 ? blocked_ + dt : 0.0f;
    if (turned > 0 || power <= 0 || (turned < 0 && (against_ == 0.0f || turned > slowest_))) {
      slowest_ = turned;
      against_ = 0.0f;
    }
    against_ += turned < 0 && power > 0 ? dt : 0.0f;
  }

  float feed_, p_, i_;
  float sum_ = 0.0f, against_ = 0.0f, blocked_ = 0.0f;  // the last two: for how long [s]
  int32_t ticks_ = 0, slowest_ = 0;
  bool is_known_ = false;
};

}  // namespace wheel_board
