// Parts that the scenes of the suite people share: a world, a gateway in a process of its own, and those who look.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bench/report.h"
#include "client_sdk/client.h"
#include "gateway/testing/viewer_socket.h"
#include "host/child_process.h"
#include "host/temporary_folder.h"
#include "local_cluster/world_run.h"

namespace tessera::bench {

inline constexpr const char* kPeopleEngine = "tessera";
// Frames a second of a page; what viewers ask for unless they say otherwise.
inline constexpr int kPageRate_hz = 30;

// CPU time of a process so far, all its threads, s. The caller holds the process, so that the number is no other's.
double ProcessCpuSeconds(pid_t pid);
double ResidentBytes(pid_t pid);

// One region of the plaza, which has run for some seconds: its bodies are on their way.
local::RunOptions PlazaOptions(std::uint32_t bodies);
void SettlePlaza(local::WorldRun& run);
// CommandError if the world has ended.
void RequireRunning(local::WorldRun& run);

// The median, and how the measurements spread: `metric`, `metric`_p10, `metric`_p90.
void AddSpread(Report& report, const std::string& scene, const std::string& config, const std::string& metric,
               const std::vector<double>& values, const std::string& unit);

// A gateway beside a cluster. The constructor returns once it has said its address; CommandError if it does not.
// Thread rule: one thread.
class GatewayProcess {
 public:
  explicit GatewayProcess(const std::string& control_address);

  const std::string& address() const { return address_; }
  pid_t pid() const { return process_->pid(); }

 private:
  host::TemporaryFolder folder_;
  std::optional<host::ChildProcess> process_;
  std::string address_;
};

// A client of the SDK that watches a world, on a thread of its own. Thread rule: any thread; CommandError if it has
// ended.
class SdkViewer {
 public:
  // Called on its thread with the bodies as they are to be drawn.
  using OnRead =
      std::function<void(const client::Client&, const std::vector<client::ShownBody>&, client::TimePoint now)>;
  // Polls between two readings; it is polled 60 times a second.
  struct Options {
    int polls_a_read = 2;
    OnRead on_read = {};
  };
  SdkViewer(const std::string& control_address, const std::string& instance)
      : SdkViewer(control_address, instance, Options()) {}
  SdkViewer(const std::string& control_address, const std::string& instance, Options options);
  ~SdkViewer();
  SdkViewer(const SdkViewer&) = delete;
  SdkViewer& operator=(const SdkViewer&) = delete;

  double cpu_s() const;  // used by its thread so far
  client::ClientStats Stats() const;

 private:
  void Run();

  Options options_;
  std::unique_ptr<client::Client> client_;
  mutable std::mutex mutex_;  // guards the client
  bool ended_ = false;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

// Viewers of one world at one gateway, read on a thread of their own. They count messages and do not decode them.
// Thread rule: one thread, beside their own; CommandError if the gateway has closed one of them.
class Viewers {
 public:
  struct Tally {
    std::uint64_t frames = 0, bytes = 0;
    double delay_sum_s = 0;  // from the moment that a frame's time names to its arrival
  };

  Viewers(const std::string& address, const std::string& instance, std::size_t count, int receive_buffer_bytes = 0);
  ~Viewers();
  Viewers(const Viewers&) = delete;
  Viewers& operator=(const Viewers&) = delete;

  // Waits until each has had a frame.
  void AwaitFrames();
  void Send(const nlohmann::json& message);
  // From now on at most so many bytes a second of each.
  void ReadAtMost(double bytes_per_s) { bytes_per_s_ = bytes_per_s; }
  void ReadAll() { bytes_per_s_ = 0; }
  Tally Sum() const;

 private:
  struct Viewer {
    // The reading thread's own:
    std::unique_ptr<gateway::ViewerSocket> socket;
    Tally read;
    double allowance = 0;  // bytes that it may read
    // For all:
    Tally tally;
    std::optional<std::string> closed;
  };

  void Run();
  void Read(Viewer& viewer, double seconds);
  static void Count(std::span<const std::uint8_t> message, Tally& tally);

  mutable std::mutex mutex_;  // guards all that the viewers share
  std::vector<std::unique_ptr<Viewer>> viewers_;
  std::atomic<double> bytes_per_s_ = 0;  // 0: all
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace tessera::bench
