// Content: a file that all workers of an instance need, known by its hash: its scene, or its game.
//
//   CheckContent({ContentKind::kGame, hash}, bytes)     // OK, or "has hash ..."
//
// Thread rule: plain values and free functions.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::agent {

enum class ContentKind : std::uint8_t { kScene, kGame };

struct Content {
  ContentKind kind = ContentKind::kScene;
  std::string hash;
  friend auto operator<=>(const Content&, const Content&) = default;
};

const char* NameOf(ContentKind kind);           // "scene", "game"
std::size_t MaxContentBytes(ContentKind kind);  // above, it is not what it claims to be

// All that a worker with this order needs, the scene first. A native game is none: it is here, or it is not.
std::vector<Content> ContentsOf(const v1::WorkerOrder& order);

// INVALID_ARGUMENT unless `bytes` are the content: "is no scene", "has 2097152 bytes, more than 1048576", "has hash
// ...".
absl::Status CheckContent(const Content& content, const std::string& bytes);

}  // namespace tessera::agent
