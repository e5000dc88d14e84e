// Large scenes over real calls: they come before the request that makes a world of them, and go out in pieces.
#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <utility>

#include "control_plane/checkpoint_files.h"
#include "control_plane/testing/grpc_server_fixture.h"
#include "core/world/scene_io.h"

namespace tessera::control {
namespace {

using grpc::StatusCode;
using ::testing::HasSubstr;

class SceneServiceTest : public GrpcServerTest {
 protected:
  void SetUp() override {
    settings_.lost_after = std::chrono::hours(1);  // nobody plays the agent
    GrpcServerTest::SetUp();
    AddAgent();
  }
  std::unique_ptr<CheckpointFiles> OpenFiles() override {
    auto files = CheckpointFiles::Open(folder_.path() + "/checkpoints");
    EXPECT_TRUE(files.ok()) << files.status();
    return files.ok() ? *std::move(files) : nullptr;
  }

  grpc::Status Put(const std::string& hash, std::uint64_t size, const std::string& bytes) {
    Context context;
    v1::PutSceneResponse response;
    const auto stream = instances_->PutScene(&context, &response);
    v1::PutSceneRequest piece;
    piece.set_scene_hash(hash);
    piece.set_size(size);
    constexpr std::size_t kPiece = std::size_t{1} << 20;
    for (std::size_t at = 0; at < bytes.size(); at += kPiece) {
      piece.set_data(bytes.substr(at, kPiece));
      if (!stream->Write(piece)) break;
      piece.Clear();
    }
    stream->WritesDone();
    return stream->Finish();
  }
  grpc::Status Put(const v1::Scene& scene) {
    const std::string bytes = scene.SerializeAsString();
    return Put(SceneHash(scene), bytes.size(), bytes);
  }
  grpc::Status Create(const std::string& hash, v1::CreateInstanceResponse& response) {
    v1::CreateInstanceRequest request;
    request.mutable_spec()->set_scene_file(hash);
    request.mutable_spec()->set_regions(1);
    return instances_->CreateInstance(&Context(), request, &response);
  }
  // The fixture's scene, with a ground of so many squares a side, two triangles each.
  static v1::Scene Level(std::uint32_t side) {
    v1::Scene scene = TestScene();
    v1::Body& ground = *scene.add_bodies();
    ground.set_id(9);
    ground.set_motion(v1::MOTION_STATIC);
    auto& mesh = *ground.mutable_shape()->mutable_mesh();
    for (std::uint32_t row = 0; row <= side; ++row) {
      for (std::uint32_t column = 0; column <= side; ++column) {
        v1::Vec3& vertex = *mesh.add_vertices();
        vertex.set_x(-40 + 80.0 * column / side);
        vertex.set_y(-5);
        vertex.set_z(-40 + 80.0 * row / side);
      }
    }
    for (std::uint32_t row = 0; row < side; ++row) {
      for (std::uint32_t column = 0; column < side; ++column) {
        const std::uint32_t at = row * (side + 1) + column, below = at + side + 1;
        for (const std::uint32_t index : {at, below, at + 1, at + 1, below, below + 1}) mesh.add_indices(index);
      }
    }
    return scene;
  }
};

TEST_F(SceneServiceTest, AWorldIsMadeOfASceneThatWasSentBefore) {
  const v1::Scene scene = Level(224);
  const std::string hash = SceneHash(scene);
  ASSERT_GT(scene.ByteSizeLong(), std::size_t{2} << 20) << "several pieces";
  v1::CreateInstanceResponse made;
  const grpc::Status early = Create(hash, made);
  EXPECT_EQ(early.error_code(), StatusCode::FAILED_PRECONDITION);
  EXPECT_THAT(early.error_message(), HasSubstr("spec.scene_file: no scene " + hash + " is here"));

  const grpc::Status put = Put(scene);
  ASSERT_TRUE(put.ok()) << put.error_message();
  EXPECT_TRUE(Put(scene).ok()) << "it is there";
  const grpc::Status created = Create(hash, made);
  ASSERT_TRUE(created.ok()) << created.error_message();
  EXPECT_EQ(made.instance().scene_hash(), hash);
  EXPECT_EQ(made.instance().scene_name(), "table");
  v1::CreateInstanceResponse second;
  EXPECT_TRUE(Create(hash, second).ok()) << "of the same";
  EXPECT_NE(second.instance().id(), made.instance().id());

  Context context;
  v1::GetSceneRequest request;
  request.set_scene_hash(hash);
  const auto stream = sessions_->StreamScene(&context, request);
  v1::GetSceneResponse piece;
  std::string bytes;
  int pieces = 0;
  for (; stream->Read(&piece); ++pieces) bytes += piece.scene();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_GT(pieces, 2);
  EXPECT_TRUE(bytes == scene.SerializeAsString());

  v1::FetchSceneRequest fetch;
  fetch.set_scene_hash(hash);
  fetch.set_host_id(agent_->admitted.host_id());
  fetch.set_host_secret(agent_->admitted.host_secret());
  Context agents;
  const auto fetched = v1::AgentLinkService::NewStub(channel_)->StreamScene(&agents, fetch);
  v1::FetchSceneResponse part;
  std::string got;
  while (fetched->Read(&part)) got += part.scene();
  EXPECT_TRUE(fetched->Finish().ok());
  EXPECT_TRUE(got == bytes);
}

TEST_F(SceneServiceTest, WhatIsWrongWithASceneIsNamed) {
  const v1::Scene scene = Level(3);
  const std::string bytes = scene.SerializeAsString(), hash = SceneHash(scene);
  EXPECT_THAT(Put("level", bytes.size(), bytes).error_message(), HasSubstr("scene_hash: "));
  EXPECT_THAT(Put(hash, bytes.size() + 1, bytes).error_message(), HasSubstr("data: ended after"));
  EXPECT_THAT(Put(hash, bytes.size() - 1, bytes).error_message(), HasSubstr("data: more than"));
  EXPECT_THAT(Put(std::string(64, 'a'), bytes.size(), bytes).error_message(), HasSubstr("another hash"));
  v1::CreateInstanceResponse made;
  EXPECT_EQ(Create(hash, made).error_code(), StatusCode::FAILED_PRECONDITION) << "nothing of it is kept";

  v1::Scene bad = scene;
  bad.mutable_bodies(1)->set_mass(-2);
  ASSERT_TRUE(Put(bad).ok()) << "it is checked with the world";
  const grpc::Status refused = Create(SceneHash(bad), made);
  EXPECT_EQ(refused.error_code(), StatusCode::INVALID_ARGUMENT);
  EXPECT_THAT(refused.error_message(), HasSubstr("spec.scene_file: "));
  EXPECT_THAT(refused.error_message(), HasSubstr("mass"));

  v1::CreateInstanceRequest both;
  *both.mutable_spec()->mutable_scene() = scene;
  both.mutable_spec()->set_scene_file(hash);
  both.mutable_spec()->set_regions(1);
  EXPECT_THAT(instances_->CreateInstance(&Context(), both, &made).error_message(),
              HasSubstr("spec.scene_file: spec.scene is there too"));
}

}  // namespace
}  // namespace tessera::control
