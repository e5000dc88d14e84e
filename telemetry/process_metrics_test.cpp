#include "telemetry/process_metrics.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <map>
#include <string>

#include "gtest/gtest.h"

namespace tessera::telemetry {
namespace {

TEST(ParseStatmTest, CountsPages) {
  MemoryReading reading;
  ParseStatm("1000 250 80 10 0 200 0\n", 4096, reading);
  EXPECT_EQ(reading.process_virtual_bytes, 1000u * 4096);
  EXPECT_EQ(reading.process_physical_bytes, 250u * 4096);
}

TEST(ParseStatmTest, LeavesZeroWhereNothingIsGiven) {
  MemoryReading reading;
  ParseStatm("", 4096, reading);
  ParseStatm("x", 4096, reading);
  EXPECT_EQ(reading.process_virtual_bytes, 0u);
}

TEST(ParseMeminfoTest, AddsSwapToVirtualMemory) {
  MemoryReading reading;
  ParseMeminfo("MemTotal:  1000 kB\nMemFree: 1 kB\nMemAvailable:  600 kB\nSwapTotal: 500 kB\nSwapFree: 400 kB\n",
               reading);
  EXPECT_EQ(reading.host_physical_total_bytes, 1000u * 1024);
  EXPECT_EQ(reading.host_physical_available_bytes, 600u * 1024);
  EXPECT_EQ(reading.host_virtual_total_bytes, 1500u * 1024);
  EXPECT_EQ(reading.host_virtual_available_bytes, 1000u * 1024);
}

TEST(ParseProcessorWaitTest, TakesTheSecondNumber) {
  EXPECT_DOUBLE_EQ(ParseProcessorWait("900 2500000000 17\n"), 2.5);
  EXPECT_EQ(ParseProcessorWait(""), 0);
  EXPECT_EQ(ParseProcessorWait("900\n"), 0);
}

TEST(ParseStealTest, TakesTheEighthNumberOfAllProcessors) {
  EXPECT_DOUBLE_EQ(ParseSteal("cpu  1 2 3 4 5 6 7 250 9 10\ncpu0 1 2 3 4 5 6 7 8 9 10\n", 100), 2.5);
  EXPECT_EQ(ParseSteal("", 100), 0);
  EXPECT_EQ(ParseSteal("cpu  1 2 3\n", 100), 0);
  EXPECT_EQ(ParseSteal("intr 1 2 3 4 5 6 7 8 9\n", 100), 0);
}

TEST(ParsePressureTest, TakesTheTotalOfSomeTask) {
  EXPECT_DOUBLE_EQ(ParsePressure("some avg10=1.53 avg60=0.87 avg300=0.73 total=2500000\n"
                                 "full avg10=0.00 avg60=0.00 avg300=0.00 total=9\n"),
                   2.5);
  EXPECT_EQ(ParsePressure(""), 0);
  EXPECT_EQ(ParsePressure("full avg10=0.00 avg60=0.00 avg300=0.00 total=9\n"), 0);
}

TEST(ReadMemoryTest, SeesMemoryThatThisProcessTouches) {
  constexpr std::size_t kBytes = std::size_t{32} << 20;
  const MemoryReading before = ReadMemory();
  void* block = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(block, MAP_FAILED);
  const MemoryReading mapped = ReadMemory();
  std::memset(block, 1, kBytes);
  const MemoryReading touched = ReadMemory();
  munmap(block, kBytes);
  EXPECT_GE(mapped.process_virtual_bytes, before.process_virtual_bytes + kBytes);
  EXPECT_LT(mapped.process_physical_bytes, before.process_physical_bytes + kBytes / 2);
  // The kernel counts resident pages per thread in batches (proc(5)), so a little may be missing.
  EXPECT_GE(touched.process_physical_bytes, before.process_physical_bytes + kBytes * 9 / 10);
}

TEST(ReadMemoryTest, ProcessFitsItsHost) {
  const MemoryReading reading = ReadMemory();
  EXPECT_GT(reading.process_physical_bytes, 0u);
  EXPECT_LE(reading.process_physical_bytes, reading.process_virtual_bytes);
  EXPECT_LE(reading.host_physical_available_bytes, reading.host_physical_total_bytes);
  EXPECT_LE(reading.host_physical_total_bytes, reading.host_virtual_total_bytes);
}

TEST(ReadProcessTest, CountsOpenFiles) {
  const std::uint64_t before = ReadProcess().open_fds;
  const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  ASSERT_GE(fd, 0);
  EXPECT_EQ(ReadProcess().open_fds, before + 1);
  close(fd);
  EXPECT_EQ(ReadProcess().open_fds, before);
}

TEST(ReadProcessTest, CpuTimeGrowsWithWork) {
  const double before = ReadProcess().cpu_s;
  volatile unsigned work = 0;
  while (ReadProcess().cpu_s <= before) work = work + 1;  // ends when the kernel has counted; else the test times out
  EXPECT_GT(ReadProcess().cpu_s, before);
}

TEST(ReadProcessTest, StartedNotLongAgo) {
  const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  const double start = ReadProcess().start_time_unix_s;
  EXPECT_LT(start, now + 2);  // boot time is in whole seconds
  EXPECT_GT(start, now - 3600);
}

TEST(ProcessMetricsTest, NamesFollowPrometheusConventions) {
  std::map<std::string, prometheus::MetricFamily> families;
  for (auto& family : ProcessMetrics().Collect()) families[family.name] = family;
  EXPECT_EQ(families.size(), 14u);
  for (const auto& [name, family] : families) {
    EXPECT_TRUE(name.starts_with("tessera_") || name.starts_with("process_")) << name;
    EXPECT_EQ(name.ends_with("_total"), family.type == prometheus::MetricType::Counter) << name;
    EXPECT_FALSE(family.help.empty()) << name;
    ASSERT_EQ(family.metric.size(), name == "tessera_host_stalled_seconds_total" ? 3u : 1u) << name;
  }
  EXPECT_GT(families["process_resident_memory_bytes"].metric[0].gauge.value, 0);
  EXPECT_GE(families["process_max_fds"].metric[0].gauge.value, families["process_open_fds"].metric[0].gauge.value);
  const prometheus::ClientMetric& build = families["tessera_build_info"].metric[0];
  EXPECT_EQ(build.gauge.value, 1);
  ASSERT_EQ(build.label.size(), 1u);
  EXPECT_EQ(build.label[0].name, "version");
  EXPECT_FALSE(build.label[0].value.empty());
}

}  // namespace
}  // namespace tessera::telemetry
