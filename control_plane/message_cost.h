// How much memory a message takes once it is parsed, known from its bytes without making anything of them.
//
// 64 MiB on the wire may be 32 million empty messages of a repeated field, which take gigabytes. So what comes from
// outside is gone through before it is parsed: each message counts with the size of its class, each string with its
// bytes, each number of a list with eight.
//
//   google::protobuf::io::ArrayInputStream bytes(data, size);
//   if (!TakesAtMost(bytes, *v1::AgentMessage::descriptor(), kMaxParsedBytes)) refuse();
//
// Thread rule: free functions on values.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/zero_copy_stream.h>

#include <cstddef>
#include <functional>
#include <string_view>

namespace tessera::control {

// Most that a request may take: a scene of two million triangles takes some 200 MB.
inline constexpr std::size_t kMaxParsedBytes = std::size_t{256} << 20;
// The same of a scene that was uploaded, one at a time.
inline constexpr std::size_t kMaxParsedSceneBytes = std::size_t{1} << 30;

// Whether a message of this type takes at most so many bytes. It stops counting there. Bytes that are no such message
// are counted up to the fault, as they are parsed.
bool TakesAtMost(google::protobuf::io::ZeroCopyInputStream& bytes, const google::protobuf::Descriptor& type,
                 std::size_t limit);
bool TakesAtMost(std::string_view bytes, const google::protobuf::Descriptor& type, std::size_t limit);

// The same of a message that is one of several: each of its fields has a limit of its own, by its number.
using LimitOfField = std::function<std::size_t(int number)>;
bool FieldsTakeAtMost(google::protobuf::io::ZeroCopyInputStream& bytes, const google::protobuf::Descriptor& type,
                      const LimitOfField& limit_of);

}  // namespace tessera::control
