// Door: all sessions of one socket: who may come in, who is in, whom this side called on. It keeps strangers from ENet.
//
// As the one that answers: a stranger that is not proven to use its address and to hold a token of this instance leaves
// nothing behind and is sent fewer bytes than it sent. As the one that dials: it says Hello and Login, again and again,
// until it is accepted, refused or forgotten. In either case a session follows whose datagrams are sealed by keys that
// only this pair and this connection have.
//
//   Door door({.max_sessions = 64});
//   door.Open({.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(9), .key = key});
//   for each datagram:  switch (const Received r = door.Receive(now, unix_s, from, bytes); r.kind) ...
//   now and then:       for (Outgoing& out : door.Due(now)) send(out.to, out.bytes);
//
// A datagram is answered in the same time however many are inside (guest_book.h).
// No socket and no clock: datagrams and time come in. Thread rule: one thread.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/world/ids.h"
#include "net/address.h"
#include "net/channel.h"
#include "net/connect_token.h"
#include "net/handshake.h"

namespace tessera::net {

// Goes into every sealed datagram, 24 bits; from 1, and reused only after 4095 others of its slot.
using SessionNumber = Id<struct SessionTag, std::uint32_t>;

// Who is behind a door and whom it lets in.
struct Doorplate {
  std::string instance_id;
  RegionId region;
  Incarnation incarnation;
  InstanceKey key;
  bool for_regions = false;  // tokens of neighbours, instead of players
};

struct DoorLimits {
  std::size_t max_sessions = 64;     // 1 to 4095, both ways
  std::size_t max_per_address = 64;  // of those that came in
  // Likewise: the connection in use, those before it that fade, one that begins.
  std::size_t max_per_player = 8;
  // Logins with a good cookie of one address; each costs some 10 us. A house of players or bots may share one.
  double logins_per_s = 256, login_burst = 512;
};

struct DoorStats {
  std::uint64_t hellos = 0, logins = 0, accepted = 0, refused = 0;
  std::uint64_t strange = 0;   // no datagram of this protocol, or for nobody here
  std::uint64_t stale = 0;     // logins without a good cookie
  std::uint64_t limited = 0;   // logins beyond an address's share
  std::uint64_t replayed = 0;  // sealed, but here before or too old
  std::uint64_t forged = 0;    // sealed by another key, or damaged
  std::uint64_t payloads = 0;
  // Of all that is not the payload of a session.
  std::uint64_t bytes_from_strangers = 0, bytes_to_strangers = 0;
};

class Agenda;
class GuestBook;

class Door {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  static constexpr std::size_t kMaxSessions = 4095;
  // From acceptance until the caller has settled the session.
  static constexpr Duration kUnsettled = std::chrono::seconds(3);
  static constexpr Duration kFirstRetry = std::chrono::milliseconds(100), kMaxRetry = std::chrono::seconds(1);
  // Logins without an answer until it starts anew: the door may be another by now, or the cookie old.
  static constexpr int kLoginTries = 4;

  explicit Door(const DoorLimits& limits);
  ~Door();

  // From now on strangers are answered; before, nothing is.
  void Open(Doorplate plate);
  // From now on they are refused: STOPPING.
  void Close(std::string why);

  // Begins to call at a door of that region; nothing where all sessions are in use.
  std::optional<SessionNumber> Dial(TimePoint now, const Address& to, RegionId region, Credentials credentials);

  struct Received {
    enum class Kind : std::uint8_t {
      kNothing,
      kReply,    // bytes: to be sent back
      kPayload,  // session, bytes: within the datagram; ENet's
      kDirect,   // the same; a message that went past ENet
      kDialled,  // session: that was dialled is open now
      kRefused,  // session: that was dialled is refused; see RefusalOf. The caller forgets it
    };
    Kind kind = Kind::kNothing;
    SessionNumber session{};
    std::span<std::uint8_t> bytes{};  // until the next call
  };
  // `datagram` is overwritten. `unix_s` is held against the expiry of tokens.
  Received Receive(TimePoint now, std::uint64_t unix_s, const Address& from, std::span<std::uint8_t> datagram);

  // As Channel::Seal. Requires an open session.
  std::size_t Seal(SessionNumber session, DatagramKind kind, std::span<std::uint8_t> datagram,
                   std::size_t payload_bytes);

  struct Outgoing {
    Address to;
    std::vector<std::uint8_t> bytes;
  };
  // What dials have to say by now. Sessions that came in and were not settled in time end here.
  std::vector<Outgoing> Due(TimePoint now);
  std::optional<TimePoint> next_due() const;

  // The session is in use: it lives until it is forgotten.
  void Settle(SessionNumber session);
  void Forget(SessionNumber session);

  bool Has(SessionNumber session) const { return Find(session) != nullptr; }
  // These require the session.
  bool IsOpen(SessionNumber session) const;
  bool IsDialled(SessionNumber session) const;
  const Address& AddressOf(SessionNumber session) const;
  const ConnectToken& TokenOf(SessionNumber session) const;              // of one that came in
  const std::optional<Refusal>& RefusalOf(SessionNumber session) const;  // of one that was dialled

  std::size_t sessions() const { return live_; }
  const DoorStats& stats() const { return stats_; }

 private:
  struct Session;
  struct Share {  // of the logins per second
    double left = 0;
    TimePoint since{};
  };

  Session* Find(SessionNumber number) const;
  Session* Make(const Address& address);
  Session* DialOf(std::uint32_t number, const Nonce& nonce, const Address& from) const;

  Received Reply(std::vector<std::uint8_t> bytes);
  Received Refuse(Refused reason, std::uint32_t session, const Nonce& nonce, std::string detail,
                  std::size_t question_bytes);
  Received OnSealed(const Address& from, std::span<std::uint8_t> datagram);
  Received OnHello(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes);
  Received OnLogin(TimePoint now, std::uint64_t unix_s, const Address& from, std::span<const std::uint8_t> bytes);
  Received Admit(TimePoint now, const Address& from, const Login& login, const SessionKey& key, ConnectToken token);
  Received OnChallenge(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes);
  Received OnAccept(const Address& from, std::span<const std::uint8_t> bytes);
  Received OnRefusal(const Address& from, std::span<const std::uint8_t> bytes);

  void DropUnsettled(std::span<const std::uint8_t> token);
  void SetDue(Session& session, std::optional<TimePoint> due);
  bool WithinShare(TimePoint now, const Address& from);
  void SayHello(Session& session);

  DoorLimits limits_;
  std::optional<Doorplate> plate_;
  std::optional<std::string> closed_because_;
  CookieJar cookies_;
  Secret<16> share_key_;
  std::vector<Share> shares_;
  std::vector<std::unique_ptr<Session>> slots_;
  std::vector<std::uint16_t> generations_;
  std::deque<std::uint32_t> free_;  // the one used longest ago comes first
  std::size_t live_ = 0;
  std::unique_ptr<GuestBook> guests_;  // all that came in
  std::unique_ptr<Agenda> agenda_;     // all that are due
  std::vector<std::uint8_t> reply_;
  DoorStats stats_;
};

}  // namespace tessera::net
