// SPDX-License-Identifier: Apache-2.0
//
// The progress line: a clock that threads race for, and one write to stderr.
#include "scene/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <utility>

namespace zkd::scene {
namespace {

constexpr std::int64_t redraw_ns = 100'000'000;

std::int64_t now_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Progress::Progress(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(total),
      shown_(isatty(STDERR_FILENO) == 1),
      next_draw_ns_(shown_ ? now_ns() + redraw_ns : 0) {
  if (shown_ && total_ == 0) draw(0);
}

Progress::~Progress() { finish(); }

void Progress::advance(std::uint64_t amount) noexcept {
  if (!shown_) return;
  const std::uint64_t done = done_.fetch_add(amount, std::memory_order_relaxed) + amount;
  const std::int64_t now = now_ns();
  std::int64_t due = next_draw_ns_.load(std::memory_order_relaxed);
  // Of the threads that find the line due, one draws.
  if (now < due || !next_draw_ns_.compare_exchange_strong(due, now + redraw_ns)) return;
  draw(done);
}

void Progress::draw(std::uint64_t done) noexcept {
  drawn_.store(true, std::memory_order_relaxed);
  if (total_ == 0) {
    std::fprintf(stderr, "\r%s ...\033[K", label_.c_str());
  } else {
    const double percent =
        100.0 * static_cast<double>(std::min(done, total_)) / static_cast<double>(total_);
    std::fprintf(stderr, "\r%s %3d %%\033[K", label_.c_str(), static_cast<int>(percent));
  }
  std::fflush(stderr);
}

void Progress::finish() noexcept {
  if (drawn_.exchange(false)) {
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
  }
}

}  // namespace zkd::scene
