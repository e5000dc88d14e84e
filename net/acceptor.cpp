#include "net/acceptor.h"

#include <sodium.h>

#include <algorithm>
#include <cassert>
#include <numeric>

#include "absl/strings/str_cat.h"
#include "net/acceptor_session.h"
#include "net/address_shares.h"
#include "net/held_off.h"
#include "net/protocol.h"
#include "net/timer_queue.h"

namespace tessera::net {
namespace {

constexpr std::uint32_t kSlotBits = 12, kSlotMask = (1u << kSlotBits) - 1;

std::uint64_t SecondsOf(Acceptor::TimePoint now) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count());
}

std::span<const std::uint8_t> AsBytes(const std::uint32_t& host) {
  return {reinterpret_cast<const std::uint8_t*>(&host), sizeof host};
}

Refused ReasonOf(const absl::Status& status) {
  return absl::IsNotFound(status) ? Refused::kWrongInstance : Refused::kBadCredential;
}

}  // namespace

Acceptor::Acceptor(const AcceptorLimits& limits)
    : limits_(limits),
      hello_shares_(std::make_unique<AddressShares>()),
      login_shares_(std::make_unique<AddressShares>()),
      held_off_(std::make_unique<HeldOff>()),
      slots_(limits.max_sessions),
      generations_(limits.max_sessions),
      free_(limits.max_sessions),
      index_(std::make_unique<SessionIndex>()),
      timers_(std::make_unique<TimerQueue>()) {
  assert(limits.max_sessions >= 1 && limits.max_sessions <= kMaxSessions);
  randombytes_buf(hash_key_.data(), hash_key_.size());
  std::iota(free_.begin(), free_.end(), 0u);
}

Acceptor::~Acceptor() = default;

void Acceptor::Open(EndpointIdentity identity) {
  knock_ = KnockOf(identity.instance_key);
  identity_ = std::move(identity);
}
void Acceptor::Close(std::string why) { closed_because_ = std::move(why); }

// --- Sessions

Acceptor::Session* Acceptor::Find(SessionNumber number) const {
  const std::uint32_t slot = number.value() & kSlotMask;
  if (slot >= slots_.size() || slots_[slot] == nullptr || slots_[slot]->number != number) return nullptr;
  return slots_[slot].get();
}

Acceptor::Session* Acceptor::Make(const Address& address) {
  if (free_.empty()) return nullptr;
  const std::uint32_t slot = free_.front();
  free_.pop_front();
  std::uint16_t& generation = generations_[slot];
  generation = static_cast<std::uint16_t>(generation % kMaxSessions + 1);  // 1 to 4095
  slots_[slot] = std::make_unique<Session>();
  ++live_;
  Session& session = *slots_[slot];
  session.number = SessionNumber(std::uint32_t{generation} << kSlotBits | slot);
  session.address = address;
  return &session;
}

void Acceptor::Forget(SessionNumber number) {
  Session* session = Find(number);
  if (session == nullptr) return;
  SetDue(*session, std::nullopt);
  if (!session->dialled) index_->Leave(number, session->greeting(), session->holder, session->who.player);
  const std::uint32_t slot = number.value() & kSlotMask;
  slots_[slot].reset();
  free_.push_back(slot);
  --live_;
}

void Acceptor::SetDue(Session& session, std::optional<TimePoint> due) {
  timers_->Move(session.number, session.due, due);
}

void Acceptor::Settle(SessionNumber number) {
  Session& session = *Find(number);
  SetDue(session, std::nullopt);
  if (!session.dialled) index_->Settle(number, session.holder);
}
bool Acceptor::IsOpen(SessionNumber session) const { return Find(session)->channel.has_value(); }
bool Acceptor::IsDialled(SessionNumber session) const { return Find(session)->dialled; }
const Address& Acceptor::AddressOf(SessionNumber session) const { return Find(session)->address; }
const PeerIdentity& Acceptor::WhoIs(SessionNumber session) const { return Find(session)->who; }
const std::optional<Refusal>& Acceptor::RefusalOf(SessionNumber session) const { return Find(session)->refusal; }

std::size_t Acceptor::Seal(SessionNumber session, DatagramKind kind, std::span<std::uint8_t> datagram,
                           std::size_t payload_bytes) {
  Session& to = *Find(session);
  return to.channel->Seal(kind, to.peer, datagram, payload_bytes);
}

// --- Received datagrams

Acceptor::Received Acceptor::Receive(TimePoint now, const Address& from, std::span<std::uint8_t> datagram) {
  const auto kind = datagram.empty() ? DatagramKind{} : static_cast<DatagramKind>(datagram[0]);
  if (kind == DatagramKind::kSealed || kind == DatagramKind::kDirect) return OnSealed(now, from, datagram);
  stats_.bytes_from_unproven += datagram.size();
  const bool is_hello = kind == DatagramKind::kHello, is_login = kind == DatagramKind::kLogin;
  if (is_hello) {
    ++(IsStrangers(datagram) ? unproven_.strangers : unproven_.hellos);
  } else {
    ++(is_login ? unproven_.logins : unproven_.others);
  }
  switch (kind) {
    case DatagramKind::kHello:
      return OnHello(now, from, datagram);
    case DatagramKind::kLogin:
      return OnLogin(now, from, datagram);
    case DatagramKind::kChallenge:
      return OnChallenge(now, from, datagram);
    case DatagramKind::kAccept:
      return OnAccept(from, datagram);
    case DatagramKind::kRefusal:
      return OnRefusal(from, datagram);
    case DatagramKind::kSealed:
    case DatagramKind::kDirect:
      break;
  }
  ++stats_.unknown;
  return {};
}

Acceptor::Received Acceptor::OnSealed(TimePoint now, const Address& from, std::span<std::uint8_t> datagram) {
  Session* session = nullptr;
  if (datagram.size() > kSealHeaderBytes + kSealTagBytes) session = Find(SessionNumber(SessionNumberOf(datagram)));
  if (session == nullptr || !session->channel || session->address != from) {
    stats_.bytes_from_unproven += datagram.size();
    ++stats_.unknown;
    return {};
  }
  ++session->received;
  if (!session->dialled && !session->budget.Take(now, limits_.accepted, datagram.size())) {
    ++stats_.excess;
    if (session->budget.IsToBeLimited()) exceeding_.push_back(session->number);
    if (!session->budget.BeginsToFlood(now, limits_.accepted)) return {};
    ++stats_.floods;
    return {.kind = Received::Kind::kFloods, .session = session->number};
  }
  const bool direct = datagram[0] == static_cast<std::uint8_t>(DatagramKind::kDirect);
  Channel::Fault fault{};
  const std::optional<std::span<std::uint8_t>> payload = session->channel->Open(datagram, &fault);
  session->budget.Opened(payload.has_value());
  if (!payload) {
    stats_.bytes_from_unproven += datagram.size();
    ++(fault == Channel::Fault::kReplayed ? stats_.replayed : stats_.forged);
    return {};
  }
  session->heard = true;
  ++stats_.payloads;
  return {.kind = direct ? Received::Kind::kDirect : Received::Kind::kPayload,
          .session = session->number,
          .bytes = *payload};
}

// It sees a hello as the kernel's filter does, whatever else is wrong with it.
bool Acceptor::IsStrangers(std::span<const std::uint8_t> hello) const {
  return !identity_ || hello.size() < kKnockAt + knock_.size() ||
         !std::equal(knock_.begin(), knock_.end(), hello.begin() + kKnockAt);
}

Acceptor::Received Acceptor::OnHello(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes) {
  const std::optional<Hello> hello = ReadHello(bytes);
  if (!identity_ || !hello) {
    ++stats_.unknown;
    return {};
  }
  // In this order strangers take nothing of the shares of others.
  const bool strangers = IsStrangers(bytes);
  if ((strangers && !strangers_.Take(now, limits_.strangers_hellos)) ||
      !hello_shares_->Take(now, HashOf(AsBytes(from.host)), limits_.hellos_of_an_address) ||
      (!strangers && !hellos_.Take(now, limits_.hellos))) {
    ++stats_.hellos_limited;
    return {};
  }
  ++stats_.hellos;
  if (hello->protocol != kProtocolVersion) {
    return Refuse(Refused::kProtocol, hello->session, hello->nonce,
                  absl::StrCat("you speak protocol ", hello->protocol, ", this region ", kProtocolVersion),
                  bytes.size());
  }
  return Reply(Write(Challenge{.session = hello->session,
                               .nonce = hello->nonce,
                               .incarnation = identity_->incarnation,
                               .cookie = cookies_.Bake(from, hello->nonce, SecondsOf(now))}));
}

// The checks go from the cheapest to the dearest.
Acceptor::Received Acceptor::OnLogin(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes) {
  const std::optional<Login> login = ReadLogin(bytes);
  if (!identity_ || !login) {
    ++stats_.unknown;
    return {};
  }
  // A cookie of an earlier life of this region does not hold here; the dialler asks for another.
  if (!cookies_.Good(login->cookie, from, login->nonce, SecondsOf(now)) ||
      login->incarnation != identity_->incarnation) {
    ++stats_.stale;
    return {};
  }
  if (!login_shares_->Take(now, HashOf(AsBytes(from.host)), limits_.logins_of_an_address)) {
    ++stats_.limited;
    return {};
  }
  ++stats_.logins;
  if (const auto known = index_->GreetedAs({from, login->nonce})) {
    const Session& session = *Find(*known);
    return session.heard ? Received{} : Reply(session.sent);  // the acceptance was lost
  }
  const auto refuse = [&](Refused reason, std::string_view why) {
    return Refuse(reason, login->session, login->nonce, std::string(why), bytes.size());
  };
  const std::uint64_t credential = HashOf(login->credential);
  if (held_off_->Holds(now, credential)) {
    ++stats_.held_off;
    return refuse(Refused::kBadCredential, "the credential was refused too often a moment ago");
  }
  const absl::StatusOr<Holder> holder = HolderOf(login->credential);
  if (!holder.ok()) {
    const absl::string_view why = holder.status().message();
    return refuse(ReasonOf(holder.status()), {why.data(), why.size()});
  }
  if (!IsSigned(bytes, holder->key)) {
    return refuse(Refused::kBadCredential, "the credential is shown by another than its holder");
  }
  if (closed_because_) return refuse(Refused::kStopping, *closed_because_);
  if (login->region != identity_->region) {
    return refuse(Refused::kWrongRegion,
                  absl::StrCat("this is region ", identity_->region.value(), ", not ", login->region.value()));
  }
  DropUnsettled(holder->key);
  if (free_.empty()) return refuse(Refused::kFull, absl::StrCat("all ", limits_.max_sessions, " places are taken"));
  if (index_->CountFrom(from.host) >= limits_.max_per_address) {
    return refuse(Refused::kFull, absl::StrCat("all ", limits_.max_per_address, " places of one address are taken"));
  }
  const PlayerNumber player = holder->who.player;
  if (player != PlayerNumber() && index_->CountOf(player) >= limits_.max_per_player) {
    return refuse(Refused::kFull, absl::StrCat("all ", limits_.max_per_player, " places of one player are taken"));
  }
  return Admit(now, from, *login, bytes, *holder);
}

absl::StatusOr<Acceptor::Holder> Acceptor::HolderOf(std::span<const std::uint8_t> credential) const {
  Holder holder;
  if (identity_->for_regions) {
    const auto certificate = ReadWorkerCertificate(credential, identity_->instance_id, identity_->instance_key);
    if (!certificate.ok()) return certificate.status();
    holder.who.region = certificate->region;
    holder.who.incarnation = certificate->incarnation;
    holder.key = certificate->key;
  } else {
    const auto player = ReadPlayerCredential(credential, identity_->instance_id, identity_->instance_key);
    if (!player.ok()) return player.status();
    holder.who.player = player->player;
    holder.who.generation = player->generation;
    holder.key = player->key;
  }
  return holder;
}

Acceptor::Received Acceptor::Admit(TimePoint now, const Address& from, const Login& login,
                                   std::span<const std::uint8_t> bytes, const Holder& holder) {
  const EphemeralKey ephemeral;
  const std::optional<SharedSecret> shared = ephemeral.SharedWith(login.ephemeral);
  if (!shared) {
    return Refuse(Refused::kBadCredential, login.session, login.nonce, "the ephemeral key is a point of low order",
                  bytes.size());
  }
  ++stats_.accepted;
  Session& session = *Make(from);
  session.peer = login.session;
  session.nonce = login.nonce;
  session.who = holder.who;
  session.holder = holder.key;
  session.credential = HashOf(login.credential);
  SetDue(session, now + kUnsettled);
  index_->Enter(session.number, session.greeting(), session.holder, session.who.player);
  session.sent = Write(Accept{.session = login.session,
                              .peer = session.number.value(),
                              .ephemeral = ephemeral.public_key(),
                              .certificate = identity_->certificate},
                       bytes, identity_->key);
  assert(session.sent.size() < bytes.size());
  const DirectionKeys keys = DeriveKeys(*shared, bytes, session.sent);
  session.channel.emplace(keys.to_dialler, keys.to_acceptor);
  return Reply(session.sent);
}

Acceptor::Received Acceptor::Reply(std::vector<std::uint8_t> bytes) {
  reply_ = std::move(bytes);
  stats_.bytes_to_unproven += reply_.size();
  return {.kind = Received::Kind::kReply, .bytes = reply_};
}

Acceptor::Received Acceptor::Refuse(Refused reason, std::uint32_t session, const Nonce& nonce, std::string detail,
                                    std::size_t question_bytes) {
  ++stats_.refused;
  std::replace_if(
      detail.begin(), detail.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
  return Reply(Write(Refusal{.reason = reason, .session = session, .nonce = nonce, .detail = std::move(detail)},
                     question_bytes));
}

// A credential has at most one unsettled session, so its holder cannot fill the acceptor with them.
void Acceptor::DropUnsettled(const VerificationKey& holder) {
  if (const auto number = index_->UnsettledOf(holder)) Forget(*number);
}

std::optional<std::uint64_t> Acceptor::ReceivedOf(SessionNumber session) const {
  const Session* found = Find(session);
  return found == nullptr || found->dialled ? std::nullopt : std::optional(found->received);
}

std::uint64_t Acceptor::HashOf(std::span<const std::uint8_t> bytes) const {
  std::uint64_t hash = 0;
  static_assert(sizeof hash == crypto_shorthash_BYTES && Secret<16>::size() == crypto_shorthash_KEYBYTES);
  crypto_shorthash(reinterpret_cast<std::uint8_t*>(&hash), bytes.data(), bytes.size(), hash_key_.data());
  return hash;
}

void Acceptor::NoteRefused(TimePoint now, SessionNumber number, bool floods) {
  held_off_->Note(now, Find(number)->credential, floods ? kRefusalsAtOnce : 1);
}

}  // namespace tessera::net
