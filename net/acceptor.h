// Acceptor: all sessions of one socket, those that it accepted and those that it dialled. It keeps unproven peers from
// ENet.
//
// As the side that is dialled it answers a handshake (handshake.h): a peer that has not proven that it uses its address
// and holds a credential of this instance leaves nothing behind and gets fewer bytes than it sent. As the side that
// dials it sends Hello and Login, again and again, until it is accepted, refused or forgotten; it takes nobody for the
// region that it dialled who does not prove to be that. In either case a session follows whose datagrams are sealed by
// keys that only this pair and this connection have.
//
//   Acceptor acceptor({.max_sessions = 64});
//   acceptor.Open({.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(9), ...});
//   for each datagram:  switch (const Received r = acceptor.Receive(now, from, bytes); r.kind) ...
//   now and then:       for (Outgoing& out : acceptor.Due(now)) send(out.to, out.bytes);
//
// A datagram is answered in the same time however many sessions there are (session_index.h).
// Pure: datagrams and time come in. Thread rule: one thread.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "net/address.h"
#include "net/channel.h"
#include "net/credential.h"
#include "net/handshake.h"
#include "net/limits.h"
#include "net/token_bucket.h"

namespace tessera::net {

// Goes into every sealed datagram, 24 bits; from 1, and reused only after 4095 others of its slot.
using SessionNumber = Id<struct SessionTag, std::uint32_t>;

// The region behind an acceptor, what it proves that with, and the key by which it verifies others.
struct EndpointIdentity {
  std::string instance_id;
  RegionId region;
  Incarnation incarnation;
  VerificationKey instance_key{};
  std::vector<std::uint8_t> certificate;  // a signed WorkerCertificate: of this region, incarnation and key
  SigningKey key;
  bool for_regions = false;  // accepts certificates of workers instead of players' credentials
};

// With which the region dials others.
inline Credentials CredentialsOf(const EndpointIdentity& self) {
  return {.instance_id = self.instance_id,
          .statement = self.certificate,
          .key = self.key,
          .instance_key = self.instance_key};
}

// The proven identity of a peer: a player, or a region that dials its neighbour. The other is left out.
struct PeerIdentity {
  PlayerNumber player{};
  Generation generation{};
  RegionId region{};
  Incarnation incarnation{};
  friend bool operator==(const PeerIdentity&, const PeerIdentity&) = default;
};

struct AcceptorLimits {
  std::size_t max_sessions = 64;     // 1 to 4095, both ways
  std::size_t max_per_address = 64;  // accepted sessions of one IPv4 address
  // Accepted sessions of one player: the connection in use, earlier ones that fade, one that begins.
  std::size_t max_per_player = 8;
  // limits.h says why these.
  Rate hellos = kHellos, strangers_hellos = kStrangersHellos, hellos_of_an_address = kHellosOfAnAddress,
       logins_of_an_address = kLoginsOfAnAddress;
  SessionLimits accepted{};  // for each accepted session; without limit unless set
};

struct AcceptorStats {
  std::uint64_t hellos = 0, logins = 0, accepted = 0, refused = 0;
  std::uint64_t unknown = 0;         // no datagram of this protocol, or of no session here
  std::uint64_t stale = 0;           // logins without a good cookie
  std::uint64_t limited = 0;         // logins beyond an address's share
  std::uint64_t hellos_limited = 0;  // hellos beyond an address's share, strangers', or that of all
  std::uint64_t held_off = 0;        // logins with a credential that was refused too often a moment ago; refused
  std::uint64_t excess = 0;          // datagrams of sessions beyond what a session may send
  std::uint64_t floods = 0;          // sessions that sent such for so long that they are to be ended
  std::uint64_t replayed = 0;        // sealed, but received before or too old
  std::uint64_t forged = 0;          // sealed by another key, or damaged
  std::uint64_t payloads = 0;
  // Bytes of all datagrams but the payloads of sessions.
  std::uint64_t bytes_from_unproven = 0, bytes_to_unproven = 0;
};

// Datagrams of the kinds that prove nothing, whatever came of them. `strangers`: hellos without the instance's knock.
struct UnprovenDatagrams {
  std::uint64_t hellos = 0, strangers = 0, logins = 0, others = 0;
};

class AddressShares;
class HeldOff;
class SessionIndex;
class TimerQueue;

class Acceptor {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  static constexpr std::size_t kMaxSessions = 4095;
  // From acceptance until the caller has settled the session.
  static constexpr Duration kUnsettled = std::chrono::seconds(3);
  static constexpr Duration kFirstRetry = std::chrono::milliseconds(100), kMaxRetry = std::chrono::seconds(1);
  // Hellos of one try; the first try has one, each other twice those before it.
  static constexpr int kMaxHelloCopies = 8;
  // Logins without an answer until it starts anew: another acceptor may be there by now, or the cookie is old.
  static constexpr int kLoginTries = 4;

  explicit Acceptor(const AcceptorLimits& limits);
  ~Acceptor();

  // From now on handshakes are answered; before, nothing is, and all hellos are strangers'.
  void Open(EndpointIdentity identity);
  // From now on logins are refused with STOPPING.
  void Close(std::string why);

  // Begins to dial an acceptor of that region, in its life `least` or a later one; nothing where all sessions are in
  // use.
  std::optional<SessionNumber> Dial(TimePoint now, const Address& to, RegionId region, Incarnation least,
                                    Credentials credentials);

  struct Received {
    enum class Kind : std::uint8_t {
      kNothing,
      kReply,    // bytes are to be sent back
      kPayload,  // session, bytes: ENet's, within the datagram
      kDirect,   // session, bytes: an unsequenced message that bypasses ENet
      kDialled,  // session: one that was dialled is open now
      kRefused,  // session: one that was dialled is refused, see RefusalOf; the caller forgets it
      kFloods,   // session: one that was accepted sends too much, and has for long; the caller ends it. Once
    };
    Kind kind = Kind::kNothing;
    SessionNumber session{};
    std::span<std::uint8_t> bytes{};  // valid until the next call
  };
  // `datagram` is overwritten.
  Received Receive(TimePoint now, const Address& from, std::span<std::uint8_t> datagram);

  // As Channel::Seal. Requires an open session.
  std::size_t Seal(SessionNumber session, DatagramKind kind, std::span<std::uint8_t> datagram,
                   std::size_t payload_bytes);

  struct Outgoing {
    Address to;
    std::vector<std::uint8_t> bytes;
  };
  // Datagrams that dialled sessions have to send by now. Accepted sessions that were not settled in time end here.
  std::vector<Outgoing> Due(TimePoint now);
  std::optional<TimePoint> next_due() const;

  // The session is in use: it lives until it is forgotten.
  void Settle(SessionNumber session);
  void Forget(SessionNumber session);
  // The caller refused an accepted session after it had let it in. Its credential is not looked at for kHoldOff from
  // the kRefusalsAtOnce-th time on, or from now on if it `floods`.
  void NoteRefused(TimePoint now, SessionNumber session, bool floods);

  bool Has(SessionNumber session) const { return Find(session) != nullptr; }
  // These require the session.
  bool IsOpen(SessionNumber session) const;
  bool IsDialled(SessionNumber session) const;
  const Address& AddressOf(SessionNumber session) const;
  const PeerIdentity& WhoIs(SessionNumber session) const;                // requires an accepted session
  const std::optional<Refusal>& RefusalOf(SessionNumber session) const;  // requires a dialled session

  // Accepted sessions that sent far more than they may since this was asked last; their ends are to be limited.
  std::vector<SessionNumber> TakeExceeding() { return std::exchange(exceeding_, {}); }
  // Datagrams of an accepted session, those beyond its budget too; nothing: there is no such session.
  std::optional<std::uint64_t> ReceivedOf(SessionNumber session) const;

  std::size_t sessions() const { return live_; }
  const AcceptorStats& stats() const { return stats_; }
  const UnprovenDatagrams& unproven() const { return unproven_; }

 private:
  struct Session;

  Session* Find(SessionNumber number) const;
  Session* Make(const Address& address);
  Session* DialOf(std::uint32_t number, const Nonce& nonce, const Address& from) const;

  Received Reply(std::vector<std::uint8_t> bytes);
  Received Refuse(Refused reason, std::uint32_t session, const Nonce& nonce, std::string detail,
                  std::size_t question_bytes);
  Received OnSealed(TimePoint now, const Address& from, std::span<std::uint8_t> datagram);
  bool IsStrangers(std::span<const std::uint8_t> hello) const;
  Received OnHello(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes);
  Received OnLogin(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes);
  // The holder of a login's credential, and its key.
  struct Holder {
    PeerIdentity who;
    VerificationKey key{};
  };
  absl::StatusOr<Holder> HolderOf(std::span<const std::uint8_t> credential) const;
  Received Admit(TimePoint now, const Address& from, const Login& login, std::span<const std::uint8_t> bytes,
                 const Holder& holder);
  Received OnChallenge(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes);
  Received OnAccept(const Address& from, std::span<const std::uint8_t> bytes);
  Received OnRefusal(const Address& from, std::span<const std::uint8_t> bytes);

  void DropUnsettled(const VerificationKey& holder);
  void SetDue(Session& session, std::optional<TimePoint> due);
  std::uint64_t HashOf(std::span<const std::uint8_t> bytes) const;
  void SendHello(Session& session);

  AcceptorLimits limits_;
  std::optional<EndpointIdentity> identity_;
  std::optional<std::string> closed_because_;
  CookieJar cookies_;
  Secret<16> hash_key_;
  Knock knock_{};  // the instance's, once it is open
  TokenBucket hellos_, strangers_;
  std::unique_ptr<AddressShares> hello_shares_, login_shares_;
  std::unique_ptr<HeldOff> held_off_;
  std::vector<std::unique_ptr<Session>> slots_;
  std::vector<std::uint16_t> generations_;
  std::deque<std::uint32_t> free_;  // slots; the one used longest ago comes first
  std::size_t live_ = 0;
  std::unique_ptr<SessionIndex> index_;  // accepted sessions
  std::unique_ptr<TimerQueue> timers_;
  std::vector<std::uint8_t> reply_;
  AcceptorStats stats_;
  UnprovenDatagrams unproven_;
  std::vector<SessionNumber> exceeding_;
};

}  // namespace tessera::net
