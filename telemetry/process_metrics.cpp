#include "telemetry/process_metrics.h"

#include <dirent.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>

#include "host/files.h"

namespace tessera::telemetry {
namespace {

// The files of /proc that are read here hold a few kilobytes; /proc/stat some for each processor.
constexpr std::size_t kMaxProcBytes = 1 << 20;

std::string ReadProc(const char* path) { return host::ReadFile(path, kMaxProcBytes).value_or(""); }

std::uint64_t CountOpenFds() {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir("/proc/self/fd"), closedir);
  if (folder == nullptr) return 0;
  std::uint64_t count = 0;
  while (const dirent* entry = readdir(folder.get())) count += entry->d_name[0] != '.';
  return count - 1;  // the folder itself is open while it is read
}

std::uint64_t MostOpenFds() {
  rlimit limit{};
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<std::uint64_t>(limit.rlim_cur) : 0;
}

// Boot time plus field 22 of /proc/self/stat, counted in clock ticks since boot (proc(5)). The second field is the
// program's name in parentheses, which may hold spaces, so fields are counted from the last ')'.
double StartTime() {
  const std::string stat = ReadProc("/proc/self/stat");
  const auto name_end = stat.rfind(')');
  if (name_end == std::string::npos) return 0;
  std::istringstream fields(stat.substr(name_end + 1));
  std::string field;
  for (int number = 3; number <= 22; ++number) fields >> field;
  const double since_boot_s = std::strtod(field.c_str(), nullptr) / static_cast<double>(sysconf(_SC_CLK_TCK));
  std::istringstream kernel(ReadProc("/proc/stat"));
  for (std::string line; std::getline(kernel, line);) {
    if (line.starts_with("btime ")) return std::strtod(line.c_str() + 6, nullptr) + since_boot_s;
  }
  return 0;
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

prometheus::MetricFamily Family(const char* name, const char* help, prometheus::MetricType type, double value) {
  prometheus::ClientMetric metric;
  if (type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  return {.name = name, .help = help, .type = type, .metric = {metric}};
}

// The value is always 1: which release runs where stands in the label, so that a query can join it to other metrics.
prometheus::MetricFamily BuildInfo() {
  prometheus::MetricFamily family =
      Family("tessera_build_info", "1; the release is in the label", prometheus::MetricType::Gauge, 1);
  family.metric.front().label.push_back({"version", TESSERA_VERSION});
  return family;
}

// Labelled, so that a graph shows at once which of them it is.
prometheus::MetricFamily Stalled(const HostReading& host) {
  prometheus::MetricFamily family =
      Family("tessera_host_stalled_seconds_total", "Time in which some task of the host waited for the resource",
             prometheus::MetricType::Counter, 0);
  family.metric.clear();
  const auto add = [&](const char* resource, double seconds) {
    prometheus::ClientMetric& metric = family.metric.emplace_back();
    metric.label.push_back({"resource", resource});
    metric.counter.value = seconds;
  };
  add("cpu", host.cpu_stalled_s);
  add("io", host.io_stalled_s);
  add("memory", host.memory_stalled_s);
  return family;
}

}  // namespace

void ParseStatm(const std::string& statm, std::uint64_t page_bytes, MemoryReading& reading) {
  std::istringstream text(statm);
  std::uint64_t virtual_pages = 0, resident_pages = 0;
  if (!(text >> virtual_pages >> resident_pages)) return;
  reading.process_virtual_bytes = virtual_pages * page_bytes;
  reading.process_physical_bytes = resident_pages * page_bytes;
}

void ParseMeminfo(const std::string& meminfo, MemoryReading& reading) {
  std::uint64_t swap_total = 0, swap_free = 0;
  std::istringstream text(meminfo);
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string key;
    std::uint64_t kib = 0;
    if (!(words >> key >> kib)) continue;
    const std::uint64_t bytes = kib * 1024;  // the file says kB and means KiB
    if (key == "MemTotal:") reading.host_physical_total_bytes = bytes;
    if (key == "MemAvailable:") reading.host_physical_available_bytes = bytes;
    if (key == "SwapTotal:") swap_total = bytes;
    if (key == "SwapFree:") swap_free = bytes;
  }
  reading.host_virtual_total_bytes = reading.host_physical_total_bytes + swap_total;
  reading.host_virtual_available_bytes = reading.host_physical_available_bytes + swap_free;
}

double ParseProcessorWait(const std::string& schedstat) {
  std::istringstream text(schedstat);
  std::uint64_t ran_ns = 0, waited_ns = 0;
  return text >> ran_ns >> waited_ns ? static_cast<double>(waited_ns) * 1e-9 : 0;
}

double ParseSteal(const std::string& stat, double ticks_per_second) {
  std::istringstream text(stat);
  std::string name;
  if (!(text >> name) || name != "cpu") return 0;
  std::uint64_t ticks = 0;
  for (int number = 1; number <= 8; ++number) {
    if (!(text >> ticks)) return 0;
  }
  return static_cast<double>(ticks) / ticks_per_second;
}

double ParsePressure(const std::string& pressure) {
  std::istringstream text(pressure);
  for (std::string line; std::getline(text, line);) {
    constexpr std::string_view kTotal = " total=";
    const std::size_t at = line.find(kTotal);
    if (line.starts_with("some ") && at != std::string::npos) {
      return std::strtod(line.c_str() + at + kTotal.size(), nullptr) * 1e-6;
    }
  }
  return 0;
}

MemoryReading ReadMemory() {
  MemoryReading reading;
  ParseStatm(ReadProc("/proc/self/statm"), static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)), reading);
  ParseMeminfo(ReadProc("/proc/meminfo"), reading);
  return reading;
}

ProcessReading ReadProcess() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime),
          .start_time_unix_s = StartTime(),
          .open_fds = CountOpenFds(),
          .max_fds = MostOpenFds(),
          .processor_wait_s = ParseProcessorWait(ReadProc("/proc/self/schedstat"))};
}

HostReading ReadHost() {
  return {.steal_s = ParseSteal(ReadProc("/proc/stat"), static_cast<double>(sysconf(_SC_CLK_TCK))),
          .cpu_stalled_s = ParsePressure(ReadProc("/proc/pressure/cpu")),
          .memory_stalled_s = ParsePressure(ReadProc("/proc/pressure/memory")),
          .io_stalled_s = ParsePressure(ReadProc("/proc/pressure/io"))};
}

std::vector<prometheus::MetricFamily> ProcessMetrics::Collect() const {
  using Type = prometheus::MetricType;
  const MemoryReading memory = ReadMemory();
  const ProcessReading process = ReadProcess();
  const HostReading host = ReadHost();
  const auto number = [](std::uint64_t value) { return static_cast<double>(value); };
  return {
      Family("process_virtual_memory_bytes", "Address space of this process", Type::Gauge,
             number(memory.process_virtual_bytes)),
      Family("process_resident_memory_bytes", "Physical memory of this process", Type::Gauge,
             number(memory.process_physical_bytes)),
      Family("tessera_host_virtual_memory_available_bytes", "Memory and swap that the host can still give", Type::Gauge,
             number(memory.host_virtual_available_bytes)),
      Family("tessera_host_virtual_memory_total_bytes", "Memory and swap of the host", Type::Gauge,
             number(memory.host_virtual_total_bytes)),
      Family("tessera_host_physical_memory_available_bytes", "Memory that the host can give without swapping",
             Type::Gauge, number(memory.host_physical_available_bytes)),
      Family("tessera_host_physical_memory_total_bytes", "Memory of the host", Type::Gauge,
             number(memory.host_physical_total_bytes)),
      Family("process_cpu_seconds_total", "User and system time of this process", Type::Counter, process.cpu_s),
      Family("process_open_fds", "Open file descriptors of this process", Type::Gauge, number(process.open_fds)),
      Family("process_max_fds", "File descriptors that this process may have open", Type::Gauge,
             number(process.max_fds)),
      Family("process_start_time_seconds", "When this process started, Unix time", Type::Gauge,
             process.start_time_unix_s),
      Family("tessera_process_processor_wait_seconds_total",
             "Time in which the main thread was ready to run and had no processor", Type::Counter,
             process.processor_wait_s),
      Family("tessera_host_steal_seconds_total", "Time that the machine below a virtual one gave to others",
             Type::Counter, host.steal_s),
      Stalled(host),
      BuildInfo(),
  };
}

}  // namespace tessera::telemetry
