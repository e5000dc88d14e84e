// Secrets: tokens that admit an agent. Only hashes are stored, so the store's file admits nobody.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace tessera::control {

// Gives `n` bytes that nobody can guess. It is passed in, so that simulations replay.
using RandomBytes = std::function<std::string(std::size_t n)>;
// Random bytes of the operating system.
std::string SystemRandomBytes(std::size_t n);

// 32 random bytes as text: "tsj_" (join token) or "tsh_" (host secret) and 64 hexadecimal digits.
std::string MakeJoinToken(const RandomBytes& random);
std::string MakeHostSecret(const RandomBytes& random);
std::string MakeAccessSecret(const RandomBytes& random);  // "tsa_"
// A certificate's: 16 random bytes as hexadecimal digits, the first not 0.
std::string MakeSerial(const RandomBytes& random);

// BLAKE2b-256. It needs neither salt nor stretching, since a secret has 256 random bits.
std::string HashSecret(std::string_view secret);
// Both compare in constant time. An empty stored hash matches nothing, nor does a secret of more than kMaxSecretBytes,
// which is not hashed.
bool HashMatches(std::string_view hash, std::string_view stored);
bool SecretMatches(std::string_view secret, std::string_view stored);

}  // namespace tessera::control
