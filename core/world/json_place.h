// JsonPlace: where a field stands in a JSON text, for the errors of a parser that names fields and no lines.
//
//   JsonPlace("{\"bodies\": [{}, {\"mas\": 3}]}", "bodies[1].mas");  // 17: its name
//
// It reads no more of the text than it has to, and takes any bytes. Thread rule: a free function on values.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace tessera {

// The position of the member's name or of the element that `path` leads to, as protobuf writes it: names in
// snake_case, or as they stand in the text, and elements from 0. Nothing where the text has none, or is not JSON up to
// there.
std::optional<std::size_t> JsonPlace(std::string_view text, std::string_view path);

}  // namespace tessera
