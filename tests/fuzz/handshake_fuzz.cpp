// Datagrams of an unproven peer at an acceptor: a datagram that is read comes back when it is written again, none
// leaves anything behind, and every answer is shorter than its question.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "net/acceptor.h"
#include "net/handshake.h"
#include "net/protocol.h"
#include "net/testing/test_identity.h"

namespace {

using namespace tessera::net;  // NOLINT: every name here is from it
using Bytes = std::vector<std::uint8_t>;

constexpr Address kFrom{.host = 0x0200007f, .port = 5000};

void Require(bool holds) {
  if (!holds) std::abort();
}

void ReadAll(std::span<const std::uint8_t> bytes) {
  static const SigningKey key = SigningKey::Make();
  if (const auto hello = ReadHello(bytes)) Require(ReadHello(Write(*hello)) == hello);
  if (const auto challenge = ReadChallenge(bytes)) Require(ReadChallenge(Write(*challenge)) == challenge);
  if (const auto login = ReadLogin(bytes)) {
    Require(ReadLogin(Write(*login, key)) == login);
    Require(!IsSigned(bytes, key.verification_key()));
  }
  if (const auto accept = ReadAccept(bytes)) {
    Require(ReadAccept(Write(*accept, bytes, key)) == accept);
    Require(!IsSigned(bytes, bytes, key.verification_key()));
  }
  if (const auto refusal = ReadRefusal(bytes)) Require(ReadRefusal(Write(*refusal, kMaxHandshakeBytes)) == refusal);
}

Acceptor& TestAcceptor() {
  static Acceptor* acceptor = [] {
    auto* acceptor = new Acceptor({.max_sessions = 4});
    acceptor->Open(TestWorker(SigningKey::Make(), "plaza-1", tessera::RegionId(1), tessera::Incarnation(1)));
    return acceptor;
  }();
  return *acceptor;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first byte: whether the cookie in a login is to be replaced by a good one, so that what comes after is reached.
  if (size < 1) return 0;
  const bool help = (data[0] & 1) != 0;
  Bytes bytes(data + 1, data + size);
  ReadAll(bytes);
  Acceptor& acceptor = TestAcceptor();
  // An address has a budget of hellos a second; time goes on, so that it is never used up.
  static Acceptor::TimePoint now{std::chrono::hours(1)};
  now += std::chrono::milliseconds(10);
  if (auto login = ReadLogin(bytes); login && help) {
    Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = login->session, .nonce = login->nonce});
    const auto challenge = ReadChallenge(acceptor.Receive(now, kFrom, hello).bytes);
    Require(challenge.has_value());
    login->cookie = challenge->cookie;
    login->incarnation = challenge->incarnation;
    bytes = Write(*login, SigningKey());
  }
  const std::size_t question = bytes.size();
  const Acceptor::Received received = acceptor.Receive(now, kFrom, bytes);
  Require(received.kind == Acceptor::Received::Kind::kNothing || received.kind == Acceptor::Received::Kind::kReply);
  Require(received.bytes.empty() || received.bytes.size() < question);
  Require(acceptor.sessions() == 0);
  return 0;
}
