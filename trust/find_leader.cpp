#include "trust/find_leader.h"

#include <grpcpp/generic/generic_stub.h>

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "trust/dial.h"

namespace tessera::trust {
namespace {

constexpr char kHealthMethod[] = "/grpc.health.v1.Health/Check";
// HealthCheckResponse on the wire: field 1, `status`, is SERVING.
constexpr std::string_view kServing("\x08\x01", 2);

// Answers of all members, in any order, on threads of gRPC.
struct Answers {
  std::mutex mutex;
  std::condition_variable came;
  std::size_t open = 0;
  std::shared_ptr<grpc::Channel> leader;
  std::vector<std::string> reasons;

  void Take(const Asked& member, const std::string& reason) {
    const std::lock_guard lock(mutex);
    --open;
    if (!reason.empty()) {
      reasons.push_back(absl::StrCat(member.name, ": ", reason));
    } else if (!leader) {
      leader = *member.channel;
    }
    came.notify_all();
  }
};

// Ends itself. It holds the answers, which may outlive the one who asked.
struct HealthCall {
  HealthCall(std::shared_ptr<Answers> to, Asked of)
      : answers(std::move(to)), member(std::move(of)), stub(*member.channel) {
    context.set_deadline(std::chrono::system_clock::now() + kFindLeaderPatience);
  }
  void Begin() {
    stub.UnaryCall(&context, kHealthMethod, grpc::StubOptions(), &request, &response,
                   [this](const grpc::Status& status) {
                     answers->Take(member, Reason(status));
                     delete this;
                   });
  }
  // Empty: it serves.
  std::string Reason(const grpc::Status& status) const {
    if (!status.ok()) return status.error_message();
    std::vector<grpc::Slice> slices;
    std::string bytes;
    if (response.Dump(&slices).ok()) {
      for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
    }
    return bytes == kServing ? "" : "follows";
  }

  const std::shared_ptr<Answers> answers;
  const Asked member;
  grpc::GenericStub stub;
  grpc::ClientContext context;
  grpc::ByteBuffer request, response;
};

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> FindLeader(const std::vector<Asked>& members) {
  const auto answers = std::make_shared<Answers>();
  answers->open = members.size();
  std::vector<std::string> names;
  for (const Asked& member : members) {
    names.push_back(member.name);
    if (!member.channel.ok()) {
      answers->Take(member, std::string(member.channel.status().message()));
      continue;
    }
    auto* call = new HealthCall(answers, member);
    const grpc::Slice nothing;
    call->request = grpc::ByteBuffer(&nothing, 1);
    call->Begin();
  }
  std::unique_lock lock(answers->mutex);
  answers->came.wait(lock, [&] { return answers->leader || answers->open == 0; });
  if (answers->leader) return answers->leader;
  return absl::UnavailableError(absl::StrCat("no control plane of ", absl::StrJoin(names, ", "),
                                             " leads: ", absl::StrJoin(answers->reasons, "; ")));
}

}  // namespace tessera::trust
