#include "bench/soak_meter.h"

#include <fmt/format.h>

#include <csignal>

#include "bench/soak_figures.h"
#include "bench/soak_process.h"
#include "host/process.h"
#include "telemetry/http_get.h"

namespace tessera::bench {

void SoakMeter::Read(const std::string& process, pid_t pid, int load, double now_s) {
  const auto started = host::ProcessStartTime(pid);
  auto sample = ReadSoakProcess(pid);
  if (!started || !sample) return;  // it has just ended
  sample->at_s = now_s;
  sample->load = load;
  SoakSeries& series = series_[{pid, *started}];
  if (series.samples.empty()) {
    series.process = process;
    series.since_s = now_s;
  }
  series.samples.push_back(*sample);
}

void SoakMeter::Look(const v1::Instance& instance, double now_s) {
  if (now_s < next_s_) return;
  next_s_ = now_s + interval_s_;
  const int regions = instance.map().regions_size();
  std::map<std::string, int> on_host;
  for (const v1::RegionStatus& status : instance.region_status()) {
    ++on_host[status.host()];
    const v1::WorkerReport& report = status.report();
    const std::string worker = fmt::format("{}{}", kSoakWorker, report.identity().pid());
    Read(worker, static_cast<pid_t>(report.identity().pid()), regions, now_s);
    const std::string address = fmt::format("{}:{}", report.address().host(), report.address().metrics_port());
    const auto page = telemetry::HttpGet(address, "/metrics");
    if (!page.ok()) continue;
    steps_.Take(fmt::format("{} {}", worker, report.identity().incarnation()), ParseMetrics(page->body), regions);
  }
  steps_.Mark(now_s);
  Read("control", cluster_.control().pid(), regions, now_s);
  for (std::uint32_t host = 0; host < hosts_; ++host) {
    const std::string name = fmt::format("local-{}", host + 1);
    Read(name, cluster_.agent(host).pid(), on_host[name], now_s);
  }
}

std::vector<SoakSeries> SoakMeter::series() const {
  std::vector<SoakSeries> all;
  all.reserve(series_.size());
  for (const auto& [life, series] : series_) all.push_back(series);
  return all;
}

std::uint64_t SoakMeter::KillLeftWorkers() const {
  std::uint64_t left = 0;
  for (const auto& [life, series] : series_) {
    if (!series.process.starts_with(kSoakWorker)) continue;
    const auto process = host::Process::Adopt(life.first, life.second);
    if (!process.ok()) continue;
    ++left;
    process->Signal(SIGKILL);
  }
  return left;
}

}  // namespace tessera::bench
