// A ticket's text as strangers send it, and a ticket's body behind the text: refused, or it is in every limit, says the
// same when it is signed again, and is signed by nobody.
#include <sodium.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "trust/ticket.h"

namespace {

constexpr tessera::trust::TicketSeed kSeed{7};

void Take(const std::string& text) {
  using namespace tessera::trust;
  static const TicketPublicKey key = PublicKeyOf(TicketSeed{1, 2, 3});
  const auto shown = ParseTicket(text);
  if (!shown.ok()) return;
  if (IsSignedBy(*shown, key)) std::abort();
  const auto again = SignTicket(shown->ticket, kSeed);
  if (!again.ok()) std::abort();
  const auto parsed = ParseTicket(*again);
  if (!parsed.ok() || !IsSignedBy(*parsed, PublicKeyOf(kSeed))) std::abort();
  Ticket expected = shown->ticket;
  expected.key = KeyIdOf(PublicKeyOf(kSeed));
  // Reals are compared by their bytes: signing again gave the same body but for the key.
  std::vector<std::uint8_t> body = shown->body;
  for (std::size_t i = 0; i < expected.key.size(); ++i) body[1 + i] = expected.key[i];
  if (parsed->body != body) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int started = sodium_init();
  if (started < 0) std::abort();
  Take(std::string(reinterpret_cast<const char*>(data), size));
  constexpr int kVariant = sodium_base64_VARIANT_URLSAFE_NO_PADDING;
  std::string text(sodium_base64_encoded_len(size, kVariant), '\0');
  sodium_bin2base64(text.data(), text.size(), data, size, kVariant);
  text.pop_back();
  Take(text);
  return 0;
}
