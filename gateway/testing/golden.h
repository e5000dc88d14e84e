// Golden files of the viewer protocol, gateway/testing/golden: messages, and what they say in words beside them. The
// page's tests read the same files.
//
// With TESSERA_WRITE_GOLDEN in the environment the files are written instead of compared: only when the protocol's
// version changes. Thread rule: free functions; one thread.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>

#include "gateway/testing/viewer_decoder.h"

namespace tessera::gateway {

inline std::string GoldenFile(const std::string& name) { return TESSERA_SOURCE_DIR "/gateway/testing/golden/" + name; }

inline std::string ReadGolden(const std::string& name) {
  std::ifstream in(GoldenFile(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Words of a message or of several, as their files hold them.
inline std::string WordsText(const nlohmann::ordered_json& words) { return words.dump(1) + "\n"; }

inline void ExpectGoldenFile(const std::string& name, const std::string& content) {
  if (std::getenv("TESSERA_WRITE_GOLDEN") != nullptr) std::ofstream(GoldenFile(name), std::ios::binary) << content;
  EXPECT_TRUE(ReadGolden(name) == content) << name << " differs";
}

// Compares the message with NAME.bin, byte by byte, and what it says with NAME.json.
inline void ExpectGolden(const std::string& name, std::span<const std::uint8_t> message, ViewerDecoder& decoder) {
  ExpectGoldenFile(name + ".bin", std::string(message.begin(), message.end()));
  ExpectGoldenFile(name + ".json", WordsText(decoder.Take(message)));
}

}  // namespace tessera::gateway
