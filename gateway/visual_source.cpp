#include "gateway/visual_source.h"

#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/sha256.h"
#include "tessera/v1/visuals.grpc.pb.h"

namespace tessera::gateway {
namespace {

absl::Status FromGrpc(const grpc::Status& status) {
  // The words of a method that is not known help nobody.
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return absl::NotFoundError("the control plane is of an earlier release, and keeps no files of meshes");
  }
  if (status.error_code() == grpc::StatusCode::NOT_FOUND) return absl::NotFoundError(status.error_message());
  return absl::UnavailableError(absl::StrCat("the control plane did not send it: ", status.error_message()));
}

}  // namespace

absl::StatusOr<std::string> VisualSource::Get(const std::string& sha256) {
  auto kept = cache_.Get(sha256);
  if (!absl::IsNotFound(kept.status())) return kept;
  auto fetched = Fetch(sha256);
  if (!fetched.ok()) return fetched;
  spdlog::info("visual fetched sha256={} bytes={}", sha256, fetched->size());
  cache_.Put(sha256, *fetched);
  return fetched;
}

absl::StatusOr<std::string> VisualSource::Fetch(const std::string& sha256) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kFetchPatience);
  if (!Begin(context)) return absl::UnavailableError("this gateway is ending");
  v1::GetVisualRequest request;
  request.set_sha256(sha256);
  const auto stream = v1::VisualService::NewStub(channel_)->GetVisual(&context, request);
  std::string bytes;
  std::uint64_t size = 0;
  bool fits = true;
  v1::GetVisualResponse piece;
  for (bool first = true; fits && stream->Read(&piece); first = false) {
    if (first) size = piece.size();
    fits = size <= kMaxVisualFile_bytes && bytes.size() + piece.data().size() <= size;
    if (fits) bytes += piece.data();
  }
  if (!fits) context.TryCancel();
  const grpc::Status status = stream->Finish();
  End(context);
  if (!fits) return absl::DataLossError(absl::StrCat(sha256, ".glb is larger than it may be"));
  if (!status.ok()) return FromGrpc(status);
  if (bytes.size() != size || Sha256Hex(bytes) != sha256) {
    return absl::DataLossError(absl::StrCat(sha256, ".glb came with another hash"));
  }
  return bytes;
}

bool VisualSource::Begin(grpc::ClientContext& call) {
  const std::lock_guard lock(mutex_);
  if (!stopped_) calls_.insert(&call);
  return !stopped_;
}

void VisualSource::End(grpc::ClientContext& call) {
  const std::lock_guard lock(mutex_);
  calls_.erase(&call);
}

void VisualSource::Stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (grpc::ClientContext* call : calls_) call->TryCancel();
}

}  // namespace tessera::gateway
