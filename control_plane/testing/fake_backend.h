// A game's backend, for tests: it has a key, and signs tickets with numbers that grow.
#pragma once

#include <sodium.h>

#include <algorithm>
#include <string>

#include "control_plane/now.h"
#include "tessera/v1/access.pb.h"
#include "trust/ticket.h"

namespace tessera::control {

struct FakeBackend {
  explicit FakeBackend(std::uint8_t key) : seed{key} {}

  v1::AddIssuerRequest Registration(const std::string& name, const std::string& instances = "") const {
    const trust::TicketPublicKey key = trust::PublicKeyOf(seed);
    v1::AddIssuerRequest request;
    request.set_name(name);
    request.set_public_key(std::string(key.begin(), key.end()));
    request.set_instances(instances);
    return request;
  }
  // The id that it gets when it is registered.
  void SetCluster(const std::string& id) { std::copy_n(id.begin(), cluster.size(), cluster.begin()); }

  trust::Ticket Make(const std::string& player_id, Now now) {
    trust::Ticket ticket;
    ticket.cluster = cluster;
    ticket.issued_at = std::chrono::floor<std::chrono::milliseconds>(now.unix_time);
    ticket.number = ++last_number;
    ticket.player_id = player_id;
    ticket.name = "name of " + player_id;
    return ticket;
  }
  std::string Sign(const trust::Ticket& ticket) const { return *trust::SignTicket(ticket, seed); }
  std::string MakeText(const std::string& player_id, Now now) { return Sign(Make(player_id, now)); }

  trust::TicketSeed seed;
  trust::TicketCluster cluster{};
  std::uint64_t last_number = 0;
};

}  // namespace tessera::control
