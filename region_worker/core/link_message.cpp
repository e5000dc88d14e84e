#include "region_worker/core/link_message.h"

#include <algorithm>

#include "core/world/bytes.h"

namespace tessera::worker {
namespace {

// Small against a message's limit, so that frames come in between.
constexpr std::size_t kLogPieceBytes = 256 * 1024;

}  // namespace

std::optional<LinkMessage> ReadLinkMessage(std::span<const std::uint8_t> bytes) {
  using Kind = LinkMessageKind;
  if (bytes.empty() || bytes[0] < static_cast<std::uint8_t>(Kind::kLog)) return LinkMessage{.bytes = bytes};
  LinkMessage message;
  message.kind = static_cast<Kind>(bytes[0]);
  const auto rest = bytes.subspan(1);
  switch (message.kind) {
    case Kind::kLog:
      if (rest.empty() || rest[0] > 1) return std::nullopt;
      message.last = rest[0] == 1;
      message.bytes = rest.subspan(1);
      return message;
    case Kind::kLogTaken:
    case Kind::kLeaseAsk:
    case Kind::kLeaseGiven:
      if (rest.size() != sizeof message.number) return std::nullopt;
      message.number = ByteReader(rest).U64();
      return message;
    case Kind::kPlaces:
      message.bytes = rest;
      return message;
    case Kind::kLogAgain:
    case Kind::kAlive:
      if (!rest.empty()) return std::nullopt;
      return message;
    case Kind::kFrame:
      break;
  }
  return std::nullopt;
}

std::vector<std::vector<std::uint8_t>> LogPieces(std::span<const std::uint8_t> log) {
  std::vector<std::vector<std::uint8_t>> pieces;
  pieces.reserve(log.size() / kLogPieceBytes + 1);
  do {
    const auto part = log.first(std::min(kLogPieceBytes, log.size()));
    log = log.subspan(part.size());
    std::vector<std::uint8_t>& piece = pieces.emplace_back();
    piece.reserve(part.size() + 2);
    piece.push_back(static_cast<std::uint8_t>(LinkMessageKind::kLog));
    piece.push_back(log.empty() ? 1 : 0);
    piece.insert(piece.end(), part.begin(), part.end());
  } while (!log.empty());
  return pieces;
}

std::vector<std::uint8_t> Numbered(LinkMessageKind kind, std::uint64_t number) {
  ByteWriter message;
  message.U8(static_cast<std::uint8_t>(kind));
  message.U64(number);
  return message.Take();
}

std::vector<std::uint8_t> Bare(LinkMessageKind kind) { return {static_cast<std::uint8_t>(kind)}; }

}  // namespace tessera::worker
