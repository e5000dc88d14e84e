// Large scenes on their way to a control plane that is played.
#include "local_cluster/scene_upload.h"

#include <gmock/gmock.h>
#include <sodium.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/world/scene_io.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::size_t kAtMostInRequest = 1000;

// It has the scenes that it was sent, and makes worlds of those.
class PlayedInstances final : public v1::InstanceService::Service {
 public:
  grpc::Status CreateInstance(grpc::ServerContext*, const v1::CreateInstanceRequest* request,
                              v1::CreateInstanceResponse* response) override {
    const std::lock_guard lock(mutex_);
    const v1::InstanceSpec& spec = request->spec();
    said_.push_back(spec.has_scene() ? "scene" : old_ ? "nothing" : "file");
    if (!spec.has_scene() && (old_ || spec.scene_file().empty())) {
      return {grpc::StatusCode::INVALID_ARGUMENT, "spec.scene: missing"};
    }
    v1::Scene scene = spec.scene();
    if (!spec.has_scene()) {
      const auto found = std::find_if(scenes_.begin(), scenes_.end(),
                                      [&](const v1::Scene& one) { return SceneHash(one) == spec.scene_file(); });
      if (found == scenes_.end()) return {grpc::StatusCode::FAILED_PRECONDITION, "spec.scene_file: is not here"};
      scene = *found;
    }
    response->mutable_instance()->set_scene_name(scene.name());
    return grpc::Status::OK;
  }
  grpc::Status PutScene(grpc::ServerContext*, grpc::ServerReader<v1::PutSceneRequest>* reader,
                        v1::PutSceneResponse*) override {
    v1::PutSceneRequest first, piece;
    reader->Read(&first);
    std::string bytes = first.data();
    while (reader->Read(&piece)) bytes += piece.data();
    v1::Scene scene;
    const bool whole = bytes.size() == first.size() && scene.ParseFromString(bytes);
    EXPECT_TRUE(whole);
    EXPECT_EQ(SceneHash(scene), first.scene_hash());
    const std::lock_guard lock(mutex_);
    if (full_) return {grpc::StatusCode::RESOURCE_EXHAUSTED, "size: there is no room"};
    scenes_.push_back(scene);
    return grpc::Status::OK;
  }

  void SetOld() {
    const std::lock_guard lock(mutex_);
    old_ = true;
  }
  void SetFull() {
    const std::lock_guard lock(mutex_);
    full_ = true;
  }
  // One word for each request, by what it had.
  std::vector<std::string> said() const {
    const std::lock_guard lock(mutex_);
    return said_;
  }
  std::size_t scenes() const {
    const std::lock_guard lock(mutex_);
    return scenes_.size();
  }

 private:
  mutable std::mutex mutex_;
  bool old_ = false, full_ = false;
  std::vector<std::string> said_;
  std::vector<v1::Scene> scenes_;
};

class SceneUploadTest : public ::testing::Test {
 protected:
  SceneUploadTest() {
    EXPECT_GE(sodium_init(), 0);
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
  }
  // The name of the scene of the world that is made, whose scene is of about that size.
  std::string Create(std::size_t size) {
    v1::CreateInstanceRequest request;
    request.mutable_spec()->mutable_scene()->set_name("level");
    auto& mesh = *request.mutable_spec()->mutable_scene()->add_bodies()->mutable_shape()->mutable_mesh();
    constexpr std::size_t kVertexBytes = 11;
    for (std::size_t at = 0; at < size; at += kVertexBytes) mesh.add_vertices()->set_x(1);
    Connection connection(address_);
    return CreateInstance(
               connection, request, [this](std::size_t bytes) { sent_ += bytes; }, kAtMostInRequest)
        .instance()
        .scene_name();
  }

  const host::TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.path() + "/control.sock";
  PlayedInstances service_;
  std::unique_ptr<grpc::Server> server_;
  std::size_t sent_ = 0;
};

TEST_F(SceneUploadTest, ASmallSceneGoesInTheRequest) {
  EXPECT_EQ(Create(100), "level");
  EXPECT_THAT(service_.said(), ElementsAre("scene"));
  EXPECT_EQ(sent_, 0u);
}

TEST_F(SceneUploadTest, ALargeOneIsSentBeforeAndOnce) {
  EXPECT_EQ(Create(3'000'000), "level");
  EXPECT_THAT(service_.said(), ElementsAre("file", "file"));
  EXPECT_GE(sent_, 3'000'000u);
  const std::size_t sent = sent_;
  EXPECT_EQ(Create(3'000'000), "level");
  EXPECT_THAT(service_.said(), ElementsAre("file", "file", "file"));
  EXPECT_EQ(sent_, sent) << "it was there";
  EXPECT_EQ(service_.scenes(), 1u);
}

TEST_F(SceneUploadTest, AControlPlaneOfAnEarlierReleaseTakesItInTheRequest) {
  service_.SetOld();
  EXPECT_EQ(Create(5000), "level");
  EXPECT_THAT(service_.said(), ElementsAre("nothing", "scene"));
  EXPECT_EQ(sent_, 0u);
}

TEST_F(SceneUploadTest, WhatTheControlPlaneSaysIsSaid) {
  service_.SetFull();
  try {
    Create(5000);
    FAIL() << "there is no room";
  } catch (const CommandError& error) {
    EXPECT_THAT(error.what(), HasSubstr("there is no room"));
  }
}

}  // namespace
}  // namespace tessera::local
