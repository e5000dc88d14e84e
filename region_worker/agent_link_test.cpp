// The loop of a worker asks its link many times a tick, and must not wait while the link's threads write to the log.
#include "region_worker/agent_link.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "gtest/gtest.h"
#include "host/temporary_folder.h"
#include "spdlog/sinks/base_sink.h"
#include "spdlog/spdlog.h"
#include "tessera/v1/worker_link.grpc.pb.h"

namespace tessera::worker {
namespace {

constexpr std::chrono::seconds kLinkPatience{60};

// Calls back with each line, in the thread that writes it.
class ObservedSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit ObservedSink(std::function<void(std::string_view)> on_line) : on_line_(std::move(on_line)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& line) override { on_line_({line.payload.data(), line.payload.size()}); }
  void flush_() override {}

  const std::function<void(std::string_view)> on_line_;
};

// An agent that has an order without content for whoever attaches, and stays until it is told to go.
class PassingAgent final : public v1::WorkerLinkService::Service {
 public:
  explicit PassingAgent(const std::string& socket) {
    grpc::ServerBuilder builder;
    builder.AddListeningPort("unix:" + socket, grpc::InsecureServerCredentials());
    builder.RegisterService(this);
    server_ = builder.BuildAndStart();
  }
  ~PassingAgent() override { Go(); }
  PassingAgent(const PassingAgent&) = delete;
  PassingAgent& operator=(const PassingAgent&) = delete;

  void Go() {
    if (server_) server_->Shutdown(std::chrono::system_clock::now());
    server_.reset();
  }
  grpc::Status Attach(grpc::ServerContext*,
                      grpc::ServerReaderWriter<v1::AgentOrder, v1::WorkerMessage>* stream) override {
    v1::WorkerMessage message;
    if (stream->Read(&message)) stream->Write(v1::AgentOrder());
    while (stream->Read(&message)) continue;
    return grpc::Status::OK;
  }

 private:
  std::unique_ptr<grpc::Server> server_;
};

// Whoever writes the line asks the link at once: it would wait for itself for ever, were the link's lock held
// meanwhile.
TEST(AgentLinkTest, NobodyWaitsForTheLog) {
  const host::TemporaryFolder folder;
  PassingAgent agent(folder.path() + "/agent.sock");
  std::promise<bool> came, went;
  AgentLink* asked = nullptr;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<ObservedSink>([&](std::string_view line) {
                                         if (line.starts_with("attached to agent ")) came.set_value(asked->attached());
                                         if (line.starts_with("agent gone ")) went.set_value(asked->attached());
                                       })));
  {
    AgentLink link(folder.path() + "/agent.sock");
    asked = &link;
    link.Report(v1::WorkerReport());
    auto is_there = came.get_future();
    ASSERT_EQ(is_there.wait_for(kLinkPatience), std::future_status::ready);
    EXPECT_TRUE(is_there.get());
    agent.Go();
    auto is_gone = went.get_future();
    ASSERT_EQ(is_gone.wait_for(kLinkPatience), std::future_status::ready);
    EXPECT_FALSE(is_gone.get());
  }
  spdlog::set_default_logger(before);
}

}  // namespace
}  // namespace tessera::worker
