#include "control_plane/join_requests.h"

#include <spdlog/spdlog.h>

#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "telemetry/logging.h"

namespace tessera::control {
namespace {

constexpr char kJoinPath[] = "/v1/join", kLeavePath[] = "/v1/leave", kListPath[] = "/v1/instances";
// A join waits so long for its world. Who needs longer asks again, with a new ticket.
constexpr std::chrono::seconds kJoinPatience{60};
// A list is no longer: so many worlds, and of so many of those that wait for players who is in.
constexpr std::size_t kMostListed = 256, kMostListedWaiting = 16;

std::vector<v1::Instance> ListedInstances(const ClusterState& state) {
  std::vector<v1::Instance> listed;
  v1::ListInstancesRequest request;
  std::size_t waiting = 0;
  do {
    const auto page = ListInstances(state, request);
    if (!page.ok() || page->instances().empty()) break;
    for (const v1::Instance& instance : page->instances()) {
      if (listed.size() == kMostListed) break;
      listed.push_back(instance);
      if (instance.state() != v1::INSTANCE_STATE_WAITING_FOR_PLAYERS || waiting == kMostListedWaiting) continue;
      ++waiting;
      if (auto whole = GetInstance(state, instance.id()); whole.ok()) listed.back() = *std::move(whole);
    }
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty() && listed.size() < kMostListed);
  return listed;
}

}  // namespace

bool JoinRequests::Has(std::string_view path) { return path == kJoinPath || path == kLeavePath || path == kListPath; }

PageAnswer JoinRequests::CarryOut(const PageRequest& request, const std::function<bool()>& given_up) {
  const auto begun = std::chrono::steady_clock::now();
  Outcome outcome = request.path == kJoinPath   ? Join(request, given_up)
                    : request.path == kListPath ? List(request)
                                                : Leave(request);
  const auto took = std::chrono::steady_clock::now() - begun;
  metrics_.ObserveRpc(request.path, took);
  Log(request, outcome, took);
  return std::move(outcome.answer);
}

JoinRequests::Outcome JoinRequests::Join(const PageRequest& request, const std::function<bool()>& given_up) {
  const auto begun = std::chrono::steady_clock::now();
  const auto over = [&] { return given_up() || std::chrono::steady_clock::now() - begun > kJoinPatience; };
  const auto asked = ReadJoinBody(request.body);
  std::optional<std::string> stranger;
  if (askers_ == Askers::kStrangers) stranger = request.address;
  absl::StatusOr<v1::JoinInstanceResponse> joined = asked.ok() ? plane_.Join(*asked, over, stranger) : asked.status();
  if (absl::IsCancelled(joined.status()) && !given_up()) {
    joined = absl::UnavailableError("instance: has not started yet; ask again, with a new ticket");
  }
  metrics_.CountSession(joined.status());
  const std::string subject = asked.ok() ? asked->instance_id() : "";
  return {.answer = JoinAnswer(subject, joined), .status = joined.status(), .subject = subject};
}

JoinRequests::Outcome JoinRequests::Leave(const PageRequest& request) {
  const auto asked = ReadLeaveBody(request.body);
  absl::Status status = asked.ok() ? plane_.CheckRecovered() : asked.status();
  if (status.ok()) status = plane_.CallOfPlayer([&](Cluster& cluster, Now now) { return cluster.Leave(now, *asked); });
  return {.answer = LeaveAnswer(status), .status = status, .subject = asked.ok() ? asked->instance_id() : ""};
}

JoinRequests::Outcome JoinRequests::List(const PageRequest& request) {
  const absl::Status status = CheckListBody(request.body);
  if (!status.ok()) return {.answer = ErrorAnswer(status), .status = status, .subject = ""};
  return {
      .answer = ListAnswer(plane_.CallOfPlayer([](Cluster& cluster, Now) { return ListedInstances(cluster.state()); })),
      .status = status,
      .subject = ""};
}

void JoinRequests::Log(const PageRequest& request, const Outcome& outcome, std::chrono::nanoseconds took) {
  const absl::Status& status = outcome.status;
  const bool local = askers_ == Askers::kLocal;
  if (request.path == kListPath && status.ok()) return;  // menus ask every few seconds
  std::uint64_t left_out = 0;
  if (!status.ok() || !local) {
    const auto passes = (status.ok() ? answered_ : refusals_).Take(telemetry::LogThrottle::Clock::now());
    if (!passes) return;
    left_out = *passes;
  }
  spdlog::info(
      "https path={} who={} from={} subject={} result={} ms={:.1f}{}{}", request.path, local ? "local" : "player",
      request.from, telemetry::LogValue(OneLine(outcome.subject, kMaxNameBytes)),
      absl::StatusCodeToString(status.code()), std::chrono::duration<double, std::milli>(took).count(),
      status.ok() ? "" : " error=" + telemetry::LogValue(OneLine(std::string(status.message()), kMaxReasonBytes)),
      left_out == 0 ? "" : absl::StrCat(" more=", left_out));
}

}  // namespace tessera::control
