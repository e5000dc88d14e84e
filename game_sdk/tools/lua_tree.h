// LuaTree: a Lua source as a tree of what the checker asks for: names, functions, tables, calls and assignments. All
// other statements and all operators are nodes of kind kOther, whose children stand in their order.
//
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::game {

enum class LuaNodeKind : std::uint8_t {
  kName,           // text
  kText,           // text, as it is written
  kIndex,          // children: what is indexed, the key; a.b has the text b as its key
  kCall,           // children: the function, then arguments
  kMethod,         // text: the name; children: the receiver, then arguments
  kFunction,       // names: parameters; children: the block
  kTable,          // children: kField
  kField,          // children: the value, or key and value
  kOther,          // children
  kBlock,          // children: statements
  kLocal,          // names; children: values
  kLocalFunction,  // names: one; children: the function
  kAssign,         // children: `targets` targets, then values; so is `function a.b() end`
  kFor,            // names; children: expressions, then the block
  kRepeat,         // children: the block, the condition
};

struct LuaNode {
  LuaNodeKind kind = LuaNodeKind::kOther;
  int line = 0;
  std::string_view text;  // in the source
  std::vector<std::string_view> names;
  std::size_t targets = 0;
  std::vector<std::unique_ptr<LuaNode>> children;
};

// Requires a source that Lua compiles, and that outlives the tree. INVALID_ARGUMENT: it has a chain of more than 500
// calls and fields, or does not compile after all.
absl::StatusOr<std::unique_ptr<LuaNode>> ParseLua(std::string_view source);

}  // namespace tessera::game
