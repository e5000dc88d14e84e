#include "trust/ticket.h"

#include <sodium.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"

namespace tessera::trust {
namespace {

constexpr std::uint8_t kTicketVersion = 1;
// Signed before the body, so that no signature of anything else passes for a ticket's.
constexpr std::string_view kTicketLabel = "tessera ticket 1\n";
constexpr std::size_t kMaxTicketPropertyName = 63;
constexpr std::chrono::milliseconds kLatestTicketTime{253'402'300'799'999};  // the end of the year 9999
enum class TicketValue : std::uint8_t { kFlag = 1, kNumber = 2, kReal = 3, kText = 4 };
constexpr int kTicketBase64 = sodium_base64_VARIANT_URLSAFE_NO_PADDING;

absl::Status TicketFault(std::string_view field, std::string_view why) {
  return absl::InvalidArgumentError(absl::StrCat("ticket: ", absl::string_view(field.data(), field.size()), ": ",
                                                 absl::string_view(why.data(), why.size())));
}

absl::Status CheckTicketText(std::string_view field, std::string_view text, std::size_t least, std::size_t most) {
  if (text.size() < least || text.size() > most) {
    return TicketFault(field, absl::StrCat(text.size(), " bytes are not ", least, " to ", most));
  }
  if (!IsUtf8(text)) return TicketFault(field, "is not UTF-8");
  return HasNoControls(text) ? absl::OkStatus() : TicketFault(field, "has a control character");
}

absl::Status CheckTicketValue(const PropertyValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    return CheckTicketText("properties", *text, 0, kMaxPropertyText);
  }
  if (const auto* real = std::get_if<double>(&value)) {
    const bool sane = std::isfinite(*real) && std::abs(*real) <= kMaxPropertyReal;
    return sane ? absl::OkStatus() : TicketFault("properties", "a real is not finite or beyond 1e18");
  }
  const bool plain = std::holds_alternative<bool>(value) || std::holds_alternative<std::int64_t>(value);
  return plain ? absl::OkStatus()
               : TicketFault("properties", "only flags, numbers, reals and texts travel in a ticket");
}

absl::Status CheckTicketProperties(const Ticket& ticket) {
  if (ticket.properties.size() > kMaxTicketProperties) {
    return TicketFault("properties", absl::StrCat(ticket.properties.size(), " are more than ", kMaxTicketProperties));
  }
  for (auto it = ticket.properties.begin(); it != ticket.properties.end(); ++it) {
    if (absl::Status status = CheckTicketText("properties", it->first, 1, kMaxTicketPropertyName); !status.ok()) {
      return status;
    }
    const auto same = [&](const auto& other) { return other.first == it->first; };
    if (std::any_of(ticket.properties.begin(), it, same)) {
      return TicketFault("properties", absl::StrCat("\"", it->first, "\" is there twice"));
    }
    if (absl::Status status = CheckTicketValue(it->second); !status.ok()) return status;
  }
  return absl::OkStatus();
}

void WriteTicketText(std::string_view text, ByteWriter& out) {
  out.U8(static_cast<std::uint8_t>(text.size()));
  out.Text(text);
}

void WriteTicketValue(const PropertyValue& value, ByteWriter& out) {
  if (const bool* flag = std::get_if<bool>(&value)) {
    out.U8(static_cast<std::uint8_t>(TicketValue::kFlag));
    out.U8(*flag ? 1 : 0);
  } else if (const auto* number = std::get_if<std::int64_t>(&value)) {
    out.U8(static_cast<std::uint8_t>(TicketValue::kNumber));
    out.U64(static_cast<std::uint64_t>(*number));
  } else if (const auto* real = std::get_if<double>(&value)) {
    out.U8(static_cast<std::uint8_t>(TicketValue::kReal));
    out.F64(*real);
  } else {
    out.U8(static_cast<std::uint8_t>(TicketValue::kText));
    WriteTicketText(std::get<std::string>(value), out);
  }
}

std::vector<std::uint8_t> TicketBody(const Ticket& ticket) {
  ByteWriter out;
  out.U8(kTicketVersion);
  out.Bytes(ticket.key);
  out.Bytes(ticket.cluster);
  out.U64(static_cast<std::uint64_t>(ticket.issued_at.count()));
  out.U16(static_cast<std::uint16_t>(ticket.lifetime.count()));
  out.U64(ticket.number);
  for (const std::string& text : {ticket.instance, ticket.player_id, ticket.name}) WriteTicketText(text, out);
  out.U8(static_cast<std::uint8_t>(ticket.properties.size()));
  for (const auto& [name, value] : ticket.properties) {
    WriteTicketText(name, out);
    WriteTicketValue(value, out);
  }
  return out.Take();
}

std::string ReadTicketText(ByteReader& in) {
  const std::span<const std::uint8_t> text = in.Bytes(in.U8());
  return {text.begin(), text.end()};
}

PropertyValue ReadTicketValue(ByteReader& in) {
  switch (static_cast<TicketValue>(in.U8())) {
    case TicketValue::kFlag: {
      const std::uint8_t flag = in.U8();
      if (flag > 1) in.Fail("a flag is neither 0 nor 1");
      return flag == 1;
    }
    case TicketValue::kNumber:
      return static_cast<std::int64_t>(in.U64());
    case TicketValue::kReal:
      return in.F64();
    case TicketValue::kText:
      return ReadTicketText(in);
  }
  in.Fail("a value of an unknown type");
  return false;
}

Ticket ReadTicketBody(ByteReader& in) {
  Ticket ticket;
  in.Field("key");
  in.Fill(ticket.key);
  in.Field("cluster");
  in.Fill(ticket.cluster);
  in.Field("issued_at");
  const std::uint64_t issued_at = in.U64();
  if (issued_at > static_cast<std::uint64_t>(kLatestTicketTime.count())) in.Fail("beyond the year 9999");
  ticket.issued_at = std::chrono::milliseconds(in.ok() ? issued_at : 0);
  in.Field("lifetime");
  ticket.lifetime = std::chrono::seconds(in.U16());
  in.Field("number");
  ticket.number = in.U64();
  in.Field("instance");
  ticket.instance = ReadTicketText(in);
  in.Field("player_id");
  ticket.player_id = ReadTicketText(in);
  in.Field("name");
  ticket.name = ReadTicketText(in);
  in.Field("properties");
  const std::size_t properties = in.U8();
  for (std::size_t i = 0; i < properties && in.ok() && i <= kMaxTicketProperties; ++i) {
    std::string name = ReadTicketText(in);
    ticket.properties.emplace_back(std::move(name), ReadTicketValue(in));
  }
  if (in.ok() && properties > kMaxTicketProperties) in.Fail("too many");
  if (in.ok() && in.remaining() > 0) in.Fail("bytes follow that are no part of a ticket");
  return ticket;
}

std::vector<std::uint8_t> TicketMessage(std::span<const std::uint8_t> body) {
  ByteWriter out;
  out.Text(kTicketLabel);
  out.Bytes(body);
  return out.Take();
}

}  // namespace

TicketPublicKey PublicKeyOf(const TicketSeed& seed) {
  TicketPublicKey key{};
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> secret{};
  crypto_sign_seed_keypair(key.data(), secret.data(), seed.data());
  sodium_memzero(secret.data(), secret.size());
  return key;
}

TicketKeyId KeyIdOf(const TicketPublicKey& key) {
  std::array<std::uint8_t, crypto_hash_sha256_BYTES> hash{};
  crypto_hash_sha256(hash.data(), key.data(), key.size());
  TicketKeyId id{};
  std::copy_n(hash.begin(), id.size(), id.begin());
  return id;
}

absl::Status CheckTicket(const Ticket& ticket) {
  if (ticket.issued_at.count() < 0 || ticket.issued_at > kLatestTicketTime) {
    return TicketFault("issued_at", "is not in the years 1970 to 9999");
  }
  if (ticket.lifetime < std::chrono::seconds(1) || ticket.lifetime > kMaxTicketLifetime) {
    return TicketFault("lifetime",
                       absl::StrCat(ticket.lifetime.count(), " s is not in 1 to ", kMaxTicketLifetime.count(), " s"));
  }
  if (ticket.number == 0) return TicketFault("number", "is 0");
  if (absl::Status status = CheckTicketText("instance", ticket.instance, 0, kMaxTicketInstance); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckTicketText("player_id", ticket.player_id, 1, kMaxTicketPlayerId); !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckTicketText("name", ticket.name, 0, kMaxPlayerNameBytes); !status.ok()) return status;
  return CheckTicketProperties(ticket);
}

absl::StatusOr<std::string> SignTicket(Ticket ticket, const TicketSeed& seed) {
  if (absl::Status status = CheckTicket(ticket); !status.ok()) return status;
  ticket.key = KeyIdOf(PublicKeyOf(seed));
  std::vector<std::uint8_t> bytes = TicketBody(ticket);
  const std::vector<std::uint8_t> message = TicketMessage(bytes);
  std::array<std::uint8_t, crypto_sign_PUBLICKEYBYTES> key{};
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> secret{};
  std::array<std::uint8_t, crypto_sign_BYTES> signature{};
  crypto_sign_seed_keypair(key.data(), secret.data(), seed.data());
  crypto_sign_detached(signature.data(), nullptr, message.data(), message.size(), secret.data());
  sodium_memzero(secret.data(), secret.size());
  bytes.insert(bytes.end(), signature.begin(), signature.end());
  std::string text(sodium_base64_encoded_len(bytes.size(), kTicketBase64), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), kTicketBase64);
  text.pop_back();  // the zero at its end
  return text;
}

absl::StatusOr<ShownTicket> ParseTicket(std::string_view text) {
  if (text.size() > kMaxTicketText) {
    return absl::InvalidArgumentError(
        absl::StrCat("ticket: ", text.size(), " characters are more than ", kMaxTicketText));
  }
  if (text.empty()) return absl::InvalidArgumentError("ticket: is empty");
  ShownTicket shown;
  std::vector<std::uint8_t> bytes(text.size());
  std::size_t size = 0;
  if (sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &size, nullptr, kTicketBase64) !=
          0 ||
      size <= shown.signature.size()) {
    return absl::InvalidArgumentError("ticket: is not base64url without padding, or too short");
  }
  const std::span<const std::uint8_t> body(bytes.data(), size - shown.signature.size());
  ByteReader in(body);
  if (const std::uint8_t version = in.U8(); version != kTicketVersion) {
    return absl::InvalidArgumentError(absl::StrCat("ticket: is of version ", static_cast<int>(version),
                                                   "; this control plane reads ", static_cast<int>(kTicketVersion)));
  }
  shown.ticket = ReadTicketBody(in);
  if (!in.ok()) return absl::InvalidArgumentError(absl::StrCat("ticket: ", in.error()));
  if (absl::Status status = CheckTicket(shown.ticket); !status.ok()) return status;
  shown.body.assign(body.begin(), body.end());
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(body.size()), shown.signature.size(),
              shown.signature.begin());
  return shown;
}

bool IsSignedBy(const ShownTicket& shown, const TicketPublicKey& key) {
  const std::vector<std::uint8_t> message = TicketMessage(shown.body);
  return crypto_sign_verify_detached(shown.signature.data(), message.data(), message.size(), key.data()) == 0;
}

absl::Status CheckTime(const Ticket& ticket, std::chrono::nanoseconds unix_time) {
  using std::chrono::seconds;
  const auto now = std::chrono::floor<std::chrono::milliseconds>(unix_time);
  const auto ahead = ticket.issued_at - now, over = now - (ticket.issued_at + ticket.lifetime);
  if (ahead > kTicketLeeway) {
    return absl::UnauthenticatedError(absl::StrCat("ticket: was issued ", std::chrono::ceil<seconds>(ahead).count(),
                                                   " s in the future: a clock is wrong"));
  }
  if (over > kTicketLeeway) {
    return absl::UnauthenticatedError(
        absl::StrCat("ticket: ran out ", std::chrono::floor<seconds>(over).count(), " s ago"));
  }
  return absl::OkStatus();
}

}  // namespace tessera::trust
