// Two motors with encoders, for `type: serial_base`. Fit the pins and the numbers below to your board.
// Interrupts: on an Uno only pins 2 and 3 have them, so that each encoder counts the edges of its first channel.
#include "wheel_board.h"

struct Wheel {
  uint8_t encoder_a, encoder_b, forwards, backwards, pwm;
};

constexpr Wheel LEFT = {2, 4, 7, 8, 5};
constexpr Wheel RIGHT = {3, 11, 12, 13, 6};
constexpr uint8_t BATTERY = A0;
constexpr float MILLIVOLTS_PER_STEP = 5000.0f / 1023.0f * 3.0f;  // of a divider by 3
constexpr uint32_t PERIOD = 20;                                  // [ms]

wheel_board::Board board;
wheel_board::WheelControl left_control(0.1f, 0.05f, 0.5f), right_control(0.1f, 0.05f, 0.5f);
volatile int32_t left_ticks = 0, right_ticks = 0;
uint32_t last = 0;

void count_left() { left_ticks += digitalRead(LEFT.encoder_a) == digitalRead(LEFT.encoder_b) ? 1 : -1; }
void count_right() { right_ticks += digitalRead(RIGHT.encoder_a) == digitalRead(RIGHT.encoder_b) ? 1 : -1; }

void set_up(const Wheel& wheel) {
  pinMode(wheel.encoder_a, INPUT_PULLUP);
  pinMode(wheel.encoder_b, INPUT_PULLUP);
  pinMode(wheel.forwards, OUTPUT);
  pinMode(wheel.backwards, OUTPUT);
  pinMode(wheel.pwm, OUTPUT);
}

void turn(const Wheel& wheel, int16_t power) {
  digitalWrite(wheel.forwards, power > 0 ? HIGH : LOW);
  digitalWrite(wheel.backwards, power < 0 ? HIGH : LOW);
  analogWrite(wheel.pwm, power < 0 ? -power : power);
}

void setup() {
  set_up(LEFT);
  set_up(RIGHT);
  turn(LEFT, 0);
  turn(RIGHT, 0);
  attachInterrupt(digitalPinToInterrupt(LEFT.encoder_a), count_left, CHANGE);
  attachInterrupt(digitalPinToInterrupt(RIGHT.encoder_a), count_right, CHANGE);
  Serial.begin(115200);
}

void loop() {
  const uint32_t now = millis();
  while (Serial.available() > 0) {
    board.take(static_cast<uint8_t>(Serial.read()), now);
  }
  if (now - last < PERIOD) {
    return;
  }
  const float dt = (now - last) / 1000.0f;
  last = now;
  noInterrupts();
  const int32_t left = left_ticks, right = right_ticks;
  interrupts();
  const wheel_board::Speeds wanted = board.wanted(now);
  turn(LEFT, left_control.update(wanted.left, left, dt));
  turn(RIGHT, right_control.update(wanted.right, right, dt));
  if (left_control.is_swapped() || right_control.is_swapped()) {
    board.fail();
  }
  if (left_control.is_blocked() || right_control.is_blocked()) {
    board.block();
  }
  uint8_t out[wheel_board::FRAME];
  Serial.write(out, board.hello(out));
  const float steps = analogRead(BATTERY);
  Serial.write(out, board.state(out, left, right, static_cast<uint16_t>(steps * MILLIVOLTS_PER_STEP)));
}
