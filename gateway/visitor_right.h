// VisitorRight: by whose right a viewer's orders are carried out.
//
// The gateway's own token is there to watch. Who gives an order shows a right of his own, for as long as his connection
// lasts: an access token, by which the gateway dials the control plane for him alone, or, at a gateway beside a control
// plane's socket, the key of this start of the gateway, behind which the rights of that socket stand. Neither is
// logged. At a socket no token is taken, for nobody there would check it.
//
// Thread rule: free functions; DialAs and CheckMayOrder wait, off the event loop.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "host/socket_address.h"
#include "trust/credentials.h"

namespace grpc {
class Channel;
}

namespace tessera::gateway {

// 256 random bits, as 64 hexadecimal digits.
std::string MakeKey();
// In the same time, whatever differs. False for a gateway without a key.
bool IsKey(std::string_view key, std::string_view shown);
// INVALID_ARGUMENT: a key would be of no use at this control plane, or would go over a network as it is.
absl::Status CheckKeyPlaces(const std::string& control_address, const host::SocketAddress& listen);

// Whether the control plane there asks for no token.
bool IsSocket(const std::string& control_address);

// The control plane by the token in place of the gateway's own. Errors: those of trust::Dial.
absl::StatusOr<std::shared_ptr<grpc::Channel>> DialAs(trust::ControlPoint control, const std::string& token);
// Whether who calls through the channel may give orders to the instance. UNAUTHENTICATED, PERMISSION_DENIED, NOT_FOUND:
// the control plane's words; UNAVAILABLE: it does not answer.
absl::Status CheckMayOrder(const std::shared_ptr<grpc::Channel>& channel, const std::string& instance);

}  // namespace tessera::gateway
