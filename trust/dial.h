// Dial: a gRPC channel to a control plane, over its socket or by TLS.
//
//   auto channel = trust::Dial("10.0.0.1:7700", {.authority = pem, .bearer_token = token});
//   if (!channel.ok()) return channel.status();
//   auto stub = v1::HostService::NewStub(*channel);
//
// There is no way without: over TCP it is TLS, and the server's certificate must be of the authority that is given, or
// that the address names by its fingerprint.
//
// Given several control planes, "10.0.0.1:7700,10.0.0.2:7700", the channel is to the one that leads, whichever that is
// at the time of a call: gRPC watches the health of all of them, and gives calls to the one that serves. While nobody
// leads calls fail with UNAVAILABLE, and streams end with their leader. (Where the list mixes IPv4 with IPv6 the
// channel stays with the one that leads now.)
//
// A message has at most kMaxMessageBytes (message_size.h), unless `arguments` say how much is received.
//
// Thread rule: any thread. An address with a fingerprint is dialled once here, to have the authority's certificate;
// that is kept for the life of the process.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "trust/credentials.h"

namespace tessera::trust {

// Errors: INVALID_ARGUMENT (address, token), UNAVAILABLE and UNAUTHENTICATED as FetchAuthority's, FAILED_PRECONDITION:
// nothing says whom to trust at a TCP address. For a list also UNAVAILABLE: "no control plane of ... leads: ...", at
// most twice kFindLeaderPatience later.
absl::StatusOr<std::shared_ptr<grpc::Channel>> Dial(const std::string& address, const Credentials& credentials = {},
                                                    grpc::ChannelArguments arguments = {});

// How long several control planes are asked which of them leads.
inline constexpr std::chrono::milliseconds kFindLeaderPatience{2000};

}  // namespace tessera::trust
