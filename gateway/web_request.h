// The parts of a request that the web server reads, and the headers that stand in all of its answers.
//
// Thread rule: free functions; those that take a connection, on the thread of its loop.
#pragma once

#include <libwebsockets.h>

#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace tessera::gateway {

// Whether a request with these headers is for this gateway, from a page of its own; either may be empty. `host` is
// "127.0.0.1:7710", `origin` is "http://127.0.0.1:7710".
bool MayConnect(const std::string& host, const std::string& origin, const std::vector<std::string>& allow_origins);

// Whether it can be the name of an instance or a recording: letters, digits, dash, underscore and dot.
bool IsName(absl::string_view name, std::size_t most);

// Empty where there is none, or it is longer than 511 bytes.
std::string HeaderOf(lws* wsi, lws_token_indexes header);
// False: the headers have no room for it.
bool AddHeader(lws* wsi, lws_token_indexes header, const std::string& value, unsigned char** at, unsigned char* end);
// Headers of all answers: a page loads nothing from elsewhere and is part of no other.
const lws_protocol_vhost_options* CommonHeaders();

}  // namespace tessera::gateway
