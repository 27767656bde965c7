// Faults put in on purpose: an instrumented build reports each of them and ends the program with
// the exit code of sanitizers, so that the test it happens in fails. An abort would not do: the
// guard that is armed while a .vdb is read would take it for a damaged file.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

#include "support/support.h"

namespace photosphere {
namespace {

const ::testing::ExitedWithCode reported(test::kSanitizerExit);

// A value that the compiler must compute, however little it serves.
void leaveWith(int value) {
  volatile int used = value;
  std::_Exit(used == 0 ? 1 : 0);
}

TEST(PlantedFault, AReadPastAVectorIsReported) {
  const std::vector<int> values(4, 1);
  volatile std::size_t past = values.size();
  EXPECT_EXIT(leaveWith(values[past]), reported, "AddressSanitizer: heap-buffer-overflow");
}

TEST(PlantedFault, AUseAfterFreeIsReported) {
  const auto useFreed = [] {
    std::vector<int> values(4, 1);
    const int* volatile first = values.data();
    values = std::vector<int>();
    leaveWith(*first);
  };
  EXPECT_EXIT(useFreed(), reported, "AddressSanitizer: heap-use-after-free");
}

TEST(PlantedFault, ASignedOverflowIsReported) {
  volatile int most = std::numeric_limits<int>::max();
  EXPECT_EXIT(leaveWith(most + 1), reported, "runtime error: signed integer overflow");
}

}  // namespace
}  // namespace photosphere
