// The core of the sketch on a PC, with ideal motors. Without arguments it is stepped: each request on its input is the
// time [ms, u32], how many bytes follow (u16), and these; the answer is how many bytes the board sends (u16), and these.
// With the number of an open descriptor it runs in real time on that.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include <poll.h>
#include <unistd.h>

#include "../../../rbxcompose/domains/bases/sketch/wheel_board/wheel_board.h"

using namespace wheel_board;

struct Machine {
  Board board;
  double left = 0, right = 0;
  uint32_t last = 0;

  size_t step(uint32_t now, uint8_t* out) {
    const Speeds speeds = board.wanted(now);
    const double dt = (now - last) / 1000.0;
    last = now;
    left += speeds.left * dt;
    right += speeds.right * dt;
    const size_t size = board.hello(out);
    return size + board.state(out + size, static_cast<int32_t>(left), static_cast<int32_t>(right), 7400);
  }
};

static int stepped() {
  Machine machine;
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

int main(int count, char** words) { return count > 1 ? real(std::atoi(words[1])) : stepped(); }
