#include "local_cluster/scene_upload.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <chrono>
#include <string>
#include <utility>

#include "core/world/scene_io.h"
#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

constexpr char kCreating[] = "instance create";
constexpr std::size_t kScenePieceBytes = std::size_t{1} << 20;
constexpr std::chrono::seconds kSmallPatience{10};
// Sending 256 MiB over a line of 5 Mbit/s; checking a level of millions of triangles on a busy machine.
constexpr std::chrono::minutes kScenePatience{10};
constexpr std::chrono::minutes kLargePatience{2};

// As SceneHash reads it.
std::string Serialised(const v1::Scene& scene) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream out(&stream);
    out.SetSerializationDeterministic(true);
    scene.SerializePartialToCodedStream(&out);
  }
  return bytes;
}

void SendScene(Connection& connection, const std::string& hash, const std::string& bytes) {
  v1::PutSceneRequest first;
  first.set_scene_hash(hash);
  first.set_size(bytes.size());
  connection.Send("scene", connection.instances(), &v1::InstanceService::Stub::PutScene, first, bytes, kScenePieceBytes,
                  kScenePatience);
}

grpc::Status TryCreate(Connection& connection, const v1::CreateInstanceRequest& request,
                       v1::CreateInstanceResponse& response) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kLargePatience);
  return connection.instances().CreateInstance(&context, request, &response);
}

bool SaysOf(const grpc::Status& status, grpc::StatusCode code, const std::string& field) {
  return status.error_code() == code && status.error_message().compare(0, field.size(), field) == 0;
}

}  // namespace

v1::CreateInstanceResponse CreateInstance(Connection& connection, v1::CreateInstanceRequest request,
                                          const std::function<void(std::size_t bytes)>& on_sent,
                                          std::size_t most_in_request) {
  if (request.spec().scene().ByteSizeLong() <= most_in_request) {
    return connection.Call(kCreating, connection.instances(), &v1::InstanceService::Stub::CreateInstance, request,
                           kSmallPatience);
  }
  const std::string hash = SceneHash(request.spec().scene()), bytes = Serialised(request.spec().scene());
  request.mutable_spec()->clear_scene();
  request.mutable_spec()->set_scene_file(hash);
  v1::CreateInstanceResponse response;
  grpc::Status status = TryCreate(connection, request, response);
  if (SaysOf(status, grpc::StatusCode::FAILED_PRECONDITION, "spec.scene_file: ")) {
    SendScene(connection, hash, bytes);
    if (on_sent) on_sent(bytes.size());
    status = TryCreate(connection, request, response);
  } else if (SaysOf(status, grpc::StatusCode::INVALID_ARGUMENT, "spec.scene: missing")) {
    // An earlier release does not know the field.
    request.mutable_spec()->clear_scene_file();
    request.mutable_spec()->mutable_scene()->ParseFromString(bytes);
    status = TryCreate(connection, request, response);
  }
  connection.Check(status, kCreating);
  return response;
}

}  // namespace tessera::local
