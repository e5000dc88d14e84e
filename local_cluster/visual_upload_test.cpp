// Files of meshes on their way to a control plane that is played.
#include "local_cluster/visual_upload.h"

#include <gmock/gmock.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PlayedVisuals final : public v1::VisualService::Service {
 public:
  grpc::Status FindMissingVisuals(grpc::ServerContext*, const v1::FindMissingVisualsRequest* request,
                                  v1::FindMissingVisualsResponse* response) override {
    ++asked;
    if (old) return {grpc::StatusCode::UNIMPLEMENTED, ""};
    for (const std::string& sha256 : request->sha256()) {
      if (!Has(sha256)) response->add_sha256(sha256);
    }
    return grpc::Status::OK;
  }
  grpc::Status PutVisual(grpc::ServerContext*, grpc::ServerReader<v1::PutVisualRequest>* reader,
                         v1::PutVisualResponse*) override {
    v1::PutVisualRequest first, piece;
    reader->Read(&first);
    if (full) return {grpc::StatusCode::RESOURCE_EXHAUSTED, "size: there is no room"};
    std::string bytes = first.data();
    while (reader->Read(&piece)) bytes += piece.data();
    EXPECT_EQ(bytes.size(), first.size());
    Keep(first.sha256(), bytes);
    return grpc::Status::OK;
  }

  void Keep(const std::string& sha256, const std::string& bytes) {
    const std::lock_guard lock(mutex_);
    files_[sha256] = bytes;
  }
  std::map<std::string, std::string> Files() const {
    const std::lock_guard lock(mutex_);
    return files_;
  }
  bool Has(const std::string& sha256) const { return Files().contains(sha256); }

  std::atomic<int> asked = 0;
  std::atomic<bool> full = false, old = false;

 private:
  // Calls come one after the other, but by other threads, and gRPC's library does not show TSan that.
  mutable std::mutex mutex_;
  std::map<std::string, std::string> files_;
};

class VisualUploadTest : public ::testing::Test {
 protected:
  VisualUploadTest() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    std::filesystem::create_directory(folder_.path() + "/visuals");
  }
  std::string Keep(const std::string& bytes) {
    std::string sha256 = Sha256Hex(bytes);
    KeepAs(sha256, bytes);
    return sha256;
  }
  void KeepAs(const std::string& sha256, const std::string& bytes) {
    std::ofstream(Visuals() + "/" + sha256 + ".glb", std::ios::binary) << bytes;
  }
  std::string Visuals() const { return VisualsBeside(folder_.path() + "/level.json"); }
  void DrawWith(const std::string& sha256) { scene_.add_bodies()->mutable_shape()->add_visuals()->set_sha256(sha256); }
  std::size_t Sent(VisualSending sending = VisualSending::kSend) {
    Connection connection(address_);
    return SendVisuals(connection, scene_, Visuals(), sending).size();
  }
  std::string ErrorOf() {
    try {
      Sent();
    } catch (const CommandError& error) {
      return error.what();
    }
    return "none";
  }

  const host::TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.path() + "/control.sock";
  PlayedVisuals service_;
  std::unique_ptr<grpc::Server> server_;
  v1::Scene scene_;
};

TEST_F(VisualUploadTest, WhatIsMissingIsSentOnce) {
  const std::string large(200'000, 'x');
  const std::string sha256 = Keep(large);
  DrawWith(sha256);
  DrawWith(sha256);
  DrawWith(Keep("small"));
  EXPECT_EQ(Sent(VisualSending::kOnlyCheck), 2u);
  EXPECT_THAT(service_.Files(), IsEmpty());
  EXPECT_EQ(Sent(), 2u);
  EXPECT_EQ(service_.Files().size(), 2u);
  EXPECT_TRUE(service_.Files()[sha256] == large);
  EXPECT_EQ(Sent(), 0u);
}

TEST_F(VisualUploadTest, ASceneOfShapesAsksNobody) {
  scene_.add_bodies();
  EXPECT_EQ(Sent(), 0u);
  EXPECT_EQ(service_.asked, 0);
}

TEST_F(VisualUploadTest, AFileThatIsNotHereOrDamagedIsNamedUnlessTheControlPlaneHasIt) {
  const std::string sha256 = Sha256Hex("whole");
  DrawWith(sha256);
  EXPECT_THAT(ErrorOf(),
              HasSubstr(Visuals() + "/" + sha256 + ".glb is missing, and the control plane does not have it"));
  KeepAs(sha256, "whol");
  EXPECT_THAT(ErrorOf(), HasSubstr(sha256 + ".glb is damaged: it has another hash"));
  EXPECT_THAT(service_.Files(), IsEmpty());
  service_.Keep(sha256, "whole");
  EXPECT_EQ(ErrorOf(), "none");
}

TEST_F(VisualUploadTest, ARefusalIsQuoted) {
  DrawWith(Keep(std::string(1'000'000, 'x')));
  service_.full = true;
  EXPECT_EQ(ErrorOf(), "meshes of the scene: size: there is no room (RESOURCE_EXHAUSTED)");
}

TEST_F(VisualUploadTest, AControlPlaneOfAnEarlierReleaseIsSentNothing) {
  DrawWith(Keep("x"));
  service_.old = true;
  EXPECT_EQ(Sent(), 0u);
}

}  // namespace
}  // namespace tessera::local
