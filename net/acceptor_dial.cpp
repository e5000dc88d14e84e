// The dialling side of an acceptor, and its timers.

#include <algorithm>

#include "net/acceptor.h"
#include "net/acceptor_session.h"
#include "net/protocol.h"
#include "net/timer_queue.h"

namespace tessera::net {

std::optional<SessionNumber> Acceptor::Dial(TimePoint now, const Address& to, RegionId region, Incarnation least,
                                            Credentials credentials) {
  Session* session = Make(to);
  if (session == nullptr) return std::nullopt;
  session->dialled = true;
  session->region = region;
  session->least = least;
  session->credentials = std::move(credentials);
  SetDue(*session, now);
  SendHello(*session);
  return session->number;
}

void Acceptor::SendHello(Session& session) {
  session.nonce = MakeNonce(KnockOf(session.credentials.instance_key));
  session.incarnation.reset();
  session.ephemeral.reset();
  session.sent = Write(Hello{.protocol = kProtocolVersion, .session = session.number.value(), .nonce = session.nonce});
  session.tries = 0;
}

Acceptor::Session* Acceptor::DialOf(std::uint32_t number, const Nonce& nonce, const Address& from) const {
  Session* session = Find(SessionNumber(number));
  const bool waits = session != nullptr && session->dialled && !session->channel && !session->refusal;
  return waits && session->address == from && session->nonce == nonce ? session : nullptr;
}

Acceptor::Received Acceptor::OnChallenge(TimePoint now, const Address& from, std::span<const std::uint8_t> bytes) {
  const std::optional<Challenge> challenge = ReadChallenge(bytes);
  Session* session = challenge ? DialOf(challenge->session, challenge->nonce, from) : nullptr;
  if (session == nullptr || session->incarnation || challenge->incarnation < session->least) {
    ++stats_.unknown;
    return {};
  }
  session->incarnation = challenge->incarnation;
  session->ephemeral.emplace();
  session->sent = Write(Login{.session = session->number.value(),
                              .nonce = session->nonce,
                              .cookie = challenge->cookie,
                              .region = session->region,
                              .incarnation = challenge->incarnation,
                              .ephemeral = session->ephemeral->public_key(),
                              .credential = session->credentials.statement},
                        session->credentials.key);
  session->retry = kFirstRetry;
  SetDue(*session, now + session->retry);
  session->tries = 1;
  return Reply(session->sent);
}

Acceptor::Received Acceptor::OnAccept(const Address& from, std::span<const std::uint8_t> bytes) {
  const std::optional<Accept> accept = ReadAccept(bytes);
  Session* session = accept ? Find(SessionNumber(accept->session)) : nullptr;
  const bool expected = session != nullptr && session->dialled && !session->channel && !session->refusal &&
                        session->incarnation && session->address == from;
  if (!expected) {
    ++stats_.unknown;
    return {};
  }
  // Only what the instance's key says of this region and this life of it counts, and what that worker's own key signed.
  const Credentials& own = session->credentials;
  const auto certificate = ReadWorkerCertificate(accept->certificate, own.instance_id, own.instance_key);
  const bool proven = certificate.ok() && certificate->region == session->region &&
                      certificate->incarnation == *session->incarnation &&
                      IsSigned(bytes, session->sent, certificate->key);
  const std::optional<SharedSecret> shared = proven ? session->ephemeral->SharedWith(accept->ephemeral) : std::nullopt;
  if (!shared) {
    ++stats_.forged;
    return {};
  }
  const DirectionKeys keys = DeriveKeys(*shared, session->sent, bytes);
  session->peer = accept->peer;
  session->channel.emplace(keys.to_acceptor, keys.to_dialler);
  session->credentials = {};
  session->ephemeral.reset();
  session->sent.clear();
  SetDue(*session, std::nullopt);
  return {.kind = Received::Kind::kDialled, .session = session->number, .bytes = {}};
}

Acceptor::Received Acceptor::OnRefusal(const Address& from, std::span<const std::uint8_t> bytes) {
  std::optional<Refusal> refusal = ReadRefusal(bytes);
  Session* session = refusal ? DialOf(refusal->session, refusal->nonce, from) : nullptr;
  if (session == nullptr) {
    ++stats_.unknown;
    return {};
  }
  session->refusal = std::move(refusal);
  SetDue(*session, std::nullopt);
  return {.kind = Received::Kind::kRefused, .session = session->number, .bytes = {}};
}

std::vector<Acceptor::Outgoing> Acceptor::Due(TimePoint now) {
  std::vector<Outgoing> out;
  for (auto next = timers_->first(); next && next->at <= now; next = timers_->first()) {
    Session& session = *Find(next->session);
    if (!session.dialled) {
      Forget(session.number);
      continue;
    }
    if (session.tries >= kLoginTries && session.incarnation) SendHello(session);
    // An acceptor under a flood answers a random share of hellos, so further tries say it several times.
    const int copies = session.incarnation ? 1 : std::min(1 << std::min(session.tries, 8), kMaxHelloCopies);
    ++session.tries;
    stats_.bytes_to_unproven += static_cast<std::size_t>(copies) * session.sent.size();
    out.insert(out.end(), static_cast<std::size_t>(copies), {session.address, session.sent});
    SetDue(session, now + session.retry);
    session.retry = std::min(session.retry * 2, kMaxRetry);
  }
  return out;
}

std::optional<Acceptor::TimePoint> Acceptor::next_due() const {
  const auto next = timers_->first();
  return next ? std::optional(next->at) : std::nullopt;
}

}  // namespace tessera::net
