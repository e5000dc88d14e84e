// Calls at the doors are judged though all threads that gRPC keeps for such work are held up.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/doors.h"
#include "control_plane/doors_fixture.h"

namespace tessera::control {
namespace {

constexpr int kCalls = 30, kHeldAtLeast = 3;

// Holds up every call that it is to judge, on one of gRPC's threads each, until it is released.
class Holdup final : public grpc::AuthMetadataProcessor {
 public:
  bool IsBlocking() const override { return true; }
  grpc::Status Process(const InputMetadata&, grpc::AuthContext*, OutputMetadata*, OutputMetadata*) override {
    std::unique_lock lock(mutex_);
    ++held_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return released_; });
    return grpc::Status::OK;
  }
  void AwaitHeld(int calls) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return held_ >= calls; });
  }
  int held() {
    const std::lock_guard lock(mutex_);
    return held_;
  }
  void Release() {
    const std::lock_guard lock(mutex_);
    released_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int held_ = 0;
  bool released_ = false;
};

// gRPC 1.51 keeps few threads, starts one a second more where work waits, and in that second may wake none of them:
// an operator's call waited for half a second while a host lied.
TEST_F(DoorsTest, NoCallWaitsForAThreadOfGrpc) {
  const std::string token = Token("ada", v1::ROLE_ADMINISTRATOR);
  const auto holdup = std::make_shared<Holdup>();
  auto credentials = UnjudgedTlsCredentials(Door::kPlayers, authority_);
  ASSERT_TRUE(credentials.ok()) << credentials.status();
  (*credentials)->SetAuthMetadataProcessor(holdup);
  v1::HostService::Service nothing;  // every method is unimplemented
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", *std::move(credentials), &port);
  builder.RegisterService(&nothing);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);

  const auto stub =
      v1::HostService::NewStub(Dialled(absl::StrCat("127.0.0.1:", port, "#", authority_.fingerprint), {}));
  grpc::CompletionQueue queue;
  struct Call {
    grpc::ClientContext context;
    v1::ListHostsResponse response;
    grpc::Status status;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::ListHostsResponse>> reader;
  };
  std::vector<Call> calls(kCalls);
  for (Call& call : calls) {
    call.reader = stub->AsyncListHosts(&call.context, {}, &queue);
    call.reader->Finish(&call.response, &call.status, &call);
  }
  holdup->AwaitHeld(kHeldAtLeast);
  EXPECT_TRUE(ListHosts(Operators(token)).ok());
  EXPECT_LT(holdup->held(), kCalls) << "it waited until there were threads for all";

  holdup->Release();
  for (int i = 0; i < kCalls; ++i) {
    void* tag = nullptr;
    bool ok = false;
    ASSERT_TRUE(queue.Next(&tag, &ok));
  }
  for (const Call& call : calls) EXPECT_EQ(call.status.error_code(), grpc::StatusCode::UNIMPLEMENTED);
  server->Shutdown();
}

}  // namespace
}  // namespace tessera::control
