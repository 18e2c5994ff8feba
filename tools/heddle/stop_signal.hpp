#pragma once
#include <atomic>
#include <csignal>

namespace heddle {

/// While one is in scope, SIGINT and SIGTERM ask the work to stop at its next chance; before and after they do what they did.
class StopSignal {
 public:
  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();
  /// Set by the signals.
  [[nodiscard]] static const std::atomic<bool>& wanted();

 private:
  struct sigaction interrupt_before_ = {}, terminate_before_ = {};
};

}  // namespace heddle
