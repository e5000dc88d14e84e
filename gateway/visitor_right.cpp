#include "gateway/visitor_right.h"

#include <grpcpp/grpcpp.h>
#include <sodium.h>

#include <array>
#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "gateway/instance_feed.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "trust/control_address.h"

namespace tessera::gateway {
namespace {

constexpr std::size_t kKeyBytes = 32;
constexpr std::chrono::seconds kCheckDeadline{10};

}  // namespace

std::string MakeKey() {
  std::array<unsigned char, kKeyBytes> bytes{};
  randombytes_buf(bytes.data(), bytes.size());
  std::array<char, 2 * kKeyBytes + 1> hex{};
  sodium_bin2hex(hex.data(), hex.size(), bytes.data(), bytes.size());
  return hex.data();
}

bool IsKey(std::string_view key, std::string_view shown) {
  return !key.empty() && key.size() == shown.size() && sodium_memcmp(key.data(), shown.data(), key.size()) == 0;
}

bool IsSocket(const std::string& control_address) {
  const auto address = trust::ParseControlAddress(control_address, host::PortRule::kFrom1);
  return address.ok() && address->is_socket();
}

absl::Status CheckKeyPlaces(const std::string& control_address, const host::SocketAddress& listen) {
  if (!IsSocket(control_address)) {
    return absl::InvalidArgumentError(
        "--key-file: only where --control is a socket; elsewhere visitors give orders by their own access tokens");
  }
  if (!host::IsLoopback(listen.host)) {
    return absl::InvalidArgumentError(absl::StrCat("--key-file: only with --listen at loopback, not at ", listen.host,
                                                   ": whoever is on the way would read the key"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> DialAs(trust::ControlPoint control, const std::string& token) {
  control.credentials = {
      .authority = control.credentials.authority, .certificate = {}, .key = {}, .bearer_token = token};
  return DialControl(control);
}

absl::Status CheckMayOrder(const std::shared_ptr<grpc::Channel>& channel, const std::string& instance) {
  // Checks an order and gives none: what the call would say of the world's state does not matter here.
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kCheckDeadline);
  v1::PauseInstanceRequest request;
  request.set_id(instance);
  request.set_validate_only(true);
  v1::PauseInstanceResponse response;
  const grpc::Status status = v1::InstanceService::NewStub(channel)->PauseInstance(&context, request, &response);
  if (status.ok() || status.error_code() == grpc::StatusCode::FAILED_PRECONDITION) return absl::OkStatus();
  return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
}

}  // namespace tessera::gateway
