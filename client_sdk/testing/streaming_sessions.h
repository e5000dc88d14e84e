// StreamingSessions: gives scenes in pieces, by the GetScene of the test double that it is a part of.
//
// Thread rule: gRPC's threads.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <cstddef>

#include "tessera/v1/session.grpc.pb.h"

namespace tessera::client {

class StreamingSessions : public v1::SessionService::Service {
 public:
  grpc::Status StreamScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                           grpc::ServerWriter<v1::GetSceneResponse>* writer) override {
    constexpr std::size_t kPiece = 100;
    if (knows_no_streams) return {grpc::StatusCode::UNIMPLEMENTED, ""};
    v1::GetSceneResponse whole, piece;
    if (grpc::Status status = GetScene(context, request, &whole); !status.ok()) return status;
    for (std::size_t at = 0; at < whole.scene().size(); at += kPiece) {
      piece.set_scene(whole.scene().substr(at, kPiece));
      writer->Write(piece);
    }
    return grpc::Status::OK;
  }

  std::atomic<bool> knows_no_streams = false;  // as a control plane of an earlier release
};

}  // namespace tessera::client
