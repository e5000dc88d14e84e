#include "client_sdk/connect/door_session.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client_sdk/connect/door_call.h"
#include "core/world/viewer_number.h"

namespace tessera::client {
namespace {

using DoorJson = nlohmann::json;
using AskClock = std::chrono::steady_clock;

constexpr long kHttpOk = 200, kHttpGatewayTimeout = 504;
constexpr std::size_t kMostGrantBytes = std::size_t{1} << 20;  // TESSERA_MAX_GRANT
constexpr std::size_t kKeyBytes = 32;                          // a return token has these behind its credential
constexpr std::size_t kMostErrorBytes = 1024;

absl::Status BadDoorAnswer(absl::string_view what) {
  return absl::InternalError(absl::StrCat("the control plane's answer: ", what));
}

std::string ToBase64(std::span<const std::uint8_t> bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
  text.pop_back();  // the 0 at the end
  return text;
}

// The codes as the door writes them; an older one says no more than a status of HTTP.
absl::StatusCode CodeOf(const std::string& name, long http) {
  using Code = absl::StatusCode;
  static constexpr std::array<std::pair<absl::string_view, Code>, 12> kNames{{
      {"ABORTED", Code::kAborted},
      {"ALREADY_EXISTS", Code::kAlreadyExists},
      {"CANCELLED", Code::kCancelled},
      {"DEADLINE_EXCEEDED", Code::kDeadlineExceeded},
      {"FAILED_PRECONDITION", Code::kFailedPrecondition},
      {"INTERNAL", Code::kInternal},
      {"INVALID_ARGUMENT", Code::kInvalidArgument},
      {"NOT_FOUND", Code::kNotFound},
      {"PERMISSION_DENIED", Code::kPermissionDenied},
      {"RESOURCE_EXHAUSTED", Code::kResourceExhausted},
      {"UNAUTHENTICATED", Code::kUnauthenticated},
      {"UNAVAILABLE", Code::kUnavailable},
  }};
  for (const auto& [known, code] : kNames) {
    if (known == name) return code;
  }
  static constexpr std::array<std::pair<long, Code>, 8> kStatuses{{{400, Code::kInvalidArgument},
                                                                   {401, Code::kUnauthenticated},
                                                                   {403, Code::kPermissionDenied},
                                                                   {404, Code::kNotFound},
                                                                   {409, Code::kFailedPrecondition},
                                                                   {413, Code::kInvalidArgument},
                                                                   {503, Code::kUnavailable},
                                                                   {504, Code::kDeadlineExceeded}}};
  for (const auto& [known, code] : kStatuses) {
    if (known == http) return code;
  }
  return Code::kInternal;
}

std::string TextField(const DoorJson& json, const char* field) {
  const auto found = json.find(field);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

// The object that a door answers with, or what it says is wrong, of `subject`: "instance inst-7".
absl::StatusOr<DoorJson> ReadAnswer(const DoorAddress& address, const std::string& subject,
                                    const absl::StatusOr<DoorAnswer>& answer) {
  if (!answer.ok()) return answer.status();
  DoorJson json = DoorJson::parse(answer->body, nullptr, /*allow_exceptions=*/false);
  if (answer->status == kHttpOk) {
    if (!json.is_object()) return BadDoorAnswer("is not a JSON object");
    return json;
  }
  const std::string error = json.is_object() ? TextField(json, "error").substr(0, kMostErrorBytes) : std::string();
  if (error.empty()) {  // not the door, but what stands before it, or something else altogether
    const absl::StatusCode code =
        answer->status == kHttpGatewayTimeout ? absl::StatusCode::kDeadlineExceeded : absl::StatusCode::kUnavailable;
    return absl::Status(code, absl::StrCat(AtDoor(address), "answers with HTTP status ", answer->status));
  }
  const absl::StatusCode code = CodeOf(TextField(json, "code"), answer->status);
  if (code == absl::StatusCode::kNotFound && TextField(json, "field") == "instance") {
    return absl::NotFoundError(absl::StrCat(subject, ": no such instance"));
  }
  return absl::Status(code, absl::StrCat(subject, ": ", error));
}

// A list's error names each address without its fingerprint, once.
std::string ShortName(const DoorAddress& door) { return door.text.substr(0, door.text.find('#')); }

std::string ReasonOf(const DoorAddress& door, const absl::Status& status) {
  const std::string message(status.message()), at = AtDoor(door);
  return absl::StrCat(ShortName(door), ": ",
                      message.compare(0, at.size(), at) == 0 ? message.substr(at.size()) : message);
}

// The answer of the one that leads to a request for `subject`; an empty one is the door itself.
absl::StatusOr<DoorJson> AskLeader(const std::vector<DoorAddress>& doors, const std::string& subject,
                                   const std::string& path, const std::string& body, AskClock::time_point until) {
  std::string names, reasons;
  absl::StatusCode code = absl::StatusCode::kInvalidArgument;
  for (std::size_t i = 0; i < doors.size(); ++i) {
    const DoorAddress& door = doors[i];
    const AskClock::time_point begun = AskClock::now();
    const AskClock::duration share = (until - begun) / static_cast<int>(doors.size() - i);
    const bool last = i + 1 == doors.size();
    DoorReach reach{.reached_by = last ? until : begun + std::min<AskClock::duration>(share, kReachPatience)};
    auto asked = AskDoor(door, path, body, until, &reach);
    const bool answered = asked.ok();
    auto answer = ReadAnswer(door, subject.empty() ? "control plane at " + door.text : subject, asked);
    if (answer.ok() || doors.size() == 1) return answer;
    code = answer.status().code();
    const bool late = code == absl::StatusCode::kDeadlineExceeded && !answered;
    const bool serves = code != absl::StatusCode::kUnavailable && !late;
    if (serves || (reach.sent && !answered)) return answer;
    absl::StrAppend(&names, i == 0 ? "" : ", ", ShortName(door));
    absl::StrAppend(&reasons, i == 0 ? "" : "; ", ReasonOf(door, answer.status()));
  }
  return absl::Status(code, absl::StrCat("no control plane of ", names, " serves: ", reasons));
}

absl::StatusOr<std::vector<std::uint8_t>> GrantIn(const DoorJson& json, bool watch) {
  const auto player = json.find("player");
  if (player == json.end() || !player->is_number_unsigned()) return BadDoorAnswer("player: is no number");
  const auto number = player->get<std::uint64_t>();
  if (number == 0 || number > 0xffffffffU) return BadDoorAnswer(absl::StrCat("player ", number));
  if (IsViewer(PlayerNumber(static_cast<std::uint32_t>(number))) != watch) {
    return BadDoorAnswer(absl::StrCat("player ", number, watch ? ": no viewer" : ": a viewer"));
  }
  const std::string text = TextField(json, "grant");
  if (text.empty()) return BadDoorAnswer("grant: is no text");
  std::vector<std::uint8_t> grant(text.size() / 4 * 3 + 3);
  std::size_t size = 0;
  if (sodium_base642bin(grant.data(), grant.size(), text.data(), text.size(), nullptr, &size, nullptr,
                        sodium_base64_VARIANT_ORIGINAL) != 0) {
    return BadDoorAnswer("grant: is not base64");
  }
  if (size > kMostGrantBytes) return BadDoorAnswer(absl::StrCat("grant: has ", size, " bytes"));
  grant.resize(size);
  return grant;
}

// Takes a count from the list's entry.
absl::Status TakeCount(const DoorJson& json, const char* field, std::uint64_t most, std::uint32_t& count) {
  const auto found = json.find(field);
  if (found == json.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > most) {
    return BadDoorAnswer(absl::StrCat("instances.", field, ": is no number up to ", most));
  }
  count = static_cast<std::uint32_t>(found->get<std::uint64_t>());
  return absl::OkStatus();
}

absl::StatusOr<DoorInstance> InstanceFrom(const DoorJson& json) {
  if (!json.is_object()) return BadDoorAnswer("instances: holds what is no object");
  DoorInstance instance;
  instance.id = TextField(json, "id").substr(0, kMostDoorText);
  if (instance.id.empty()) return BadDoorAnswer("instances.id: is no text");
  instance.scene = TextField(json, "scene").substr(0, kMostDoorText);
  instance.game = TextField(json, "game").substr(0, kMostDoorText);
  std::uint32_t state = 0;
  absl::Status status = TakeCount(json, "state", 0xff, state);
  if (status.ok()) status = TakeCount(json, "regions", 0xffffffffU, instance.regions);
  if (status.ok()) status = TakeCount(json, "players", 0xffffffffU, instance.players);
  if (status.ok()) status = TakeCount(json, "expected_players", 0xffffffffU, instance.expected_players);
  if (!status.ok()) return status;
  instance.state = static_cast<std::uint8_t>(state);
  const auto names = json.find("names");
  if (names == json.end() || !names->is_array()) return BadDoorAnswer("instances.names: is no list");
  for (const DoorJson& name : *names) {
    if (instance.names.size() == kMostDoorNames) break;
    if (!name.is_string()) return BadDoorAnswer("instances.names: holds what is no text");
    instance.names.push_back(name.get_ref<const std::string&>().substr(0, kMostDoorText));
  }
  return instance;
}

}  // namespace

absl::StatusOr<std::vector<std::uint8_t>> JoinByDoor(const std::vector<DoorAddress>& doors, const DoorJoin& join) {
  const auto until = AskClock::now() + join.deadline;
  if (!join.ticket.empty() && !join.player_name.empty()) {
    return absl::InvalidArgumentError("player_name: the ticket says the name; leave it empty");
  }
  if (!join.ticket.empty() && !join.returning.empty()) {
    return absl::InvalidArgumentError("returning: the ticket says who comes back; leave it empty");
  }
  if (!join.returning.empty() && join.returning.size() <= kKeyBytes) {
    return absl::InvalidArgumentError("returning: is no return token");
  }
  DoorJson body{{"instance", join.instance_id}};
  if (!join.player_name.empty()) body["name"] = join.player_name;
  if (!join.ticket.empty()) body["ticket"] = join.ticket;
  if (!join.returning.empty()) body["returning"] = ToBase64(join.returning);
  if (join.watch) body["viewer"] = true;
  // Bytes that are no UTF-8 go out with signs in its place, and the door judges that.
  const std::string text = body.dump(-1, ' ', false, DoorJson::error_handler_t::replace);
  const auto answer = AskLeader(doors, "instance " + join.instance_id, "/v1/join", text, until);
  if (!answer.ok()) return answer.status();
  return GrantIn(*answer, join.watch);
}

absl::Status LeaveByDoor(const std::vector<DoorAddress>& doors, const std::string& instance_id,
                         std::span<const std::uint8_t> token, std::chrono::milliseconds deadline) {
  const auto until = AskClock::now() + deadline;
  const DoorJson body{{"instance", instance_id}, {"returning", ToBase64(token)}};
  const std::string text = body.dump(-1, ' ', false, DoorJson::error_handler_t::replace);
  return AskLeader(doors, "instance " + instance_id, "/v1/leave", text, until).status();
}

absl::StatusOr<std::vector<DoorInstance>> ListByDoor(const std::vector<DoorAddress>& doors,
                                                     std::chrono::milliseconds deadline) {
  const auto answer = AskLeader(doors, "", "/v1/instances", "{}", AskClock::now() + deadline);
  if (!answer.ok()) return answer.status();
  const auto found = answer->find("instances");
  if (found == answer->end() || !found->is_array()) return BadDoorAnswer("instances: is no list");
  std::vector<DoorInstance> listed;
  listed.reserve(std::min(found->size(), kMostDoorInstances));
  for (const DoorJson& one : *found) {
    if (listed.size() == kMostDoorInstances) break;
    auto instance = InstanceFrom(one);
    if (!instance.ok()) return instance.status();
    listed.push_back(*std::move(instance));
  }
  return listed;
}

}  // namespace tessera::client
