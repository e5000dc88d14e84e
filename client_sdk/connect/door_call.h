// DoorCall: one request to a control plane's players' door in JSON, by libcurl.
//
//   const auto answer = AskDoor(address, "/v1/join", R"({"instance":"inst-7"})", until);
//   if (answer.ok() && answer->status == 200) Read(answer->body);
//
// Over TCP it is TLS 1.2 or newer, and whoever answers must be of the authority that the address names, whatever this
// system trusts. No proxy, no redirection, no other protocol than HTTP/1.1.
//
// Thread rule: any thread; the call waits for the answer, and no longer than until `until`.
#pragma once

#include <chrono>
#include <string>

#include "absl/status/statusor.h"
#include "client_sdk/connect/door_address.h"

namespace tessera::client {

// A longer answer is none: the longest grant in base64, and a full list, fit.
inline constexpr std::size_t kMaxDoorAnswerBytes = std::size_t{2} << 20;

struct DoorAnswer {
  long status = 0;   // HTTP's
  std::string body;  // whatever came, at most kMaxDoorAnswerBytes
};

// A call to one door of several: it must be reached by `reached_by`, else the call ends with UNAVAILABLE while there is
// time for the next. `sent` is set to whether the request may have come there: then it is not for another one.
struct DoorReach {
  std::chrono::steady_clock::time_point reached_by;
  bool sent = false;
};

// Errors begin with AtDoor(address): UNAVAILABLE: nobody answers there, or not by HTTP; UNAUTHENTICATED: it is not of
// the authority that was named; DEADLINE_EXCEEDED; INTERNAL: the answer is too long. `reach`: null for the only door.
absl::StatusOr<DoorAnswer> AskDoor(const DoorAddress& address, const std::string& path, const std::string& body,
                                   std::chrono::steady_clock::time_point until, DoorReach* reach = nullptr);

// "control plane at ADDRESS: ".
std::string AtDoor(const DoorAddress& address);

}  // namespace tessera::client
