// A worker for tests: takes the flags of tessera-region, attaches and follows orders, but simulates nothing. What it is
// to do wrong is said by the environment, for each region: FAKE_WORKER_2="exit:7".
//
//   exit:CODE        writes three lines and exits before it attaches
//   busy-below:PORT  exits with 98 (port in use) if its game port is below PORT
//   hang             never attaches
//   abort            writes 30 lines and aborts when ordered to run
//   stubborn         attaches, then ignores orders to stop and SIGTERM
//   die-in-game      says that it dies in its game, and aborts when ordered to run
//
// FAKE_WORKER_GUARD=PID: it ends when that process (the test) does, so that nothing outlives a test that was killed.
#include <grpcpp/grpcpp.h>
#include <poll.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>

#include "tessera/v1/worker_link.grpc.pb.h"

namespace {

namespace v1 = tessera::v1;

std::string Environment(const std::string& name) {
  const char* value = std::getenv(name.c_str());
  return value == nullptr ? "" : value;
}

void EndWithTest() {
  const std::string pid = Environment("FAKE_WORKER_GUARD");
  if (pid.empty()) return;
  const int guard = static_cast<int>(syscall(SYS_pidfd_open, std::stoi(pid), 0));
  std::thread([guard] {
    pollfd watch{guard, POLLIN, 0};
    while (guard >= 0 && poll(&watch, 1, -1) < 0) {
    }
    _exit(1);
  }).detach();
}

class Worker {
 public:
  explicit Worker(std::map<std::string, std::string> flags) : flags_(std::move(flags)) {
    mode_ = Environment("FAKE_WORKER_" + flags_["region"]);
    v1::WorkerIdentity& identity = *report_.mutable_identity();
    identity.set_instance_id(flags_["instance"]);
    identity.set_region(static_cast<std::uint32_t>(Number("region")));
    identity.set_incarnation(Number("incarnation"));
    identity.set_pid(getpid());
    report_.set_phase(v1::WORKER_PHASE_LOADING);
  }

  int Run() {
    if (mode_.starts_with("exit:")) {
      for (const int line : {1, 2, 3}) std::fprintf(stderr, "start line %d\n", line);
      return std::stoi(mode_.substr(5));
    }
    if (mode_.starts_with("busy-below:") && Number("game-port") < std::stoul(mode_.substr(11))) return 98;
    if (mode_ == "hang") {
      for (;;) pause();
    }
    if (mode_ == "stubborn") std::signal(SIGTERM, SIG_IGN);
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, 20);
    arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 50);
    const auto stub = v1::WorkerLinkService::NewStub(
        grpc::CreateCustomChannel("unix:" + flags_["agent-socket"], grpc::InsecureChannelCredentials(), arguments));
    while (!stopped_) {
      if (Attach(*stub).error_code() == grpc::StatusCode::NOT_FOUND) return 0;
    }
    return 0;
  }

 private:
  std::uint64_t Number(const std::string& flag) { return std::stoull(flags_[flag]); }
  std::uint32_t MetricsPort() {
    const std::string& address = flags_["metrics-listen"];
    return static_cast<std::uint32_t>(std::stoul(address.substr(address.rfind(':') + 1)));
  }

  grpc::Status Attach(v1::WorkerLinkService::Stub& stub) {
    grpc::ClientContext context;
    context.set_wait_for_ready(true);
    const auto stream = stub.Attach(&context);
    Report(*stream);
    v1::AgentOrder order;
    while (!stopped_ && stream->Read(&order)) {
      Follow(order.order());
      Report(*stream);
    }
    stream->WritesDone();
    if (stopped_) context.TryCancel();
    return stream->Finish();
  }

  void Report(grpc::ClientReaderWriter<v1::WorkerMessage, v1::AgentOrder>& stream) {
    v1::WorkerMessage message;
    *message.mutable_report() = report_;
    stream.Write(message);
  }

  void Follow(const v1::WorkerOrder& order) {
    if (order.stop()) {
      if (mode_ == "stubborn") return;
      report_.set_phase(v1::WORKER_PHASE_STOPPING);
      stopped_ = true;
      return;
    }
    report_.set_order_revision(order.revision());
    if (!std::ifstream(order.scene_path())) report_.set_failure("no scene at " + order.scene_path());
    if (!order.game_hash().empty() && !std::ifstream(order.game_path())) {
      report_.set_failure("no game at " + order.game_path());
    }
    if (order.instance_key().size() != 32 || order.certificate().empty()) report_.set_failure("no certificate");
    v1::RegionAddress& address = *report_.mutable_address();
    address.set_region(report_.identity().region());
    address.set_incarnation(report_.identity().incarnation());
    address.set_host(flags_["advertise-address"]);
    address.set_game_port(static_cast<std::uint32_t>(Number("game-port")));
    address.set_link_port(static_cast<std::uint32_t>(Number("link-port")));
    address.set_metrics_port(MetricsPort());
    report_.set_phase(order.run() ? v1::WORKER_PHASE_RUNNING : v1::WORKER_PHASE_LINKED);
    if (order.run() && mode_ == "die-in-game") {
      std::fprintf(stderr, "died in game module %s: Aborted in on_tick\n", order.game_name().c_str());
      std::abort();
    }
    if (order.run() && mode_ == "abort") {
      for (int line = 1; line <= 30; ++line) std::fprintf(stderr, "crash line %d\n", line);
      std::abort();
    }
  }

  std::map<std::string, std::string> flags_;
  std::string mode_;
  v1::WorkerReport report_;
  bool stopped_ = false;
};

// A library of a test is a text: the lines that are said about it. "crash" at its beginning: and then it dies.
int Describe(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  std::fprintf(stderr, "%s", text.str().c_str());
  if (text.str().starts_with("crash")) std::raise(SIGKILL);
  return text.str().starts_with("game module") ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  EndWithTest();
  std::map<std::string, std::string> flags;
  for (int i = 1; i + 1 < argc; i += 2) flags[std::string(argv[i]).substr(2)] = argv[i + 1];
  if (flags.contains("describe-game-module")) return Describe(flags["describe-game-module"]);
  return Worker(std::move(flags)).Run();
}
