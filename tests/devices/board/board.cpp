// The core of the sketch on a PC, with motors that follow their power in 50 ms and stand at once without any. It is
// stepped: each request on its input is the time [ms, u32], how many bytes follow (u16), and these; the answer is how
// many bytes the board sends (u16), and these. Its argument may be faults of the left wheel: `swapped` or
// `dead`, and `mute` if the board is to overlook them. With the number of an open descriptor it runs in real time on that.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <poll.h>
#include <unistd.h>

#include "../../../rbxcompose/domains/bases/sketch/wheel_board/wheel_board.h"

using namespace wheel_board;

// A motor with its encoder: 10 ticks/s for each step of its power.
struct Motor {
  WheelControl control{0.1f, 0.05f, 0.5f};
  double speed = 0, position = 0;
  bool is_swapped = false, is_dead = false;

  int32_t ticks() const { return static_cast<int32_t>(is_swapped ? -position : position); }

  void turn(int16_t wanted, double dt) {
    const int16_t power = control.update(wanted, ticks(), static_cast<float>(dt));
    const double goal = is_dead ? 0.0 : power * 10.0;
    speed = power == 0 ? 0.0 : speed + (goal - speed) * (dt < 0.05 ? dt / 0.05 : 1.0);
    position += speed * dt;
  }
};

struct Machine {
  Board board;
  Motor left, right;
  uint32_t last = 0;
  bool is_mute = false;  // a board of others, which never says that a motor has failed

  void plant(const char* fault) {
    is_mute = std::strstr(fault, "mute") != nullptr;
    left.is_swapped = std::strstr(fault, "swapped") != nullptr;
    left.is_dead = std::strstr(fault, "dead") != nullptr;
  }

  size_t step(uint32_t now, uint8_t* out) {
    const Speeds wanted = board.wanted(now);
    const double dt = (now - last) / 1000.0;
    last = now;
    left.turn(wanted.left, dt);
    right.turn(wanted.right, dt);
    if (!is_mute && (left.control.is_swapped() || right.control.is_swapped())) {
      board.fail();
    }
    if (!is_mute && (left.control.is_blocked() || right.control.is_blocked())) {
      board.block();
    }
    const size_t size = board.hello(out);
    return size + board.state(out + size, left.ticks(), right.ticks(), 7400);
  }
};

static int stepped(const char* fault) {
  Machine machine;
  machine.plant(fault);
  uint8_t head[6], data[65536], out[2 * FRAME];
  while (std::fread(head, 1, 6, stdin) == 6) {
    uint32_t now;
    uint16_t count;
    std::memcpy(&now, head, 4);
    std::memcpy(&count, head + 4, 2);
    if (std::fread(data, 1, count, stdin) != count) {
      return 1;
    }
    for (uint16_t at = 0; at < count; ++at) {
      machine.board.take(data[at], now);
    }
    const uint16_t size = static_cast<uint16_t>(machine.step(now, out));
    std::fwrite(&size, 2, 1, stdout);
    std::fwrite(out, 1, size, stdout);
    std::fflush(stdout);
  }
  return 0;
}

static int real(int port) {
  Machine machine;
  const auto start = std::chrono::steady_clock::now();
  const auto millis = [&] {
    const auto passed = std::chrono::steady_clock::now() - start;
    return static_cast<uint32_t>(std::chrono::duration_cast<std::chrono::milliseconds>(passed).count());
  };
  uint8_t data[256], out[2 * FRAME];
  for (;;) {
    pollfd ready = {port, POLLIN, 0};
    const int left = static_cast<int>(machine.last + 20 - millis());
    if (poll(&ready, 1, left > 0 ? left : 0) > 0) {
      const ssize_t count = read(port, data, sizeof(data));
      if (count <= 0) {
        return 0;
      }
      for (ssize_t at = 0; at < count; ++at) {
        machine.board.take(data[at], millis());
      }
    }
    if (millis() - machine.last >= 20) {
      const size_t size = machine.step(millis(), out);
      if (write(port, out, size) < 0) {
        return 0;
      }
    }
  }
}

int main(int count, char** words) {
  const int port = count > 1 ? std::atoi(words[1]) : 0;
  return port > 0 ? real(port) : stepped(count > 1 ? words[1] : "");
}
