#include "telemetry/disk_metrics.h"

#include <filesystem>
#include <map>
#include <string>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/temporary_folder.h"

namespace tessera::telemetry {
namespace {

TEST(DiskMetricsTest, TellWhatTheFoldersDiskHasAndCanStillTake) {
  const host::TemporaryFolder folder;
  std::map<std::string, double> bytes;
  for (const prometheus::MetricFamily& family : DiskMetrics(folder.path()).Collect()) {
    EXPECT_EQ(family.type, prometheus::MetricType::Gauge);
    bytes[family.name] = family.metric.at(0).gauge.value;
  }
  const std::filesystem::space_info space = std::filesystem::space(folder.path());
  EXPECT_EQ(bytes.at("tessera_agent_disk_size_bytes"), static_cast<double>(space.capacity));
  // Others write to it meanwhile.
  EXPECT_NEAR(bytes.at("tessera_agent_disk_available_bytes"), static_cast<double>(space.available),
              0.1 * static_cast<double>(space.capacity));
}

TEST(DiskMetricsTest, AFolderThatIsNotThereHasNone) {
  EXPECT_THAT(DiskMetrics("/nowhere/at/all").Collect(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace tessera::telemetry
