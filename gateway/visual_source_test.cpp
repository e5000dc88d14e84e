// Files from a control plane that is played, and that fails in each way there is.
#include "gateway/visual_source.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "core/world/limits.h"
#include "core/world/sha256.h"
#include "host/temporary_folder.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::gateway {
namespace {

using testing::HasSubstr;

const std::string kBytes(200'000, 'x');
const std::string kSha256 = Sha256Hex(kBytes);

class PlayedControl final : public v1::VisualService::Service {
 public:
  using Writer = grpc::ServerWriter<v1::GetVisualResponse>;

  grpc::Status GetVisual(grpc::ServerContext* context, const v1::GetVisualRequest* request, Writer* writer) override {
    ++calls;
    EXPECT_EQ(request->sha256(), kSha256);
    return Playing()(*context, *writer);
  }
  static void Send(Writer& writer, const std::string& bytes, std::uint64_t size) {
    v1::GetVisualResponse piece;
    piece.set_size(size);
    piece.set_data(bytes.substr(0, bytes.size() / 2));
    writer.Write(piece);
    piece.Clear();
    piece.set_data(bytes.substr(bytes.size() / 2));
    writer.Write(piece);
  }

  using Answer = std::function<grpc::Status(grpc::ServerContext&, Writer&)>;
  void Play(Answer answer) {
    const std::lock_guard lock(mutex_);
    play_ = std::move(answer);
  }

  std::atomic<int> calls{0};

 private:
  Answer Playing() const {
    const std::lock_guard lock(mutex_);
    return play_;
  }

  // Calls come one after the other, but by other threads, and gRPC's library does not show TSan that.
  mutable std::mutex mutex_;
  Answer play_ = [](grpc::ServerContext&, Writer& writer) {
    Send(writer, kBytes, kBytes.size());
    return grpc::Status::OK;
  };
};

class VisualSourceTest : public testing::Test {
 protected:
  VisualSourceTest() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&control_);
    server_ = builder.BuildAndStart();
    EXPECT_TRUE(cache_.Open().ok());
  }
  void SendsAs(const std::string& bytes, std::uint64_t size) {
    control_.Play([bytes, size](grpc::ServerContext&, PlayedControl::Writer& writer) {
      PlayedControl::Send(writer, bytes, size);
      return grpc::Status::OK;
    });
  }
  bool CacheIsEmpty() const { return std::filesystem::is_empty(folder_.path() + "/cache"); }

  const host::TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.path() + "/control.sock";
  PlayedControl control_;
  std::unique_ptr<grpc::Server> server_;
  const VisualCache cache_{folder_.path() + "/cache", 10'000'000};
  VisualSource source_{grpc::CreateChannel(address_, grpc::InsecureChannelCredentials()), cache_};
};

TEST_F(VisualSourceTest, AFileIsFetchedOnceAndThenKept) {
  for (int i = 0; i < 2; ++i) {
    const auto file = source_.Get(kSha256);
    ASSERT_TRUE(file.ok()) << file.status();
    EXPECT_TRUE(*file == kBytes);
  }
  EXPECT_EQ(control_.calls, 1);
  server_->Shutdown();
  EXPECT_TRUE(source_.Get(kSha256).ok()) << "without a control plane, too";
}

TEST_F(VisualSourceTest, WhatIsNotWholeIsNotKept) {
  const std::string other(kBytes.size(), 'y');
  SendsAs(other, other.size());
  EXPECT_THAT(std::string(source_.Get(kSha256).status().message()), HasSubstr("came with another hash"));
  SendsAs(kBytes.substr(1), kBytes.size());
  EXPECT_EQ(source_.Get(kSha256).status().code(), absl::StatusCode::kDataLoss);
  SendsAs(kBytes, kBytes.size() - 1);
  EXPECT_THAT(std::string(source_.Get(kSha256).status().message()), HasSubstr("is larger than it may be"));
  SendsAs(kBytes, kMaxVisualFile_bytes + 1);
  EXPECT_THAT(std::string(source_.Get(kSha256).status().message()), HasSubstr("is larger than it may be"));
  EXPECT_TRUE(CacheIsEmpty());
}

TEST_F(VisualSourceTest, OneThatTheControlPlaneLacksIsNotFound) {
  control_.Play([](grpc::ServerContext&, PlayedControl::Writer&) {
    return grpc::Status(grpc::StatusCode::NOT_FOUND, "sha256: the control plane has no such file");
  });
  EXPECT_EQ(source_.Get(kSha256).status(), absl::NotFoundError("sha256: the control plane has no such file"));
}

TEST_F(VisualSourceTest, AControlPlaneThatGoesHalfwayLeavesNothingAndIsAskedAgain) {
  std::promise<void> sent;
  control_.Play([&sent](grpc::ServerContext& context, PlayedControl::Writer& writer) {
    v1::GetVisualResponse piece;
    piece.set_size(kBytes.size());
    piece.set_data(kBytes.substr(0, 100'000));
    writer.Write(piece);
    sent.set_value();
    while (!context.IsCancelled()) std::this_thread::yield();
    return grpc::Status(grpc::StatusCode::UNAVAILABLE, "gone");
  });
  auto cut = std::async(std::launch::async, [this] { return source_.Get(kSha256); });
  sent.get_future().wait();
  server_->Shutdown(std::chrono::system_clock::now());
  const auto file = cut.get();
  EXPECT_EQ(file.status().code(), absl::StatusCode::kUnavailable) << file.status();
  EXPECT_THAT(std::string(file.status().message()), HasSubstr("the control plane did not send it: "));
  EXPECT_TRUE(CacheIsEmpty());
  EXPECT_EQ(source_.Get(kSha256).status().code(), absl::StatusCode::kUnavailable) << "nobody listens";
}

TEST_F(VisualSourceTest, TheEndOfAGatewayIsNotKeptWaiting) {
  std::promise<void> asked;
  control_.Play([&asked](grpc::ServerContext& context, PlayedControl::Writer&) {
    asked.set_value();
    while (!context.IsCancelled()) std::this_thread::yield();
    return grpc::Status::CANCELLED;
  });
  auto cut = std::async(std::launch::async, [this] { return source_.Get(kSha256); });
  asked.get_future().wait();
  source_.Stop();
  EXPECT_EQ(cut.get().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(source_.Get(kSha256).status(), absl::UnavailableError("this gateway is ending"));
}

}  // namespace
}  // namespace tessera::gateway
