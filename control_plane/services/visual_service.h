// VisualServiceImpl: VisualService at one door. Thread rule: as Answerer.
#pragma once

#include <string>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/services/answerer.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::control {

class VisualServiceImpl final : public v1::VisualService::Service, Answerer {
 public:
  using Answerer::Answerer;

  grpc::Status FindMissingVisuals(grpc::ServerContext* context, const v1::FindMissingVisualsRequest* request,
                                  v1::FindMissingVisualsResponse* response) override {
    const std::string subject = absl::StrCat(request->sha256_size(), " files");
    return Answer(context, "VisualService/FindMissingVisuals", CallKind::kRead, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return cluster.visuals().FindMissing(*request); }),
                  response);
    });
  }
  StreamHandlers Streams() {
    StreamHandlers streams;
    streams["PutVisual"] = ClientStream(this, &VisualServiceImpl::ReceiveVisual);
    return streams;
  }
  // For PutVisual.
  grpc::Status ReceiveVisual(grpc::ServerContext* context, grpc::ServerReader<grpc::ByteBuffer>* stream,
                             v1::PutVisualResponse*) {
    static constexpr char kMethod[] = "VisualService/PutVisual";
    // Read before it is judged, so that the log has the name of the file.
    auto reader = PiecesOf<v1::PutVisualRequest>(*context, *stream, kMethod);
    v1::PutVisualRequest first;
    const bool came = reader.Read(&first);
    return Answer(context, kMethod, CallKind::kCommand, first.sha256(), [&]() -> absl::Status {
      if (!reader.status().ok()) return reader.status();
      if (!came) return absl::InvalidArgumentError("sha256: nothing came");
      const absl::Status wanted = plane_.CheckPutVisual(first.sha256(), first.size());
      if (absl::IsAlreadyExists(wanted)) return absl::OkStatus();
      if (!wanted.ok()) return wanted;
      std::string bytes;
      if (absl::Status status = ReadAll(reader, first, bytes); !status.ok()) return status;
      return plane_.PutVisual(first.sha256(), bytes);
    });
  }
  grpc::Status GetVisual(grpc::ServerContext* context, const v1::GetVisualRequest* request,
                         grpc::ServerWriter<v1::GetVisualResponse>* writer) override {
    return Answer(context, "VisualService/GetVisual", CallKind::kRead, request->sha256(), [&]() -> absl::Status {
      const Caller caller = CallerOf(*context);
      const auto shown = [&](const std::string& id) { return CheckInstance(caller, id).ok(); };
      const bool may = HasAllInstances(caller) || plane_.Call([&](Cluster& cluster, Now) {
        return ShowsVisual(cluster.state(), request->sha256(), shown);
      });
      if (may) return SendAll(request->sha256(), *writer);
      return absl::NotFoundError(
          absl::StrCat("sha256: no instance that token ", caller.token, " is for is drawn with it"));
    });
  }

 private:
  // All pieces up to the size that the first message says; no more is read than that.
  static absl::Status ReadAll(BoundedReader<v1::PutVisualRequest>& reader, v1::PutVisualRequest piece,
                              std::string& bytes) {
    const std::uint64_t size = piece.size();
    do {
      if (piece.data().size() > kVisualPieceBytes) {
        return absl::InvalidArgumentError(
            absl::StrCat("data: a piece of ", piece.data().size(), " bytes, at most ", kVisualPieceBytes));
      }
      if (bytes.size() + piece.data().size() > size) {
        return absl::InvalidArgumentError(absl::StrCat("data: more than the ", size, " bytes that were said"));
      }
      bytes += piece.data();
    } while (reader.Read(&piece));
    if (!reader.status().ok()) return reader.status();
    if (bytes.size() == size) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("data: ended after ", bytes.size(), " of ", size, " bytes"));
  }
  absl::Status SendAll(const std::string& sha256, grpc::ServerWriter<v1::GetVisualResponse>& writer) {
    const auto size = plane_.VisualSize(sha256);
    if (!size.ok()) return size.status();
    v1::GetVisualResponse message;
    message.set_size(*size);
    for (std::uint64_t at = 0; at < *size; at += kVisualStoredBytes) {
      const auto stored = plane_.VisualPiece(sha256, at);
      if (!stored.ok()) return stored.status();
      for (std::size_t within = 0; within < stored->size(); within += kVisualPieceBytes) {
        message.set_data(stored->substr(within, kVisualPieceBytes));
        if (!writer.Write(message)) return absl::CancelledError("the caller has gone");
        message.Clear();
      }
    }
    return absl::OkStatus();
  }
};

}  // namespace tessera::control
