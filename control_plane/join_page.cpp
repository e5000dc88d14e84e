#include "control_plane/join_page.h"

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/one_line.h"
#include "control_plane/retry_after.h"
#include "core/world/partition_io.h"
#include "core/world/utf8.h"
#include "trust/ticket.h"

namespace tessera::control {
namespace {

using Json = nlohmann::json;

// Most grants are far smaller; one of a large map does not come back this way, and its player shows a new ticket.
constexpr std::size_t kMaxGrantText = kMaxJoinBodyBytes;
constexpr std::size_t kMaxReturningText = (net::kMaxCredentialBytes + net::kKeyBytes + 2) / 3 * 4;

constexpr int kTooManyRequests = 429, kUnavailable = 503, kRetryUnavailable_s = 5;

int StatusOf(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:
      return 200;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return 400;
    case absl::StatusCode::kUnauthenticated:
      return 401;
    case absl::StatusCode::kPermissionDenied:
      return 403;
    case absl::StatusCode::kNotFound:
      return 404;
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kAborted:
      return 409;
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kCancelled:
      return kUnavailable;
    case absl::StatusCode::kDeadlineExceeded:
      return 504;
    default:
      return 500;
  }
}

// "ticket" in "ticket: ran out"; empty: the message names none.
std::string FieldOf(absl::string_view message) {
  const std::size_t end = message.find(": ");
  if (end == absl::string_view::npos || end == 0) return "";
  const absl::string_view field = message.substr(0, end);
  const bool plain = std::all_of(field.begin(), field.end(),
                                 [](unsigned char c) { return absl::ascii_islower(c) || c == '_' || c == '.'; });
  if (!plain) return "";
  return field == "instance_id" ? "instance" : field == "player_name" ? "name" : std::string(field);
}

absl::StatusOr<Json> ReadObject(std::string_view body, const std::set<std::string>& known) {
  if (body.size() > kMaxJoinBodyBytes) {
    return absl::InvalidArgumentError(absl::StrCat("body: more than ", kMaxJoinBodyBytes, " bytes"));
  }
  Json json = Json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object()) return absl::InvalidArgumentError("body: is not a JSON object");
  for (const auto& [field, value] : json.items()) {
    if (!known.contains(field)) {
      return absl::InvalidArgumentError(
          absl::StrCat(OneLine(field, kMaxNameBytes), ": is not a field of this request"));
    }
  }
  return json;
}

absl::StatusOr<std::string> TextIn(const Json& json, const char* field, std::size_t most) {
  const auto found = json.find(field);
  if (found == json.end()) return std::string();
  if (!found->is_string()) return absl::InvalidArgumentError(absl::StrCat(field, ": is not a text"));
  const auto& text = found->get_ref<const std::string&>();
  if (text.size() > most) {
    return absl::InvalidArgumentError(absl::StrCat(field, ": ", text.size(), " bytes are more than ", most));
  }
  return text;
}

absl::StatusOr<net::JoinGrant> ReadGrant(const std::string& text) {
  std::string bytes;
  if (!absl::Base64Unescape(text, &bytes)) return absl::InvalidArgumentError("grant: is not base64");
  return net::DecodeJoinGrant({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

// The instance that a request without one is for.
std::string ImpliedInstance(const v1::JoinInstanceRequest& request) {
  const auto shown = trust::ParseTicket(request.ticket());
  return shown.ok() ? shown->ticket.instance : "";
}

// Takes a return token apart: the credential, then the seed of its key.
template <class Request>
absl::Status SetReturning(const std::string& text, Request& request) {
  std::string bytes;
  if (!absl::Base64Unescape(text, &bytes)) return absl::InvalidArgumentError("returning: is not base64");
  if (bytes.size() <= net::kKeyBytes || bytes.size() > net::kMaxCredentialBytes + net::kKeyBytes) {
    return absl::InvalidArgumentError(absl::StrCat("returning: ", bytes.size(), " bytes are no return token"));
  }
  request.set_credential(bytes.substr(0, bytes.size() - net::kKeyBytes));
  request.set_credential_key(bytes.substr(bytes.size() - net::kKeyBytes));
  return absl::OkStatus();
}

template <class Request>
void SetCredential(const net::Credentials& credentials, Request& request) {
  const net::Seed seed = credentials.key.seed();
  request.set_credential(std::string(credentials.statement.begin(), credentials.statement.end()));
  request.set_credential_key(seed.data(), seed.size());
}

}  // namespace

absl::StatusOr<v1::JoinInstanceRequest> ReadJoinBody(std::string_view body) {
  const auto json = ReadObject(body, {"grant", "instance", "name", "returning", "ticket", "viewer"});
  if (!json.ok()) return json.status();
  const auto ticket = TextIn(*json, "ticket", trust::kMaxTicketText);
  const auto instance = TextIn(*json, "instance", trust::kMaxTicketInstance);
  const auto name = TextIn(*json, "name", kMaxNameBytes);
  const auto grant = TextIn(*json, "grant", kMaxGrantText);
  const auto returning = TextIn(*json, "returning", kMaxReturningText);
  for (const auto* field : {&ticket, &instance, &name, &grant, &returning}) {
    if (!field->ok()) return field->status();
  }
  v1::JoinInstanceRequest request;
  request.set_ticket(*ticket);
  request.set_instance_id(*instance);
  request.set_player_name(*name);
  if (const auto viewer = json->find("viewer"); viewer != json->end()) {
    if (!viewer->is_boolean()) return absl::InvalidArgumentError("viewer: is neither true nor false");
    request.set_viewer(viewer->get<bool>());
  }
  if (!grant->empty()) {
    const auto had = ReadGrant(*grant);
    if (!had.ok()) return had.status();
    SetCredential(had->credentials, request);
    if (request.instance_id().empty()) request.set_instance_id(had->credentials.instance_id);
  }
  if (!returning->empty()) {
    if (!grant->empty()) return absl::InvalidArgumentError("returning: the grant says who comes back; leave it out");
    if (absl::Status status = SetReturning(*returning, request); !status.ok()) return status;
  }
  if (request.instance_id().empty()) request.set_instance_id(ImpliedInstance(request));
  if (request.instance_id().empty()) return absl::InvalidArgumentError("instance: missing");
  return request;
}

absl::StatusOr<v1::LeaveInstanceRequest> ReadLeaveBody(std::string_view body) {
  const auto json = ReadObject(body, {"grant", "instance", "returning"});
  if (!json.ok()) return json.status();
  const auto text = TextIn(*json, "grant", kMaxGrantText);
  const auto instance = TextIn(*json, "instance", trust::kMaxTicketInstance);
  const auto returning = TextIn(*json, "returning", kMaxReturningText);
  for (const auto* field : {&text, &instance, &returning}) {
    if (!field->ok()) return field->status();
  }
  v1::LeaveInstanceRequest request;
  if (text->empty() && !returning->empty()) {
    if (instance->empty()) return absl::InvalidArgumentError("instance: missing");
    request.set_instance_id(*instance);
    if (absl::Status status = SetReturning(*returning, request); !status.ok()) return status;
    return request;
  }
  if (!returning->empty()) return absl::InvalidArgumentError("returning: the grant says who leaves; leave it out");
  const auto grant = ReadGrant(*text);
  if (!grant.ok()) return grant.status();
  if (!instance->empty() && *instance != grant->credentials.instance_id) {
    return absl::InvalidArgumentError("instance: is not that of the grant");
  }
  request.set_instance_id(grant->credentials.instance_id);
  SetCredential(grant->credentials, request);
  return request;
}

absl::Status CheckListBody(std::string_view body) { return ReadObject(body, {}).status(); }

absl::StatusOr<net::JoinGrant> GrantOf(const std::string& instance_id, const v1::JoinInstanceResponse& response) {
  const auto fault = [](const absl::Status& status) {
    return absl::InternalError(absl::StrCat("the answer cannot be given out: ", status.message()));
  };
  auto key = net::SigningKey::FromSeed(response.credential_key(), "credential_key");
  auto instance_key = net::VerificationKeyFrom(response.instance_key(), "instance_key");
  auto map = FromProto(response.map());
  for (const absl::Status& status : {key.status(), instance_key.status(), map.status()}) {
    if (!status.ok()) return fault(status);
  }
  net::JoinGrant grant{
      .player = PlayerNumber(response.player()),
      .credentials = {.instance_id = instance_id,
                      .statement = {response.credential().begin(), response.credential().end()},
                      .key = *key,
                      .instance_key = *instance_key},
      .map = *std::move(map),
      .regions = {},
      .scene_hash = response.scene_hash(),
      .tick_rate_hz = response.tick_rate_hz(),
      .snapshot_rate_hz = response.snapshot_rate_hz(),
      .expected_players = response.expected_players(),
  };
  for (const v1::RegionAddress& region : response.regions()) {
    grant.regions.push_back({RegionId(region.region()), region.host(), static_cast<std::uint16_t>(region.game_port()),
                             Incarnation(region.incarnation())});
  }
  std::sort(grant.regions.begin(), grant.regions.end(),
            [](const auto& a, const auto& b) { return a.region < b.region; });
  if (absl::Status status = net::CheckJoinGrant(grant); !status.ok()) return fault(status);
  return grant;
}

PageAnswer JoinAnswer(const std::string& instance_id, const absl::StatusOr<v1::JoinInstanceResponse>& response) {
  if (!response.ok()) return ErrorAnswer(response.status());
  const auto grant = GrantOf(instance_id, *response);
  if (!grant.ok()) return ErrorAnswer(grant.status());
  const std::vector<std::uint8_t> bytes = net::EncodeJoinGrant(*grant);
  const std::string text =
      absl::Base64Escape(absl::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  return {.status = 200,
          .body = Json{{"grant", text}, {"instance", instance_id}, {"player", response->player()}}.dump()};
}

PageAnswer LeaveAnswer(const absl::Status& status) {
  return status.ok() ? PageAnswer{.status = 200, .body = "{}"} : ErrorAnswer(status);
}

PageAnswer ListAnswer(const std::vector<v1::Instance>& instances) {
  Json list = Json::array();
  for (const v1::Instance& instance : instances) {
    Json names = Json::array();
    for (const v1::Player& player : instance.player_list()) {
      if (player.left()) continue;
      names.push_back(player.name().empty() ? absl::StrCat("player ", player.number()) : ValidUtf8(player.name()));
    }
    list.push_back({{"id", instance.id()},
                    {"scene", ValidUtf8(instance.scene_name())},
                    {"game", ValidUtf8(instance.game_name())},
                    {"state", static_cast<int>(instance.state())},
                    {"regions", instance.regions()},
                    {"players", instance.players()},
                    {"expected_players", instance.expected_players()},
                    {"names", std::move(names)}});
  }
  return {.status = 200, .body = Json{{"instances", std::move(list)}}.dump()};
}

PageAnswer ErrorAnswer(const absl::Status& status) {
  Json json{{"code", absl::StatusCodeToString(status.code())}, {"error", ValidUtf8(std::string(status.message()))}};
  if (const std::string field = FieldOf(status.message()); !field.empty()) json["field"] = field;
  PageAnswer answer{.status = StatusOf(status.code()), .body = {}};
  if (const auto wait = RetryAfterOf(status)) {
    answer.status = kTooManyRequests;
    answer.retry_after_s = static_cast<int>(std::chrono::ceil<std::chrono::seconds>(*wait).count());
    json["retry_after_s"] = answer.retry_after_s;
  } else if (answer.status == kUnavailable) {
    answer.retry_after_s = kRetryUnavailable_s;
  }
  answer.body = json.dump();
  return answer;
}

}  // namespace tessera::control
