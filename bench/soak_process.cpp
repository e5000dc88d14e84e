#include "bench/soak_process.h"

#include <dirent.h>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "host/files.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kMaxStatusBytes = 1 << 16;
constexpr double kKibibyte = 1024;

// Field `name` of the text, as "RssAnon:\t   1234 kB".
std::optional<double> StatusField(std::string_view status, const std::string& name) {
  const std::string begin = "\n" + name + ":";
  const std::size_t at = status.find(begin);
  if (at == std::string_view::npos) return std::nullopt;
  return std::strtod(std::string(status.substr(at + begin.size(), 32)).c_str(), nullptr);
}

// Nothing: its folder cannot be read.
std::optional<double> OpenDescriptors(pid_t pid) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir(fmt::format("/proc/{}/fd", pid).c_str()), closedir);
  if (folder == nullptr) return std::nullopt;
  double count = 0;
  while (const dirent* entry = readdir(folder.get())) {
    if (entry->d_name[0] != '.') ++count;
  }
  return count;
}

}  // namespace

std::optional<SoakSample> ParseStatus(std::string_view status) {
  const auto own = StatusField(status, "RssAnon"), swapped = StatusField(status, "VmSwap");
  const auto threads = StatusField(status, "Threads");
  if (!own || !swapped || !threads) return std::nullopt;
  SoakSample sample;
  sample.memory_bytes = kKibibyte * (*own + *swapped);
  sample.threads = *threads;
  return sample;
}

std::optional<SoakSample> ReadSoakProcess(pid_t pid) {
  const auto status = host::ReadFile(fmt::format("/proc/{}/status", pid), kMaxStatusBytes);
  const std::optional<double> descriptors = OpenDescriptors(pid);
  if (!status.ok() || !descriptors) return std::nullopt;
  std::optional<SoakSample> sample = ParseStatus(*status);
  if (sample) sample->descriptors = *descriptors;
  return sample;
}

}  // namespace tessera::bench
