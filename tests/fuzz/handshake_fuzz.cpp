// A stranger's datagrams at a door, one after the other: what is read says the same when it is written again, nothing
// is kept of any, and every answer is shorter than its question.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "net/door.h"
#include "net/handshake.h"
#include "net/protocol.h"

namespace {

using namespace tessera::net;  // NOLINT: every name here is of it
using Bytes = std::vector<std::uint8_t>;

constexpr Address kFrom{.host = 0x0200007f, .port = 5000};

void Require(bool holds) {
  if (!holds) std::abort();
}

void ReadAll(std::span<const std::uint8_t> bytes) {
  const SessionKey key;
  if (const auto hello = ReadHello(bytes)) Require(ReadHello(Write(*hello)) == hello);
  if (const auto challenge = ReadChallenge(bytes)) Require(ReadChallenge(Write(*challenge)) == challenge);
  if (const auto login = ReadLogin(bytes)) {
    Require(ReadLogin(Write(*login, key)) == login);
    Require(!IsProven(bytes, key));
  }
  if (const auto accept = ReadAccept(bytes)) {
    Require(ReadAccept(Write(*accept, key)) == accept);
    Require(!IsAccepted(bytes, key));
  }
  if (const auto refusal = ReadRefusal(bytes)) Require(ReadRefusal(Write(*refusal, kMaxHandshakeBytes)) == refusal);
}

Door& House() {
  static Door* house = [] {
    auto* door = new Door({.max_sessions = 4});
    door->Open({.instance_id = "plaza-1",
                .region = tessera::RegionId(1),
                .incarnation = tessera::Incarnation(1),
                .key = MakeInstanceKey()});
    return door;
  }();
  return *house;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first byte: whether the cookie in a login is to be replaced by a good one, so that what comes after is reached.
  if (size < 1) return 0;
  const bool help = (data[0] & 1) != 0;
  Bytes bytes(data + 1, data + size);
  ReadAll(bytes);
  Door& house = House();
  const Door::TimePoint now{std::chrono::hours(1)};
  if (auto login = ReadLogin(bytes); login && help) {
    Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = login->session, .nonce = login->nonce});
    const auto challenge = ReadChallenge(house.Receive(now, 1000, kFrom, hello).bytes);
    Require(challenge.has_value());
    login->cookie = challenge->cookie;
    login->incarnation = challenge->incarnation;
    bytes = Write(*login, SessionKey());
  }
  const std::size_t question = bytes.size();
  const Door::Received received = house.Receive(now, 1000, kFrom, bytes);
  Require(received.kind == Door::Received::Kind::kNothing || received.kind == Door::Received::Kind::kReply);
  Require(received.bytes.empty() || received.bytes.size() < question);
  Require(house.sessions() == 0);
  return 0;
}
