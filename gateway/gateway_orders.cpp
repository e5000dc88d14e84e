// The part of the gateway that takes rights and carries out orders.
#include <utility>

#include "absl/strings/str_cat.h"
#include "gateway/gateway.h"
#include "gateway/orders.h"
#include "gateway/visitor_right.h"
#include "spdlog/spdlog.h"
#include "telemetry/log_value.h"

namespace tessera::gateway {
namespace {

// Whether another right could help.
bool IsRefusal(const absl::Status& status) {
  return absl::IsPermissionDenied(status) || absl::IsUnauthenticated(status);
}

constexpr char kDone[] = "orders are taken";

}  // namespace

std::string Gateway::Needs() const {
  if (!IsSocket(options_.control.address)) return options_.takes_tokens ? "token" : "";
  return options_.key.empty() ? "" : "key";
}

absl::Status Gateway::WithoutRight() const {
  const std::string needs = Needs();
  if (needs == "token") {
    return absl::PermissionDeniedError(
        "not_allowed: an order needs an operator's access token of your own (tessera token create NAME --role "
        "operator)");
  }
  if (needs == "key") {
    return absl::PermissionDeniedError(
        "not_allowed: an order needs the key of this gateway: open the page by the whole address that `tessera up` or "
        "the demo printed last");
  }
  if (!options_.takes_tokens) {
    return absl::PermissionDeniedError(
        "not_allowed: this gateway takes no orders: an access token would come to it in the clear; it needs "
        "--certificate and --key, or --behind-proxy where a proxy in front of it speaks HTTPS");
  }
  return absl::PermissionDeniedError(
      "not_allowed: this gateway takes no orders: its control plane is a socket, and it was started without "
      "--key-file");
}

// --- Rights ----------------------------------------------------------------------------------------------------------

void Gateway::TakeRight(ViewerId id, Viewer& viewer, const Authorize& shown, TimePoint now) {
  if (viewer.world == nullptr) {
    return viewer.session.Answer(shown.number, absl::FailedPreconditionError("a recording takes no orders"), "");
  }
  if (IsSocket(options_.control.address)) {
    if (!IsKey(options_.key, shown.key)) {
      metrics_.orders_refused.Increment();
      return viewer.session.AnswerWrongRight(shown.number, WithoutRight(), Needs(), now);
    }
    viewer.right = services_.channel;
    return viewer.session.Answer(shown.number, absl::OkStatus(), kDone);
  }
  if (shown.token.empty() || !options_.takes_tokens) {
    return viewer.session.AnswerWrongRight(shown.number, WithoutRight(), Needs(), now);
  }
  if (viewer.authorizing) {
    return viewer.session.Answer(shown.number, absl::ResourceExhaustedError("another token is being checked"), "");
  }
  const bool queued = background_.Run([this, id, shown, control = options_.control, instance = viewer.instance] {
    auto right = std::make_shared<absl::StatusOr<std::shared_ptr<grpc::Channel>>>(DialAs(control, shown.token));
    if (right->ok()) {
      if (absl::Status may = CheckMayOrder(**right, instance); !may.ok()) *right = std::move(may);
    }
    return [this, id, shown, right] { TookRight(id, shown, *right); };
  });
  viewer.authorizing = queued;
  if (!queued) viewer.session.Answer(shown.number, absl::ResourceExhaustedError("too many tokens are checked"), "");
}

void Gateway::TookRight(ViewerId id, const Authorize& shown,
                        const absl::StatusOr<std::shared_ptr<grpc::Channel>>& right) {
  const auto found = viewers_.find(id);
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  viewer.authorizing = false;
  if (right.ok()) {
    viewer.right = *right;
    viewer.token = shown.token;
    return viewer.session.Answer(shown.number, absl::OkStatus(), kDone);
  }
  const bool wrong = IsRefusal(right.status()) || absl::IsInvalidArgument(right.status());
  if (!wrong) return viewer.session.Answer(shown.number, right.status(), "");
  metrics_.orders_refused.Increment();
  viewer.session.AnswerWrongRight(shown.number, right.status(), Needs(), std::chrono::steady_clock::now());
}

// --- Orders ----------------------------------------------------------------------------------------------------------

OrderContext Gateway::ContextOf(const Viewer& viewer, const Order& order) const {
  OrderContext context{.instance = viewer.instance, .workers_are_here = options_.workers_are_here};
  if (const ViewSource* source = viewer.world->source(); source != nullptr) {
    for (const PropertyDef& property : const_cast<ViewSource*>(source)->client().scene().properties) {
      if (property.name == order.property) context.declared = property.initial;
    }
  }
  if (const v1::Instance* state = viewer.world->state()) {
    for (const v1::RegionStatus& status : state->region_status()) {
      if (status.region() == order.region) context.worker_pid = status.report().identity().pid();
    }
  }
  return context;
}

void Gateway::GiveOrder(ViewerId id, Viewer& viewer, const Order& order) {
  if (viewer.world == nullptr) {
    return viewer.session.Answer(order.number, absl::FailedPreconditionError("a recording takes no orders"), "");
  }
  if (viewer.right == nullptr) {
    metrics_.orders_refused.Increment();
    return viewer.session.Answer(order.number, WithoutRight(), "", Needs());
  }
  // The control plane judges its own orders. For those that the gateway carries out itself it is asked first.
  const bool own = order.kind == OrderKind::kRecord || order.kind == OrderKind::kEndWorker;
  const bool ask = own && !viewer.token.empty();
  const bool queued = background_.Run(
      [this, id, order, ask, context = ContextOf(viewer, order), right = viewer.right]() -> Background::Done {
        absl::StatusOr<std::string> done = "";
        if (absl::Status may = ask ? CheckMayOrder(right, context.instance) : absl::OkStatus(); !may.ok()) {
          done = std::move(may);
        } else if (order.kind != OrderKind::kRecord) {
          done = CarryOut(order, context, right);
        }
        return [this, id, order, done] { OrderDone(id, order, done); };
      });
  if (!queued) {
    viewer.session.Answer(order.number,
                          absl::ResourceExhaustedError(std::string(NameOf(order.kind)) + ": too many orders wait"), "");
  }
}

void Gateway::OrderDone(ViewerId id, const Order& order, const absl::StatusOr<std::string>& carried_out) {
  const auto found = viewers_.find(id);
  // A viewer that has gone takes an order along that only the gateway could carry out.
  if (found == viewers_.end() && order.kind == OrderKind::kRecord) return;
  absl::StatusOr<std::string> done = carried_out;
  const std::string instance = found == viewers_.end() ? "" : found->second.instance;
  if (done.ok() && order.kind == OrderKind::kRecord) {
    if (const auto recorded = SetRecording(instance, order.on); !recorded.ok()) {
      done = recorded.status();
    } else {
      done = std::string(order.on ? "is recorded" : "is no longer recorded");
    }
  }
  spdlog::info("order instance={} order={} result={}", telemetry::LogValue(instance), NameOf(order.kind),
               telemetry::LogValue(done.ok() ? *done : std::string(done.status().message())));
  (done.ok() ? metrics_.orders_done : metrics_.orders_failed).Increment();
  if (found == viewers_.end()) return;
  Viewer& viewer = found->second;
  const bool another = !viewer.token.empty() && IsRefusal(done.status());
  if (another && absl::IsUnauthenticated(done.status())) {
    viewer.right = nullptr;
    viewer.token.clear();
  }
  viewer.session.Answer(order.number, done.status(), done.ok() ? *done : "", another ? Needs() : "");
}

// --- Recordings ------------------------------------------------------------------------------------------------------

void Gateway::Record(const std::string& instance, bool on, const std::string& shown, Recorded done) {
  const auto finish = [this, instance, on, done = std::move(done)](const absl::Status& may) {
    if (!may.ok()) metrics_.orders_refused.Increment();
    const auto recorded = may.ok() ? SetRecording(instance, on) : absl::StatusOr<RecordingState>(may);
    spdlog::info("order instance={} order=record on={} result={}", telemetry::LogValue(instance), on,
                 telemetry::LogValue(recorded.ok() ? "done" : std::string(recorded.status().message())));
    if (may.ok()) (recorded.ok() ? metrics_.orders_done : metrics_.orders_failed).Increment();
    done(recorded);
  };
  if (IsSocket(options_.control.address)) {
    return finish(IsKey(options_.key, shown) ? absl::OkStatus() : WithoutRight());
  }
  if (shown.empty() || !options_.takes_tokens) return finish(WithoutRight());
  const bool queued = background_.Run([control = options_.control, instance, shown, finish]() -> Background::Done {
    const auto right = DialAs(control, shown);
    const absl::Status may = right.ok() ? CheckMayOrder(*right, instance) : right.status();
    return [finish, may] { finish(may); };
  });
  if (!queued) finish(absl::ResourceExhaustedError("too many orders wait"));
}

absl::StatusOr<RecordingState> Gateway::SetRecording(const std::string& instance, bool on) {
  const auto found = worlds_.find(instance);
  if (found == worlds_.end()) {
    if (!on) return RecordingState{};
    // Whether there is such an instance its join will say.
    if (worlds_.size() >= options_.max_viewers) {
      return absl::ResourceExhaustedError(
          absl::StrCat("this gateway has ", worlds_.size(), " worlds; see --max-viewers"));
    }
  } else if (const auto& problem = found->second.world->problem(); problem && on) {
    const auto code = problem->code == "no_world" ? absl::StatusCode::kNotFound : absl::StatusCode::kUnavailable;
    return absl::Status(code, problem->text);
  }
  World& world = WorldOf(instance);
  if (world.viewers == 0) world.unwatched_since = std::chrono::steady_clock::now();
  if (on == world.world->recording()) return world.world->recording_state();
  const absl::Status status = world.world->SetRecording(on);
  if (!status.ok()) return status;
  return world.world->recording_state();
}

}  // namespace tessera::gateway
