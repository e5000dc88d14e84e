// The players' HTTPS door in JSON, without a socket: what a body asks for, and what is answered.
//
//   POST /v1/join       {"ticket": "...", "instance": "inst-7"}  200 {"grant": "BASE64", "instance": "inst-7",
//                                                                     "player": 3}
//   POST /v1/leave      {"grant": "BASE64"}                      200 {}
//   POST /v1/instances  {}                                       200 {"instances": [{"id": "inst-7", ...}]}
//   errors: {"code": "UNAUTHENTICATED", "error": "ticket: ran out 31 s ago", "field": "ticket"}
//
// A body of /v1/join has `ticket`, or as a guest `name`, or `grant` or `returning`, a grant or a return token that the
// player had: it comes back. `instance` may be left out where the ticket or grant names one; `viewer` is true for who
// only watches. /v1/leave takes `instance` and `returning` as well.
//
// Thread rule: free functions on values.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "net/join_grant.h"
#include "tessera/v1/instance.pb.h"
#include "tessera/v1/session.pb.h"

namespace tessera::control {

// A body that is longer is not read: the longest ticket and a large grant fit.
inline constexpr std::size_t kMaxJoinBodyBytes = 64 * 1024;

struct PageAnswer {
  int status = 200;
  std::string body;       // JSON
  int retry_after_s = 0;  // for the header; 0: there is none
};

// INVALID_ARGUMENT names the field; one that is not known is refused.
absl::StatusOr<v1::JoinInstanceRequest> ReadJoinBody(std::string_view body);
absl::StatusOr<v1::LeaveInstanceRequest> ReadLeaveBody(std::string_view body);
absl::Status CheckListBody(std::string_view body);  // an empty object

// INTERNAL: the answer is none that a client could use.
absl::StatusOr<net::JoinGrant> GrantOf(const std::string& instance_id, const v1::JoinInstanceResponse& response);
PageAnswer JoinAnswer(const std::string& instance_id, const absl::StatusOr<v1::JoinInstanceResponse>& response);
PageAnswer LeaveAnswer(const absl::Status& status);
// As a menu shows them: names of those who are in where they are known, and no accounts.
PageAnswer ListAnswer(const std::vector<v1::Instance>& instances);
PageAnswer ErrorAnswer(const absl::Status& status);

}  // namespace tessera::control
