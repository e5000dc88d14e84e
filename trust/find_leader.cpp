#include "trust/find_leader.h"

#include <grpcpp/generic/generic_stub.h>

#include <chrono>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "trust/dial.h"

namespace tessera::trust {
namespace {

constexpr char kHealthMethod[] = "/grpc.health.v1.Health/Check";
// HealthCheckResponse on the wire: field 1, `status`, is SERVING.
constexpr std::string_view kServing("\x08\x01", 2);

// One member is asked. It lives until its answer was taken from the queue.
struct HealthCall {
  HealthCall(const Asked& of, grpc::CompletionQueue& queue) : member(of), stub(*of.channel) {
    context.set_deadline(std::chrono::system_clock::now() + kFindLeaderPatience);
    const grpc::Slice nothing;
    call = stub.PrepareUnaryCall(&context, kHealthMethod, grpc::ByteBuffer(&nothing, 1), &queue);
    call->StartCall();
    call->Finish(&response, &status, this);
  }
  // Empty: it serves.
  std::string Reason() const {
    if (!status.ok()) return status.error_message();
    std::vector<grpc::Slice> slices;
    std::string bytes;
    if (response.Dump(&slices).ok()) {
      for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    return bytes == kServing ? "" : "follows";
  }

  const Asked& member;
  grpc::GenericStub stub;
  grpc::ClientContext context;
  grpc::ByteBuffer response;
  grpc::Status status;
  std::unique_ptr<grpc::ClientAsyncResponseReader<grpc::ByteBuffer>> call;
};

}  // namespace

// By a queue of our own, so that nothing is left on threads of gRPC when channels go.
absl::StatusOr<std::shared_ptr<grpc::Channel>> FindLeader(const std::vector<Asked>& members) {
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<HealthCall>> calls;
  std::vector<std::string> names, reasons;
  for (const Asked& member : members) {
    names.push_back(member.name);
    if (member.channel.ok()) {
      calls.push_back(std::make_unique<HealthCall>(member, queue));
    } else {
      reasons.push_back(absl::StrCat(member.name, ": ", member.channel.status().message()));
    }
  }
  std::shared_ptr<grpc::Channel> leader;
  void* tag = nullptr;
  bool ok = false;
  for (std::size_t open = calls.size(); open > 0 && queue.Next(&tag, &ok); --open) {
    const auto& call = *static_cast<HealthCall*>(tag);
    const std::string reason = call.Reason();
    if (!reason.empty()) reasons.push_back(absl::StrCat(call.member.name, ": ", reason));
    if (!reason.empty() || leader) continue;
    leader = *call.member.channel;
    for (const auto& other : calls) other->context.TryCancel();  // their answers come at once, and are not needed
  }
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
  if (leader) return leader;
  return absl::UnavailableError(
      absl::StrCat("no control plane of ", absl::StrJoin(names, ", "), " leads: ", absl::StrJoin(reasons, "; ")));
}

}  // namespace tessera::trust
