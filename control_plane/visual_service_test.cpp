// VisualService over real calls: files that come, come twice, come damaged, and go.
#include <gmock/gmock.h>
#include <grpc/grpc.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "control_plane/doors_fixture.h"
#include "control_plane/etcd/etcd_election.h"
#include "control_plane/etcd/etcd_store.h"
#include "control_plane/memory_store.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "control_plane/testing/loaded_plane.h"
#include "core/world/limits.h"
#include "core/world/sha256.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::control {
namespace {

using grpc::StatusCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kPiece = 64 << 10;

std::string Bytes(std::size_t size, char first = 'a') {
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(first + static_cast<char>(i / 1000 % 23));
  return bytes;
}

struct Upload {
  std::string sha256{};
  std::uint64_t size = 0;
  std::string bytes{};
  std::size_t piece = kPiece;
};

Upload Whole(const std::string& bytes) { return {.sha256 = Sha256Hex(bytes), .size = bytes.size(), .bytes = bytes}; }

grpc::Status Put(v1::VisualService::Stub& stub, const Upload& upload) {
  Context context;
  v1::PutVisualResponse response;
  const auto stream = stub.PutVisual(&context, &response);
  v1::PutVisualRequest request;
  request.set_sha256(upload.sha256);
  request.set_size(upload.size);
  std::size_t at = 0;
  do {
    request.set_data(upload.bytes.substr(at, upload.piece));
    at += upload.piece;
    if (!stream->Write(request)) break;
    request.Clear();
  } while (at < upload.bytes.size());
  stream->WritesDone();
  return stream->Finish();
}

grpc::Status Get(v1::VisualService::Stub& stub, const std::string& sha256, std::string& bytes) {
  Context context;
  v1::GetVisualRequest request;
  request.set_sha256(sha256);
  const auto stream = stub.GetVisual(&context, request);
  v1::GetVisualResponse response;
  bytes.clear();
  std::uint64_t size = 0;
  while (stream->Read(&response)) {
    if (bytes.empty()) size = response.size();
    EXPECT_LE(response.data().size(), kPiece);
    bytes += response.data();
  }
  grpc::Status status = stream->Finish();
  if (status.ok()) {
    EXPECT_EQ(size, bytes.size());
  }
  return status;
}

class VisualServiceTest : public GrpcServerTest {
 protected:
  VisualServiceTest() {
    settings_.visual_quota = 5'000'000;
    settings_.keep_visuals = std::chrono::milliseconds(0);
  }
  // gRPC's end would wait some seconds for what polls large writes; it is kept for all tests.
  static void SetUpTestSuite() { grpc_init(); }
  void SetUp() override {
    GrpcServerTest::SetUp();
    visuals_ = v1::VisualService::NewStub(channel_);
  }
  std::size_t StoredKeys() const { return store_->List(kVisualKeys)->size(); }
  void ExpectRefused(const Upload& upload, StatusCode code, const std::string& why) {
    const grpc::Status status = Put(*visuals_, upload);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(why));
    EXPECT_EQ(StoredKeys(), 0u) << "nothing of it is stored";
  }
  // Files that nothing needs are not swept.
  void KeepAll() {
    plane_->Stop();
    server_.reset();
    plane_.reset();
    store_.reset();
    settings_.keep_visuals = std::chrono::hours(1);
    SetUp();
  }

  std::unique_ptr<v1::VisualService::Stub> visuals_;
};

TEST_F(VisualServiceTest, WhatIsPutIsGivenBack) {
  KeepAll();
  for (const std::size_t size : {std::size_t{1}, kPiece, std::size_t{1} << 20, (std::size_t{2} << 20) + 12345}) {
    const std::string bytes = Bytes(size);
    ASSERT_TRUE(Put(*visuals_, Whole(bytes)).ok()) << size;
    std::string got;
    ASSERT_TRUE(Get(*visuals_, Sha256Hex(bytes), got).ok());
    EXPECT_TRUE(got == bytes) << size;
  }
  v1::FindMissingVisualsRequest request;
  request.add_sha256(Sha256Hex(Bytes(1)));
  request.add_sha256(Sha256Hex("other"));
  v1::FindMissingVisualsResponse response;
  ASSERT_TRUE(visuals_->FindMissingVisuals(&Context(), request, &response).ok());
  EXPECT_THAT(response.sha256(), ElementsAre(Sha256Hex("other")));
}

TEST_F(VisualServiceTest, AnotherLifeStillHasIt) {
  KeepAll();
  const std::string bytes = Bytes(3 << 20);
  ASSERT_TRUE(Put(*visuals_, Whole(bytes)).ok());
  KeepAll();
  std::string got;
  ASSERT_TRUE(Get(*visuals_, Sha256Hex(bytes), got).ok());
  EXPECT_TRUE(got == bytes);
}

TEST_F(VisualServiceTest, BadUploadsAreRefusedAndLeaveNothing) {
  const std::string bytes = Bytes(200'000);
  Upload other = Whole(bytes), cut = Whole(bytes), longer = Whole(bytes), large = Whole(bytes), lumps = Whole(bytes);
  other.sha256 = Sha256Hex("another");
  ExpectRefused(other, StatusCode::INVALID_ARGUMENT, "data: what came has another hash than was said");
  cut.bytes.resize(150'000);
  ExpectRefused(cut, StatusCode::INVALID_ARGUMENT, "data: ended after 150000 of 200000 bytes");
  longer.size = 190'000;
  ExpectRefused(longer, StatusCode::INVALID_ARGUMENT, "data: more than the 190000 bytes that were said");
  large.size = kMaxVisualFile_bytes + 1;
  ExpectRefused(large, StatusCode::INVALID_ARGUMENT, "size: 67108865 is not in 1 to 67108864");
  lumps.piece = kPiece + 1;
  ExpectRefused(lumps, StatusCode::INVALID_ARGUMENT, "data: a piece of 65537 bytes, at most 65536");
  ExpectRefused({.sha256 = "../etc", .size = 1, .bytes = "x"}, StatusCode::INVALID_ARGUMENT, "sha256: \"../etc\"");
  ExpectRefused({}, StatusCode::INVALID_ARGUMENT, "sha256: \"\" is not 64");
  Upload beyond = Whole(bytes);
  beyond.size = 5'000'001;
  ExpectRefused(beyond, StatusCode::RESOURCE_EXHAUSTED, "--visual-quota-mb leaves");
}

TEST_F(VisualServiceTest, ACallerThatGoesHalfwayLeavesNothing) {
  const std::string bytes = Bytes(200'000);
  {
    grpc::ClientContext context;
    v1::PutVisualResponse response;
    const auto stream = visuals_->PutVisual(&context, &response);
    v1::PutVisualRequest request;
    request.set_sha256(Sha256Hex(bytes));
    request.set_size(bytes.size());
    request.set_data(bytes.substr(0, kPiece));
    ASSERT_TRUE(stream->Write(request));
    context.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
  }
  std::string got;
  EXPECT_EQ(Get(*visuals_, Sha256Hex(bytes), got).error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(StoredKeys(), 0u);
}

TEST_F(VisualServiceTest, TwoWhoPutTheSameFileBothSucceed) {
  KeepAll();
  const std::string bytes = Bytes(3 << 20);
  std::vector<std::thread> callers;
  callers.reserve(4);
  std::atomic<int> succeeded{0};
  for (int i = 0; i < 4; ++i) {
    callers.emplace_back([&] { succeeded += Put(*visuals_, Whole(bytes)).ok() ? 1 : 0; });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(succeeded, 4);
  EXPECT_EQ(StoredKeys(), 4u) << "a record and three pieces";
  EXPECT_EQ(plane_->Call([](Cluster& cluster, Now) { return cluster.visuals().bytes(); }), bytes.size());
  std::string got;
  ASSERT_TRUE(Get(*visuals_, Sha256Hex(bytes), got).ok());
  EXPECT_TRUE(got == bytes);
}

TEST_F(VisualServiceTest, AFullQuotaTakesNoMore) {
  KeepAll();
  ASSERT_TRUE(Put(*visuals_, Whole(Bytes(4'000'000))).ok());
  const grpc::Status full = Put(*visuals_, Whole(Bytes(1'000'001, 'b')));
  EXPECT_EQ(full.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_THAT(full.error_message(), HasSubstr("size: 1000001 bytes are more than the 1000000 of 5000000"));
  EXPECT_TRUE(Put(*visuals_, Whole(Bytes(1'000'000, 'b'))).ok());
}

TEST_F(VisualServiceTest, OneThatIsNotThereIsNotFound) {
  std::string got;
  const grpc::Status none = Get(*visuals_, Sha256Hex("none"), got);
  EXPECT_EQ(none.error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(none.error_message(), "sha256: the control plane has no file " + Sha256Hex("none") + ".glb");
  EXPECT_EQ(Get(*visuals_, "", got).error_code(), StatusCode::NOT_FOUND);
}

TEST_F(VisualServiceTest, AWorldIsRefusedUntilItsFileIsThereAndThenKeepsIt) {
  AddAgent();
  agent_->Play();
  const std::string bytes = Bytes(1'500'000), sha256 = Sha256Hex(bytes);
  v1::CreateInstanceRequest request = CreateRequest(1);
  request.mutable_spec()->mutable_scene()->mutable_bodies(0)->mutable_shape()->add_visuals()->set_sha256(sha256);
  v1::CreateInstanceResponse created;
  const grpc::Status refused = instances_->CreateInstance(&Context(), request, &created);
  EXPECT_EQ(refused.error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(refused.error_message(), HasSubstr("spec.scene: is drawn with " + sha256 + ".glb"));
  request.set_validate_only(true);
  EXPECT_TRUE(instances_->CreateInstance(&Context(), request, &created).ok()) << "it can still be sent";
  request.set_validate_only(false);
  // Here a file that nothing needs goes at once, so it may have to be sent again.
  const auto end = std::chrono::steady_clock::now() + kPatience;
  do {
    ASSERT_TRUE(Put(*visuals_, Whole(bytes)).ok());
  } while (!instances_->CreateInstance(&Context(), request, &created).ok() && std::chrono::steady_clock::now() < end);
  v1::Instance instance;
  WatchUntil(created.instance().id(), v1::INSTANCE_STATE_RUNNING, &instance);
  std::string got;
  ASSERT_TRUE(Get(*visuals_, sha256, got).ok());
  EXPECT_TRUE(got == bytes);

  v1::DeleteInstanceRequest remove;
  remove.set_id(created.instance().id());
  v1::DeleteInstanceResponse removed;
  ASSERT_TRUE(instances_->DeleteInstance(&Context(), remove, &removed).ok());
  WatchUntil(created.instance().id(), v1::INSTANCE_STATE_ENDED, &instance);
  while (StoredKeys() > 0 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_EQ(StoredKeys(), 0u) << "its pieces are gone, too";
  EXPECT_EQ(Get(*visuals_, sha256, got).error_code(), StatusCode::NOT_FOUND);
}

// A store that fails when it is to take a piece, once.
class FailingStore final : public Store {
 public:
  explicit FailingStore(std::string key) : key_(std::move(key)) {}
  absl::StatusOr<StoreEntry> Get(std::string_view key) const override { return inner.Get(key); }
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                      std::string_view without) const override {
    return inner.ListWithout(prefix, without);
  }
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override {
    if (ops.front().key == key_ && !std::exchange(failed_, true)) return absl::UnavailableError("store: no space left");
    return inner.Txn(ops);
  }
  Revision revision() const override { return inner.revision(); }

  MemoryStore inner;

 private:
  const std::string key_;
  bool failed_ = false;
};

std::string FileIn(ControlPlane& plane, const std::string& sha256) {
  std::string bytes;
  const auto size = plane.VisualSize(sha256);
  while (size.ok() && bytes.size() < *size) bytes += plane.VisualPiece(sha256, bytes.size()).value();
  return bytes;
}

TEST(VisualStoreTest, AStoreThatFailsAtOnePieceKeepsNothingAndTakesTheFileTheNextTime) {
  const std::string bytes = Bytes((3 << 20) + 5), sha256 = Sha256Hex(bytes);
  FailingStore store(VisualPieceKey(sha256, 2));
  const auto plane = LoadPlane(store);
  EXPECT_EQ(plane->PutVisual(sha256, bytes).code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(plane->VisualSize(sha256).status().code(), absl::StatusCode::kNotFound);
  ASSERT_TRUE(plane->PutVisual(sha256, bytes).ok());
  EXPECT_TRUE(FileIn(*plane, sha256) == bytes);
  EXPECT_EQ(store.List(kVisualKeys)->size(), 5u) << "a record and four pieces";
}

TEST(VisualStoreTest, AnotherLifeRemovesWhatOneBeforeItLeft) {
  const std::string bytes = Bytes((3 << 20) + 5), sha256 = Sha256Hex(bytes);
  FailingStore store(VisualPieceKey(sha256, 2));
  auto plane = LoadPlane(store);
  EXPECT_FALSE(plane->PutVisual(sha256, bytes).ok());
  plane.reset();
  plane = LoadPlane(store);
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!store.List(kVisualKeys)->empty() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  EXPECT_TRUE(store.List(kVisualKeys)->empty());
}

TEST(VisualStoreTest, EtcdHasFilesOfMorePiecesThanItTakesAtOnce) {
  FakeEtcd etcd;
  const auto client = *EtcdClient::Make(etcd.address(), {});
  EtcdElection election(*client, etcd.address().prefix, {.operators = "a:1", .players = ""});
  const auto fence = election.Campaign([](const auto&) {}, [] { return false; });
  ASSERT_TRUE(fence.ok()) << fence.status();
  const auto store = *EtcdStore::Open(*client, etcd.address().prefix, *fence, nullptr);
  auto plane = LoadPlane(*store);
  const std::string bytes = Bytes((5 << 20) + 1), sha256 = Sha256Hex(bytes);
  ASSERT_TRUE(plane->PutVisual(sha256, bytes).ok());
  plane.reset();
  plane = LoadPlane(*store);
  EXPECT_TRUE(FileIn(*plane, sha256) == bytes);
}

class VisualDoorsTest : public DoorsTest {
 protected:
  static std::unique_ptr<v1::VisualService::Stub> Stub(const std::shared_ptr<grpc::Channel>& channel) {
    return v1::VisualService::NewStub(channel);
  }
};

TEST_F(VisualDoorsTest, AnOperatorPutsAndAViewerGetsAndAStrangerNothing) {
  const std::string bytes = Bytes(100'000), sha256 = Sha256Hex(bytes);
  const auto operators = Stub(Operators(Token("ada", v1::ROLE_OPERATOR)));
  const auto viewer = Stub(Operators(Token("vic", v1::ROLE_VIEWER)));
  EXPECT_EQ(Put(*Stub(Operators()), Whole(bytes)).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Put(*viewer, Whole(bytes)).error_code(), StatusCode::PERMISSION_DENIED);
  EXPECT_TRUE(Put(*operators, Whole(bytes)).ok());
  std::string got;
  EXPECT_TRUE(Get(*viewer, sha256, got).ok());
  EXPECT_TRUE(got == bytes);
  EXPECT_EQ(Get(*Stub(Operators()), sha256, got).error_code(), StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(Get(*Stub(Players()), sha256, got).error_code(), StatusCode::PERMISSION_DENIED);
  v1::FindMissingVisualsResponse found;
  EXPECT_EQ(viewer->FindMissingVisuals(&Context(), {}, &found).error_code(), StatusCode::PERMISSION_DENIED);
}

TEST_F(VisualDoorsTest, ATokenForOneInstanceGetsWhatThatIsDrawnWithAlone) {
  const std::string bytes = Bytes(1000), sha256 = Sha256Hex(bytes);
  ASSERT_TRUE(Put(*Stub(Socket()), Whole(bytes)).ok());
  std::string got;
  const auto one = Stub(Operators(Token("eve", v1::ROLE_OPERATOR, "inst-1")));
  const grpc::Status none = Get(*one, sha256, got);
  EXPECT_EQ(none.error_code(), StatusCode::NOT_FOUND);
  EXPECT_EQ(none.error_message(), "sha256: no instance that token eve is for is drawn with it");
  EXPECT_EQ(Put(*one, Whole("x")).error_code(), StatusCode::PERMISSION_DENIED);
}

}  // namespace
}  // namespace tessera::control
