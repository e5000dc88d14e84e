// Joining through a control plane, in C++17: tessera.hpp with the functions of connect.h. Header only.
//
//   tessera::Client client;
//   if (tessera::Error error = client.Join({"play.example:7704#3fa8...", "plaza-1", "ada"})) return Fail(error.text);
#ifndef TESSERA_CONNECT_HPP_
#define TESSERA_CONNECT_HPP_

#include <chrono>
#include <string>
#include <vector>

#include "connect.h"
#include "tessera.hpp"

namespace tessera {

using InstanceInfo = tessera_instance_info;

// The worlds of a control plane, ended ones too. Waits for the answer; any thread may call it.
inline Error ListInstances(const std::string& control_address, std::vector<InstanceInfo>& instances,
                           std::chrono::milliseconds deadline = std::chrono::milliseconds(3000)) {
  instances.assign(TESSERA_MAX_LISTED_INSTANCES, InstanceInfo TESSERA_INSTANCE_INFO);
  std::size_t count = 0;
  const tessera_code code =
      tessera_list_instances(control_address.c_str(), static_cast<std::uint32_t>(deadline.count()), instances.data(),
                             sizeof(InstanceInfo), instances.size(), &count);
  instances.resize(count);
  return Error::Of(code);
}

// The same options in C, which point into these.
inline tessera_join_options JoinOptionsOf(const Options& options) {
  tessera_join_options given = TESSERA_JOIN_OPTIONS;
  given.deadline_ms = static_cast<std::uint32_t>(options.deadline.count());
  given.control_address = options.control_address.c_str();
  given.instance_id = options.instance_id.c_str();
  given.player_name = options.player_name.c_str();
  given.bind_address = options.bind_address.empty() ? nullptr : options.bind_address.c_str();
  given.flags = 0;
  if (options.predict) given.flags |= TESSERA_JOIN_PREDICT;
  if (options.watch) given.flags |= TESSERA_JOIN_WATCH;
  given.returning = options.returning.data();
  given.returning_size = static_cast<std::uint32_t>(options.returning.size());
  given.ticket = options.ticket.empty() ? nullptr : options.ticket.c_str();
  return given;
}

// The grant alone, for Client::JoinByGrant or Client::Renew. Waits for the control plane; any thread may call it.
inline Error GetGrant(const Options& options, std::vector<std::uint8_t>& grant) {
  const tessera_join_options given = JoinOptionsOf(options);
  grant.resize(TESSERA_MAX_GRANT);
  std::size_t size = 0;
  const tessera_code code = tessera_get_grant(&given, grant.data(), grant.size(), &size);
  grant.resize(code == TESSERA_OK ? size : 0);
  return Error::Of(code);
}

inline Error Client::Join(const Options& options) {
  const tessera_join_options given = JoinOptionsOf(options);
  tessera_client* joined = nullptr;
  const Error error = Error::Of(tessera_join(&given, &joined));
  client_.reset(joined);
  return error;
}

}  // namespace tessera

#endif
