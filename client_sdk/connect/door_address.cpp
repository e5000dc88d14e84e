#include "client_sdk/connect/door_address.h"

#include <algorithm>
#include <charconv>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "host/control_socket.h"
#include "host/json_socket.h"

namespace tessera::client {
namespace {

constexpr absl::string_view kUnixPrefix = "unix:";
constexpr std::size_t kFingerprintDigits = 64, kLongestHost = 253;

// Its characters go into an address of HTTP. One of IPv6 is in brackets, and no other.
bool IsHost(absl::string_view host, bool bracketed) {
  if (bracketed && host.find(':') == absl::string_view::npos) return false;
  return !host.empty() && host.size() <= kLongestHost && std::all_of(host.begin(), host.end(), [bracketed](char c) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return plain || c == '.' || (bracketed ? c == ':' : c == '-' || c == '_');
  });
}

bool IsLowerHex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

absl::Status SetTcp(absl::string_view text, DoorAddress& address) {
  const std::size_t colon = text.rfind(':');
  if (colon != absl::string_view::npos) {
    absl::string_view host = text.substr(0, colon);
    const absl::string_view digits = text.substr(colon + 1);
    const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
    if (bracketed) host = host.substr(1, host.size() - 2);
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), address.port);
    const bool number = read.ec == std::errc() && read.ptr == digits.data() + digits.size() && address.port > 0;
    if (number && IsHost(host, bracketed)) {
      address.host = std::string(host);
      return absl::OkStatus();
    }
  }
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not of the form HOST:PORT"));
}

}  // namespace

absl::StatusOr<DoorAddress> ParseDoorAddress(const std::string& given) {
  DoorAddress address;
  address.text = given.empty() ? absl::StrCat(kUnixPrefix, host::DefaultControlSocket()) : given;
  const absl::string_view text = address.text;
  if (text.substr(0, kUnixPrefix.size()) == kUnixPrefix) {
    const std::string path(text.substr(kUnixPrefix.size()));
    if (path.empty() || path.front() != '/') {
      return absl::InvalidArgumentError(absl::StrCat("\"", text, "\": the path of a socket begins with /"));
    }
    address.socket = host::JsonSocket(path);
    if (address.socket.size() > host::kLongestSocketPath) {
      return absl::InvalidArgumentError(absl::StrCat("\"", text, "\": the path has ", address.socket.size(),
                                                     " bytes with .json, the kernel takes ", host::kLongestSocketPath));
    }
    return address;
  }
  const std::size_t mark = text.find('#');
  if (absl::Status status = SetTcp(text.substr(0, mark), address); !status.ok()) return status;
  if (mark == absl::string_view::npos) return address;
  address.fingerprint = std::string(text.substr(mark + 1));
  if (address.fingerprint.size() != kFingerprintDigits || !IsLowerHex(address.fingerprint)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\": after # comes a fingerprint of 64 hexadecimal digits in lower case"));
  }
  return address;
}

}  // namespace tessera::client
