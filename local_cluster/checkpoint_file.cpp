#include "local_cluster/checkpoint_file.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>

#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

constexpr std::size_t kPieceBytes = 1 << 20;

}  // namespace

void ExportCheckpoint(Connection& connection, const std::string& id, std::uint64_t tick, const std::string& path,
                      std::chrono::milliseconds timeout) {
  v1::ExportCheckpointRequest request;
  request.set_id(id);
  request.set_tick(tick);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  const auto stream = connection.instances().ExportCheckpoint(&context, request);
  const std::string draft = path + ".new";
  std::ofstream out(draft, std::ios::binary | std::ios::trunc);
  v1::ExportCheckpointResponse piece;
  while (stream->Read(&piece)) out << piece.data();
  out.close();
  const grpc::Status status = stream->Finish();
  const bool kept = status.ok() && out && std::rename(draft.c_str(), path.c_str()) == 0;
  if (!kept) std::remove(draft.c_str());
  connection.Check(status, "instance export");
  if (!kept) throw CommandError(fmt::format("{} cannot be written", path));
}

v1::Instance ImportCheckpoint(Connection& connection, const std::string& path, const ImportOptions& options) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw CommandError(fmt::format("{} cannot be read", path));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + options.timeout);
  v1::ImportCheckpointResponse response;
  const auto stream = connection.instances().ImportCheckpoint(&context, &response);
  v1::ImportCheckpointRequest piece;
  piece.set_request_id(options.request_id);
  piece.set_validate_only(options.validate_only);
  std::string buffer(kPieceBytes, '\0');
  do {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    piece.set_data(buffer.data(), static_cast<std::size_t>(in.gcount()));
    if (!stream->Write(piece)) break;  // refused: the status says why
    piece.Clear();
  } while (in);
  stream->WritesDone();
  connection.Check(stream->Finish(), "instance import");
  return response.instance();
}

}  // namespace tessera::local
