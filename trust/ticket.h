// Tickets: who somebody is, signed by a game's backend, which the control plane exchanges for a place in an instance.
//
// A ticket names the issuer's key, the cluster and the instance that it is for, the player, and when it was issued. It
// is text (base64url) of a versioned binary body and an Ed25519 signature; docs/tickets.md has the bytes, for backends
// in any language. The control plane alone judges its time, by its own clock.
//
//   const std::string text = *SignTicket(ticket, seed);          // a backend
//   auto shown = ParseTicket(text);                              // the control plane: the form, every limit
//   if (!shown.ok() || !IsSignedBy(*shown, issuer_public_key)) ...
//   absl::Status status = CheckTime(shown->ticket, now);
//
// Thread rule: free functions on values. Errors are one line that begins with "ticket: ".
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/properties.h"

namespace tessera::trust {

using TicketSeed = std::array<std::uint8_t, 32>;       // Ed25519; secret
using TicketPublicKey = std::array<std::uint8_t, 32>;  // Ed25519
using TicketKeyId = std::array<std::uint8_t, 8>;       // the first bytes of the public key's SHA-256
using TicketCluster = std::array<std::uint8_t, 16>;

// A ticket lives no longer than this: so long a copy of one that was not shown is worth something to a thief.
inline constexpr std::chrono::seconds kMaxTicketLifetime{300};
// How far the issuer's clock may be off, either way: machines that keep time by NTP stay far below it.
inline constexpr std::chrono::seconds kTicketLeeway{30};
inline constexpr std::size_t kMaxTicketInstance = 63;   // bytes of an instance's id
inline constexpr std::size_t kMaxTicketPlayerId = 64;   // bytes of a player's id
inline constexpr std::size_t kMaxTicketProperties = 8;  // each goes in every order until its player has left
inline constexpr std::size_t kMaxTicketText = 1736;     // characters: of a ticket with all of it at its longest

struct Ticket {
  TicketKeyId key{};  // filled in by SignTicket
  TicketCluster cluster{};
  std::chrono::milliseconds issued_at{0};  // Unix time
  std::chrono::seconds lifetime{kMaxTicketLifetime};
  std::uint64_t number = 0;  // higher than that of each earlier ticket of this player by this issuer
  std::string instance;      // id; empty: any of the cluster
  std::string player_id;     // 1 to 64 bytes of UTF-8, without control characters
  std::string name;          // as player_name.h has it
  // Properties of the player's body, that the scene declares: flags, numbers, reals and texts.
  std::vector<NamedProperty> properties;
  friend bool operator==(const Ticket&, const Ticket&) = default;
};

struct ShownTicket {
  Ticket ticket;
  std::vector<std::uint8_t> body;
  std::array<std::uint8_t, 64> signature{};
};

TicketPublicKey PublicKeyOf(const TicketSeed& seed);
TicketKeyId KeyIdOf(const TicketPublicKey& key);

// INVALID_ARGUMENT names the field: "ticket: player_id: ...". Everything but the key, the time and the signature.
absl::Status CheckTicket(const Ticket& ticket);
absl::StatusOr<std::string> SignTicket(Ticket ticket, const TicketSeed& seed);

// INVALID_ARGUMENT: not the text of a ticket, or of one that CheckTicket refuses. One ticket has one text.
absl::StatusOr<ShownTicket> ParseTicket(std::string_view text);
bool IsSignedBy(const ShownTicket& shown, const TicketPublicKey& key);
// UNAUTHENTICATED: it has run out, or is of the future.
absl::Status CheckTime(const Ticket& ticket, std::chrono::nanoseconds unix_time);

}  // namespace tessera::trust
