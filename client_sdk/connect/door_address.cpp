#include "client_sdk/connect/door_address.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client_sdk/connect/own_door.h"
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

bool IsSocket(absl::string_view text) { return text.substr(0, kUnixPrefix.size()) == kUnixPrefix; }

// One that was stated.
absl::StatusOr<DoorAddress> ParseStated(std::string stated) {
  DoorAddress address;
  address.text = std::move(stated);
  const absl::string_view text = address.text;
  if (IsSocket(text)) {
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

// A path may hold commas.
std::vector<std::string> PartsOf(absl::string_view text) {
  if (IsSocket(text)) return {std::string(text)};
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    parts.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

}  // namespace

absl::StatusOr<DoorAddress> ParseDoorAddress(const std::string& text) {
  if (!text.empty()) return ParseStated(text);
  const std::string own = OwnControlSocket();
  if (own.empty()) return absl::InvalidArgumentError("control_address: names no control plane: HOST:PORT#FINGERPRINT");
  return ParseStated(absl::StrCat(kUnixPrefix, own));
}

absl::StatusOr<std::vector<DoorAddress>> ParseDoorAddresses(const std::string& text) {
  std::vector<DoorAddress> addresses;
  if (text.empty()) {
    auto own = ParseDoorAddress(text);
    if (!own.ok()) return own.status();
    addresses.push_back(*std::move(own));
    return addresses;
  }
  const std::vector<std::string> parts = PartsOf(text);
  if (parts.size() > kMostDoorAddresses) {
    return absl::InvalidArgumentError(
        absl::StrCat("names ", parts.size(), " control planes, at most ", kMostDoorAddresses, " are taken"));
  }
  std::string fingerprint;
  for (const std::string& part : parts) {
    auto address = ParseStated(part);
    if (!address.ok()) return address.status();
    if (address->is_socket() && parts.size() > 1) {
      return absl::InvalidArgumentError(absl::StrCat("\"", part, "\": a socket stands alone, in no list"));
    }
    if (fingerprint.empty()) fingerprint = address->fingerprint;
    if (!address->fingerprint.empty() && address->fingerprint != fingerprint) {
      return absl::InvalidArgumentError(absl::StrCat(
          "\"", text, "\": control planes of one cluster have one authority; name the same fingerprint for each"));
    }
    addresses.push_back(*std::move(address));
  }
  return addresses;
}

}  // namespace tessera::client
