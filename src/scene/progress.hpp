// SPDX-License-Identifier: Apache-2.0
//
// A progress line for people who wait at a terminal.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

namespace zkd::scene {

/// Draws `label  42 %` on stderr while work goes on and takes it away when it is done.
///
/// Nothing is ever written unless stderr is a terminal, so logs and pipes stay clean. Redrawn at
/// most ten times a second, first after a tenth of a second: short work shows nothing. Work whose
/// length is not known shows `label ...` at once.
class Progress {
 public:
  /// `total` counts whatever advance() counts (bytes, rays, ...); 0: it is not known.
  Progress(std::string label, std::uint64_t total);

  /// finish().
  ~Progress();

  Progress(const Progress&) = delete;  // one line on the terminal has one owner
  Progress& operator=(const Progress&) = delete;

  /// `amount` more is done. Any thread may call it; costs an atomic addition and a look at the
  /// clock, so call it for batches.
  void advance(std::uint64_t amount) noexcept;

  /// Clears the line. To be called once all threads are done; later calls do nothing.
  void finish() noexcept;

 private:
  void draw(std::uint64_t done) noexcept;

  std::string label_;
  std::uint64_t total_;
  bool shown_;
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::int64_t> next_draw_ns_;
  std::atomic<bool> drawn_{false};
};

}  // namespace zkd::scene
