#include "control_plane/report_limits.h"

#include <cmath>
#include <cstddef>
#include <string>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "core/game/native_name.h"
#include "core/world/limits.h"
#include "core/world/properties.h"
#include "net/signing_key.h"
#include "trust/revocation_list.h"

namespace tessera::control {
namespace {

// Limits of texts, and of lists that no constant of the world bounds; the .proto says how many a worker sends.
constexpr std::size_t kMaxTextBytes = 16 * 1024;
constexpr int kMaxCensuses = 64, kMaxNonfinite = 100, kMaxSpread = 256, kMaxRuns = 10'000, kMaxLines = 32,
              kMaxReportedEvents = 512, kMaxLogLines = 64;

class Checks {
 public:
  explicit Checks(const char* message) : message_(message) {}
  const absl::Status& status() const { return status_; }
  void Entries(const char* field, std::size_t has, std::size_t most) {
    if (has > most) Refuse(absl::StrCat(message_, ".", field, ": has ", has, " entries, at most ", most));
  }
  void Text(const char* field, const std::string& text) {
    if (text.size() > kMaxTextBytes) {
      Refuse(absl::StrCat(message_, ".", field, ": has ", text.size(), " bytes, at most ", kMaxTextBytes));
    }
  }
  void Name(const char* field, const v1::WorkerIdentity& identity) {
    const std::size_t has = identity.instance_id().size();
    if (has > kMaxNameBytes) {
      Refuse(absl::StrCat(message_, ".", field, ".instance_id: has ", has, " bytes, at most ", kMaxNameBytes));
    }
  }
  void Real(const char* field, double value) {
    if (!std::isfinite(value) || value < 0) Refuse(absl::StrCat(message_, ".", field, ": is no time or rate"));
  }
  void Refuse(const std::string& why) {
    if (status_.ok()) status_ = absl::InvalidArgumentError(why);
  }

 private:
  const char* message_;
  absl::Status status_;
};

std::size_t Size(int entries) { return static_cast<std::size_t>(entries); }

}  // namespace

absl::Status CheckReport(const v1::WorkerReport& report) {
  Checks checks("report");
  checks.Entries("linked_regions", Size(report.linked_regions_size()), kMaxRegions);
  checks.Entries("connected_players", Size(report.connected_players_size()), kMaxPlayers);
  checks.Entries("ended_players", Size(report.ended_players_size()), kMaxPlayers);
  checks.Entries("standby_copies", Size(report.standby_copies_size()), kMaxRegions);
  checks.Entries("censuses", Size(report.censuses_size()), kMaxCensuses);
  checks.Entries("nonfinite_ids", Size(report.nonfinite_ids_size()), kMaxNonfinite);
  checks.Entries("spread_x", Size(report.spread_x_size()), kMaxSpread);
  checks.Entries("spread_z", Size(report.spread_z_size()), kMaxSpread);
  checks.Entries("removed_first", Size(report.removed_first_size()), kMaxRuns);
  checks.Entries("removed_last", Size(report.removed_last_size()), kMaxRuns);
  checks.Entries("property_answers", Size(report.property_answers_size()), kMaxPropertyChanges);
  checks.Entries("backend_answers", Size(report.backend_answers_size()), kMaxGameMessages);
  checks.Entries("world_properties", Size(report.world_properties_size()), kMaxProperties);
  checks.Entries("game_lines", Size(report.game_lines_size()), kMaxLines);
  checks.Entries("game_events", Size(report.game_events_size()), kMaxReportedEvents);
  if (const std::size_t bytes = report.public_key().size(); bytes != 0 && bytes != net::kKeyBytes) {
    checks.Refuse(absl::StrCat("report.public_key: has ", bytes, " bytes, not ", net::kKeyBytes));
  }
  checks.Text("failure", report.failure());
  checks.Text("checkpoint_failure", report.checkpoint_failure());
  checks.Text("next_game.failure", report.next_game().failure());
  for (const v1::GameLine& line : report.game_lines()) checks.Text("game_lines.text", line.text());
  for (const v1::EndedPlayer& player : report.ended_players()) checks.Text("ended_players.reason", player.reason());
  for (const v1::PropertyAnswer& answer : report.property_answers()) {
    checks.Text("property_answers.refused", answer.refused());
  }
  for (const v1::BackendAnswer& answer : report.backend_answers()) {
    checks.Text("backend_answers.refused", answer.refused());
  }
  for (const v1::Property& property : report.world_properties()) {
    checks.Text("world_properties.name", property.name());
    checks.Text("world_properties.text", property.text());
    checks.Text("world_properties.bytes", property.bytes());
  }
  checks.Real("tick_rate_hz", report.tick_rate_hz());
  checks.Real("step", report.step().p50_seconds());
  checks.Real("step", report.step().p99_seconds());
  checks.Real("step", report.step().max_seconds());
  return checks.status();
}

absl::Status CheckNamedWorkers(const char* message,
                               const google::protobuf::RepeatedPtrField<v1::WorkerReport>& workers) {
  Checks checks(message);
  checks.Entries("workers", Size(workers.size()), kMaxNamedWorkers);
  if (!checks.status().ok()) return checks.status();
  for (const v1::WorkerReport& report : workers) checks.Name("workers.identity", report.identity());
  return checks.status();
}

absl::Status CheckModules(const char* message, const v1::GameModuleList& list) {
  Checks checks(message);
  checks.Entries("game_modules", Size(list.modules_size()), game::kMaxGameModules);
  if (!checks.status().ok()) return checks.status();
  std::string last;
  for (const v1::GameModule& module : list.modules()) {
    if (const absl::Status name = game::CheckModuleName(module.name()); !name.ok()) {
      checks.Refuse(absl::StrCat(message, ".game_modules.name: ", name.message()));
    }
    if (module.name() <= last) checks.Refuse(absl::StrCat(message, ".game_modules: are not ascending by name"));
    last = module.name();
    if (module.failure().empty() ? !game::IsModuleHash(module.hash()) : module.hash().size() > kMaxNameBytes + 1) {
      checks.Refuse(absl::StrCat(message, ".game_modules.hash: must be 64 hexadecimal digits"));
    }
    if (module.failure().size() > kMaxReasonBytes) {
      checks.Refuse(absl::StrCat(message, ".game_modules.failure: has ", module.failure().size(), " bytes, at most ",
                                 kMaxReasonBytes));
    }
  }
  return checks.status();
}

absl::Status CheckMessage(const v1::AgentMessage& message) {
  switch (message.kind_case()) {
    case v1::AgentMessage::kHello:
      return CheckNamedWorkers("hello", message.hello().workers());
    case v1::AgentMessage::kHeartbeat:
      return CheckNamedWorkers("heartbeat", message.heartbeat().workers());
    case v1::AgentMessage::kReport: {
      Checks checks("report");
      checks.Name("identity", message.report().identity());
      return checks.status();
    }
    case v1::AgentMessage::kExited: {
      const v1::WorkerExited& exited = message.exited();
      Checks checks("exited");
      checks.Name("identity", exited.identity());
      checks.Text("reason", exited.reason());
      checks.Text("died_in_game", exited.died_in_game());
      checks.Entries("last_log_lines", Size(exited.last_log_lines_size()), kMaxLogLines);
      for (const std::string& line : exited.last_log_lines()) checks.Text("last_log_lines", line);
      return checks.status();
    }
    case v1::AgentMessage::kInventory: {
      Checks checks("inventory");
      checks.Name("identity", message.inventory().identity());
      return checks.status();
    }
    case v1::AgentMessage::kHeldOrders: {
      Checks checks("held_orders");
      checks.Entries("orders", Size(message.held_orders().orders_size()), kMaxNamedWorkers);
      return checks.status();
    }
    case v1::AgentMessage::kLease: {
      Checks checks("lease");
      checks.Name("identity", message.lease().identity());
      return checks.status();
    }
    case v1::AgentMessage::kRevocations: {
      const std::size_t has = message.revocations().ByteSizeLong(), most = trust::kMaxRevocationBytes + 128;
      if (has <= most) break;
      return absl::InvalidArgumentError(absl::StrCat("revocations: has ", has, " bytes, at most ", most));
    }
    case v1::AgentMessage::kKeptRevocations:
      break;
    case v1::AgentMessage::kGameModules:
      return CheckModules("message", message.game_modules());
    case v1::AgentMessage::KIND_NOT_SET:
      break;
  }
  return absl::OkStatus();
}

}  // namespace tessera::control
