#include "control_plane/etcd/etcd_trouble.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace tessera::control {

std::optional<EtcdTrouble::Line> EtcdTrouble::Note(const absl::Status& status, Clock::time_point now) {
  if (status.ok() || absl::IsAborted(status)) {
    since_.reset();
    if (std::exchange(said_, false)) return Line{spdlog::level::info, "etcd answers again"};
    if (status.ok()) reason_.clear();
  }
  if (status.ok()) return std::nullopt;
  if (!absl::IsAborted(status) && !since_) since_ = now;
  if (since_ && now - *since_ >= patience_ && !said_) {
    said_ = true;
    reason_ = std::string(status.message());
    return Line{spdlog::level::err, absl::StrCat("etcd cannot be used, and this control plane cannot lead: ",
                                                 EtcdRemedy(status), " error=\"", reason_, "\"")};
  }
  if (said_ || std::exchange(reason_, std::string(status.message())) == status.message()) return std::nullopt;
  return Line{spdlog::level::warn, absl::StrCat("election not won error=\"", reason_, "\"")};
}

std::string EtcdRemedy(const absl::Status& status) {
  const std::string why = absl::AsciiStrToLower(status.message());
  const auto says = [&why](const char* text) { return absl::StrContains(why, text); };
  if (absl::IsUnauthenticated(status) || absl::IsPermissionDenied(status)) {
    return "let this program's certificate read and write the prefix of --store there";
  }
  if (absl::IsResourceExhausted(status)) return "give it room";
  if (says("handshake") || says("peer name")) {
    return "its certificate is refused: name the authority of etcd's certificates by --store-authority, and in "
           "--store an address that they are for";
  }
  // TLS 1.3 says too late that it refuses a client's certificate for gRPC to say more.
  if (says("endpoint read failed") || says("socket closed") || says("reset by peer") || says("broken pipe")) {
    return "it ends the connection: show it a certificate that it trusts by --store-certificate and --store-key; or "
           "only one side speaks TLS, which --store-authority turns on";
  }
  return "start it: more than half of its members have to run, and answer at an address of --store";
}

}  // namespace tessera::control
