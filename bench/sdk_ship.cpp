// Measures what a game ships with the client library, and the memory of a program that has nothing else.
#include <fmt/format.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bench/sdk.h"
#include "bench/sdk_stage.h"

namespace tessera::bench {
namespace {

constexpr double kMega = 1e6;

// All that a command prints; INTERNAL if it fails.
absl::StatusOr<std::string> Output(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return absl::InternalError("cannot run: " + command);
  std::string all;
  std::array<char, 4096> part{};
  while (const std::size_t size = std::fread(part.data(), 1, part.size(), pipe)) all.append(part.data(), size);
  if (pclose(pipe) != 0) return absl::InternalError("failed: " + command);
  return all;
}

absl::Status MeasureMemory(const std::string& library, bool quick, Report& report) {
  const auto loaded = Output(fmt::format("{} {}", TESSERA_SDK_PROBE, library));
  if (!loaded.ok()) return loaded.status();
  report.Add("ship", "tessera", "", "load_mb", std::stod(*loaded) / kMega, "MB");

  constexpr std::size_t kBodies = 2000;
  std::vector<BodyDef> balls(kBodies);
  for (std::size_t i = 0; i < kBodies; ++i) {
    balls[i].id = BodyId(i + 1);
    balls[i].shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  }
  SdkStage stage(SdkScene(std::move(balls)));
  const host::TemporaryFolder folder;
  const std::string file = folder.path() + "/grant";
  const std::vector<std::uint8_t> grant = stage.Grant();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(grant.data()), static_cast<std::streamsize>(grant.size()));
  absl::StatusOr<std::string> played = absl::InternalError("did not run");
  std::atomic<bool> over = false;
  std::thread probe([&] {
    played = Output(fmt::format("{} {} {} {}", TESSERA_SDK_PROBE, library, file, quick ? 3 : 10));
    over = true;
  });
  const auto begin = std::chrono::steady_clock::now();
  for (Tick tick; !over;) {
    stage.region.Service();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const Tick due(static_cast<std::uint64_t>(seconds * client::kSnapshotRate) * 2);
    if (due > tick) stage.region.Snapshot(tick = due, MovingBodiesAt(kBodies, seconds));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  probe.join();
  if (!played.ok()) return played.status();
  std::size_t at = 0;
  const double shown = std::stod(*played, &at);
  if (shown < kBodies) return absl::InternalError(fmt::format("the probe saw {} of {} bodies", shown, kBodies));
  report.Add("ship", "tessera", fmt::format("bodies={}", kBodies), "world_mb", std::stod(played->substr(at)) / kMega,
             "MB");
  return absl::OkStatus();
}

}  // namespace

absl::Status MeasureShip(bool quick, Report& report) {
  const host::TemporaryFolder folder;
  const std::string ship = folder.path() + "/sdk";
  const auto made = Output(fmt::format("{0}/client_sdk/package/make_folder.sh {1} {0}/LICENSE {2}", TESSERA_SOURCE_DIR,
                                       TESSERA_SDK_LIBRARY, ship));
  if (!made.ok()) return made.status();
  double libraries = 0, bytes = 0;
  std::string library;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(ship)) {
    if (!entry.is_regular_file()) continue;
    bytes += static_cast<double>(entry.file_size());
    const std::string name = entry.path().filename().string();
    if (name.find(".so") == std::string::npos) continue;
    if (name.starts_with("libtessera-client")) {
      library = entry.path().string();
    } else {
      libraries += 1;
    }
  }
  report.Add("ship", "tessera", "", "shared_libraries", libraries, "1");
  report.Add("ship", "tessera", "", "shipped_mb", bytes / kMega, "MB");
  return MeasureMemory(library, quick, report);
}

}  // namespace tessera::bench
