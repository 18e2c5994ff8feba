#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#include "regression/busy_tangle.hpp"

namespace {
std::atomic<std::size_t> allocations = 0;
}

// The linker sends what the library asks of the C library here (--wrap).
extern "C" {
void* __real_malloc(std::size_t size);
void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
int __real_posix_memalign(void** memory, std::size_t alignment, std::size_t size);
int __wrap_posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  ++allocations;
  return __real_posix_memalign(memory, alignment, size);
}
}

void* operator new(std::size_t size) {
  if (void* memory = malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept {
  free(memory);
}
void operator delete(void* memory, std::size_t /*size*/) noexcept {
  free(memory);
}

namespace {

using namespace scenes;

TEST(allocation, is_counted) {
  const std::size_t before = allocations;
  const std::vector<int> numbers(1000);
  EXPECT_GT(allocations, before);
  const std::size_t plain = allocations;
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(numbers.size()));
  EXPECT_GT(allocations, plain);
}

TEST(allocation, none_in_a_step) {
  Scene scene = busy_tangle();
  for (const bool implicit_axial : {false, true}) {
    scene.model.implicit_axial = implicit_axial;
    weave::Engine engine = scene.engine();
    const weave::Drive drive = at_rest(scene.model);
    weave::Ledger ledger;
    int steps_without_pick = 0;
    std::size_t touching_most = 0;
    for (int i = 0; i < 600; ++i) {
      const auto picks = engine.state().picks_of_active;
      const std::size_t before = allocations;
      const weave::StepReport report = engine.step(drive, i % 2 == 0 ? &ledger : nullptr);
      const std::size_t in_step = allocations - before;
      ASSERT_EQ(report.status, weave::StepStatus::ok) << report.message;
      if (engine.state().picks_of_active != picks) continue;  // there the list of contacts may grow
      ASSERT_EQ(in_step, 0) << "in step " << i;
      ++steps_without_pick;
      const auto& touches = engine.state().contacts.active.touch;
      touching_most = std::max(touching_most, static_cast<std::size_t>(std::ranges::count_if(touches, &weave::Touch::is_held)));
    }
    EXPECT_GT(steps_without_pick, 250);
    EXPECT_GT(touching_most, 20);
  }
}

}  // namespace
