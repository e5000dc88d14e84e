#include "control_plane/heap_metrics.h"

#include <cstddef>
#include <memory>
#include <thread>
#include <vector>

#include "gtest/gtest.h"

namespace tessera::control {
namespace {

TEST(HeapMetricsTest, AreThereUnderASanitizerToo) { EXPECT_EQ(HeapMetrics().Collect().size(), 1U); }

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // malloc of theirs is not counted
double HeapBytes() {
  const auto families = HeapMetrics().Collect();
  EXPECT_EQ(families.at(0).name, "tessera_control_heap_bytes");
  return families.at(0).metric.at(0).gauge.value;
}

// Blocks of one size, in pages of their own from some size on.
std::vector<std::unique_ptr<std::byte[]>> HoldBlocks(std::size_t blocks, std::size_t bytes_each) {
  std::vector<std::unique_ptr<std::byte[]>> held;
  for (std::size_t i = 0; i < blocks; ++i) held.push_back(std::make_unique<std::byte[]>(bytes_each));
  return held;
}

TEST(HeapMetricsTest, CountWhatIsHeldInSmallBlocksAndInLargeOnes) {
  for (const auto& [blocks, bytes_each] : {std::pair(40'000, 200), std::pair(4, 2'000'000)}) {
    const double before = HeapBytes();
    auto held = HoldBlocks(blocks, bytes_each);
    EXPECT_GE(HeapBytes() - before, 8e6) << bytes_each;
    EXPECT_LT(HeapBytes() - before, 12e6) << bytes_each;
    held.clear();
    EXPECT_LT(HeapBytes() - before, 1e6) << bytes_each;
  }
}

TEST(HeapMetricsTest, CountWhatAnotherThreadTook) {
  const double before = HeapBytes();
  std::vector<std::unique_ptr<std::byte[]>> held;
  std::thread([&] { held = HoldBlocks(40'000, 200); }).join();
  EXPECT_GE(HeapBytes() - before, 8e6);
}
#endif

}  // namespace
}  // namespace tessera::control
