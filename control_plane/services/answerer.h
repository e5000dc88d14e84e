// Answerer: what all services of a door do with each call: they judge whose instance it may be about, bound how many of
// a caller are under way, time it, log a line and convert the status.
//
// Thread rule: gRPC's threads, any number at once.
#pragma once

#include <grpcpp/grpcpp.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "control_plane/access.h"
#include "control_plane/authority.h"
#include "control_plane/bounded_reader.h"
#include "control_plane/bounded_service.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/control_settings.h"
#include "control_plane/door_limits.h"
#include "control_plane/doors.h"
#include "control_plane/one_line.h"
#include "telemetry/log_throttle.h"
#include "telemetry/log_value.h"

namespace tessera::control {

inline grpc::Status ToGrpc(const absl::Status& status) {
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message())};
}

enum class CallKind { kRead, kWatch, kCommand };

// The subject of a call: a name or an id for the log, never a secret; and, where it names one, the instance that its
// caller's token must be for.
struct Subject {
  Subject(std::string subject) : text(std::move(subject)) {}  // NOLINT(google-explicit-constructor)
  Subject(const char* subject) : text(subject) {}             // NOLINT(google-explicit-constructor)

  std::string text;
  std::optional<std::string> instance;
};
inline Subject Instance(const std::string& id, const std::string& more = "") {
  Subject subject(id + more);
  subject.instance = id;
  return subject;
}

// Answers calls: it times them, logs a line and converts the status.
class Answerer {
 public:
  Answerer(ControlPlane& plane, ControlMetrics& metrics, Door door, const Authority* authority)
      : plane_(plane), metrics_(metrics), door_(door), authority_(authority) {}

 protected:
  // `call() -> absl::Status`.
  template <class Call>
  grpc::Status Answer(grpc::ServerContext* context, const char* method, CallKind kind, const Subject& subject,
                      Call&& call) {
    const Caller caller = CallerOf(*context);  // before the call, which may revoke its own token
    const auto begun = std::chrono::steady_clock::now();
    absl::Status status = subject.instance ? CheckInstance(caller, *subject.instance) : absl::OkStatus();
    const auto slot = slots_.Take(caller, context->peer(), method);
    if (!slot) status = absl::ResourceExhaustedError("too many calls of this caller are under way; try again");
    const bool changes = kind == CallKind::kCommand && !std::string_view(method).starts_with("AccessService/");
    if (status.ok() && changes) status = plane_.CheckRecovered();
    if (status.ok()) status = call();
    const auto took = std::chrono::steady_clock::now() - begun;
    // How long somebody watched is no time to answer.
    if (kind != CallKind::kWatch) metrics_.ObserveRpc(method, took);
    Log(*context, {method, kind, caller.Name(), subject.text, took}, status);
    return ToGrpc(status);
  }
  // Puts the value of a StatusOr into `out`.
  template <class Result, class Out>
  static absl::Status Take(absl::StatusOr<Result> result, Out* out) {
    if (!result.ok()) return result.status();
    *out = *std::move(result);
    return absl::OkStatus();
  }

  Caller CallerOf(const grpc::ServerContext& context) const { return control::CallerOf(context, door_, plane_); }

  ControlPlane& plane_;
  ControlMetrics& metrics_;
  const Door door_;
  const Authority* authority_;  // null: no door needs one
  // For lines that strangers can cause as often as they like: failed calls of players, and hellos.
  telemetry::LogThrottle strangers_;

  // The messages of a client's stream, each of which has to come in time. `context` outlives it.
  template <class Request>
  BoundedReader<Request> PiecesOf(grpc::ServerContext& context, typename BoundedReader<Request>::Stream& stream,
                                  const char* method) {
    BoundedReader<Request> reader(stream, StreamMessageLimit(method));
    reader.Expect(pieces_, [&context] { context.TryCancel(); });
    return reader;
  }

 private:
  telemetry::LogThrottle players_;  // for those that are answered: who may join may leave, and join again
  CallSlots slots_;
  StreamDeadlines pieces_{kPiecePatience, kMaxPieceStreams};
  struct Answered {
    const char* method;
    CallKind kind;
    std::string who;
    const std::string& subject;
    std::chrono::steady_clock::duration took;
  };
  void Log(const grpc::ServerContext& context, const Answered& call, const absl::Status& status) {
    std::uint64_t left_out = 0;
    if (door_ == Door::kPlayers) {
      auto& throttle = status.ok() ? players_ : strangers_;
      const auto passes = throttle.Take(telemetry::LogThrottle::Clock::now());
      if (!passes) return;
      left_out = *passes;
    }
    const auto level = call.kind == CallKind::kCommand ? spdlog::level::info : spdlog::level::debug;
    spdlog::log(
        level, "rpc method={} who={} from={} subject={} result={} ms={:.1f}{}{}", call.method, call.who, context.peer(),
        telemetry::LogValue(OneLine(call.subject, kMaxNameBytes)), absl::StatusCodeToString(status.code()),
        std::chrono::duration<double, std::milli>(call.took).count(),
        status.ok() ? "" : " error=" + telemetry::LogValue(OneLine(std::string(status.message()), kMaxReasonBytes)),
        left_out == 0 ? "" : absl::StrCat(" more=", left_out));
  }
};

template <class Response>
absl::Status SendPieces(const std::string& bytes, grpc::ServerWriter<Response>& writer) {
  for (std::size_t at = 0; at < bytes.size(); at += kPieceBytes) {
    Response piece;
    piece.set_data(bytes.substr(at, kPieceBytes));
    if (!writer.Write(piece)) return absl::CancelledError("the caller has gone");
  }
  return absl::OkStatus();
}

// The same of a scene.
template <class Response>
absl::Status SendScene(const std::string& bytes, grpc::ServerWriter<Response>& writer) {
  for (std::size_t at = 0; at < bytes.size(); at += kPieceBytes) {
    Response piece;
    piece.set_scene(bytes.substr(at, kPieceBytes));
    if (!writer.Write(piece)) return absl::CancelledError("the caller has gone");
  }
  return absl::OkStatus();
}

// Reads `first`, without its piece, and all pieces into a draft. `check(first)` gives the most bytes that they may
// have, or why nothing more is read.
template <class Request, class Check>
absl::StatusOr<DraftFile> ReadPieces(BoundedReader<Request>& reader, ControlPlane& plane, Request& first,
                                     Check&& check) {
  if (!reader.Read(&first)) {
    return reader.status().ok() ? absl::InvalidArgumentError("data: nothing came") : reader.status();
  }
  const absl::StatusOr<std::uint64_t> most = check(first);
  if (!most.ok()) return most.status();
  auto draft = plane.NewDraft();
  if (!draft.ok()) return draft.status();
  Request piece = first;
  first.clear_data();
  do {
    if (piece.data().size() > *most - draft->size()) {
      return absl::InvalidArgumentError(absl::StrCat("data: more than ", *most, " bytes"));
    }
    if (absl::Status status = plane.AppendTo(*draft, piece.data()); !status.ok()) return status;
  } while (reader.Read(&piece));
  if (!reader.status().ok()) return reader.status();
  return draft;
}

}  // namespace tessera::control
