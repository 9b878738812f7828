// SPDX-License-Identifier: Apache-2.0
// Loops of a sampled device and of elements that stick and slip, simulated until they are still. Reads and
// writes doubles in binary; benchmarks/rest_loops.py draws the loops and reads the answer.
//   g++ -std=c++20 -O2 benchmarks/rest_loops.cpp -o rest_loops && ./rest_loops < loops > answers
#include <algorithm>
#include <array>
#include <cstdio>

namespace {

constexpr int elements = 4, max_delay = 4;

/// One loop, as Python writes it.
struct Loop {
  double change[3][3], push[3];  // of the state (depth, velocity, force of the actuator) over a cycle
  double delay, braking;         // cycles; damping of the controller over the cycle [N/m]
  double stiffness[elements], low[elements], high[elements];
  double state[3], force[elements];
  double still, window, cycles;  // range of the force at rest [N]; cycles of a window and of the whole run
};

/// What Python reads: range of the force [N] in the last two windows, and the cycles that were run.
struct Answer {
  double before, after, cycles;
};

class Running {
 public:
  explicit Running(const Loop& loop) : loop_(loop), last_(loop.state[0]) {
    double total = 0.0;
    for (const double force : loop_.force) total += force;
    waiting_.fill(total);
  }
  /// One cycle; returns the force [N].
  double step() {
    const double tip = loop_.state[0], travel = tip - last_;
    double total = 0.0;
    for (int i = 0; i < elements; ++i) {
      loop_.force[i] = std::clamp(loop_.force[i] + loop_.stiffness[i] * travel, loop_.low[i], loop_.high[i]);
      total += loop_.force[i];
    }
    last_ = tip;
    std::copy_backward(waiting_.begin(), waiting_.end() - 1, waiting_.end());
    waiting_[0] = total + loop_.braking * travel;
    move(waiting_[static_cast<std::size_t>(loop_.delay)]);
    return total;
  }

 private:
  void move(double arrived) {
    const auto& s = loop_.state;
    const std::array old{s[0], s[1], s[2]};
    for (int i = 0; i < 3; ++i) {
      const auto& row = loop_.change[i];
      loop_.state[i] += row[0] * old[0] + row[1] * old[1] + row[2] * old[2] + loop_.push[i] * arrived;
    }
  }

  Loop loop_;
  double last_;
  std::array<double, max_delay> waiting_{};
};

Answer run(const Loop& loop) {
  Running running(loop);
  Answer answer{0.0, 1e300, 0.0};
  while (answer.cycles < loop.cycles) {
    double low = 1e300, high = -1e300;
    for (double i = 0.0; i < loop.window; i += 1.0) {
      const double force = running.step();
      low = std::min(low, force);
      high = std::max(high, force);
    }
    answer = {answer.after, high - low, answer.cycles + loop.window};
    if (answer.after <= loop.still && answer.before <= loop.still) break;
  }
  return answer;
}

}  // namespace

int main() {
  Loop loop;
  while (std::fread(&loop, sizeof loop, 1, stdin) == 1) {
    const Answer answer = run(loop);
    std::fwrite(&answer, sizeof answer, 1, stdout);
  }
}
