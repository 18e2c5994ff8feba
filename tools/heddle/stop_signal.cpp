#include "heddle/stop_signal.hpp"

namespace heddle {
namespace {

std::atomic<bool> stop_wanted = false;

void on_signal(int) {
  stop_wanted = true;
}

}  // namespace

StopSignal::StopSignal() {
  stop_wanted = false;
  struct sigaction action = {};
  action.sa_handler = on_signal;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &interrupt_before_);
  sigaction(SIGTERM, &action, &terminate_before_);
}

StopSignal::~StopSignal() {
  sigaction(SIGINT, &interrupt_before_, nullptr);
  sigaction(SIGTERM, &terminate_before_, nullptr);
}

const std::atomic<bool>& StopSignal::wanted() {
  return stop_wanted;
}

}  // namespace heddle
