#include "game_sdk/lua/kept_state.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <new>
#include <string_view>

#include "game_sdk/lua/lua_state.h"

namespace tessera::game {
namespace {

// Constants of lopcodes.h, lobject.h and lundump.h of Lua 5.4, none of which is installed.
constexpr std::uint8_t kVersion = 0x54, kFormat = 0;
constexpr std::string_view kData = "\x19\x93\r\n\x1a\n";
constexpr std::size_t kInstructionBytes = 4;
constexpr lua_Integer kSampleInteger = 0x5678;
constexpr lua_Number kSampleNumber = 370.5;
// UpValue[B] := R[A]: the operation in the low 7 bits, B in bits 16 to 23.
constexpr std::uint32_t kSetUpvalue = 10, kOperationMask = 0x7f, kShiftOfB = 16;
// Types of constants.
constexpr std::uint8_t kNilConstant = 0x00, kFalseConstant = 0x01, kTrueConstant = 0x11, kIntegerConstant = 0x03,
                       kNumberConstant = 0x13, kShortTextConstant = 0x04, kLongTextConstant = 0x14;
// Stands in the list of line differences for a line in the list of absolute ones.
constexpr std::int8_t kAbsoluteLine = -0x80;
// Functions within functions; Lua's compiler refuses more than 200.
constexpr int kMaxDepth = 250;

class Reader {
 public:
  Reader(std::string_view bytes, std::vector<Prototype>& prototypes) : bytes_(bytes), prototypes_(prototypes) {}

  bool Read() {
    if (!ReadHeader()) return false;
    std::vector<int> written;
    ReadFunction(0, written);
    return good_ && bytes_.empty();
  }

 private:
  struct Write {
    std::size_t instruction, upvalue;
  };
  // How an inner function gets its variable: from one of the enclosing function's, or from its stack.
  struct Source {
    bool in_stack;
    std::uint8_t index;
  };

  std::string_view Take(std::size_t count) {
    if (count > bytes_.size()) good_ = false;
    if (!good_) return {};
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }

  std::uint8_t Byte() {
    const std::string_view byte = Take(1);
    return good_ ? static_cast<std::uint8_t>(byte[0]) : std::uint8_t{0};
  }

  template <class T>
  bool Is(T expected) {
    const std::string_view bytes = Take(sizeof expected);
    return good_ && std::memcmp(bytes.data(), &expected, sizeof expected) == 0;
  }

  // Seven bits a byte, the highest first; the last byte has its top bit set.
  std::size_t Size() {
    std::size_t size = 0;
    for (int i = 0; i < 9 && good_; ++i) {
      const std::uint8_t byte = Byte();
      size = size << 7 | (byte & 0x7f);
      if ((byte & 0x80) != 0) return size;
    }
    good_ = false;
    return 0;
  }

  // A count of things of at least one byte each, so that a wrong one asks for no more memory than the file has.
  std::size_t Count() {
    const std::size_t count = Size();
    if (count > bytes_.size()) good_ = false;
    return good_ ? count : 0;
  }

  std::string_view Text() {
    const std::size_t size = Size();
    return size == 0 ? std::string_view() : Take(size - 1);
  }

  bool ReadHeader() {
    if (Take(4) != std::string_view(LUA_SIGNATURE) || Byte() != kVersion || Byte() != kFormat) return false;
    if (Take(kData.size()) != kData) return false;
    if (Byte() != kInstructionBytes || Byte() != sizeof(lua_Integer) || Byte() != sizeof(lua_Number)) return false;
    if (!Is(kSampleInteger) || !Is(kSampleNumber)) return false;
    Byte();  // number of upvalues
    return good_;
  }

  std::vector<Write> ReadCode() {
    std::vector<Write> writes;
    const std::size_t count = Count();
    const std::string_view code = Take(count * kInstructionBytes);
    for (std::size_t i = 0; i < count && good_; ++i) {
      std::uint32_t instruction = 0;
      std::memcpy(&instruction, code.data() + i * kInstructionBytes, kInstructionBytes);
      if ((instruction & kOperationMask) == kSetUpvalue) writes.push_back({i, instruction >> kShiftOfB & 0xff});
    }
    return writes;
  }

  void SkipConstants() {
    for (std::size_t count = Count(); count > 0 && good_; --count) {
      switch (Byte()) {
        case kNilConstant:
        case kFalseConstant:
        case kTrueConstant:
          break;
        case kIntegerConstant:
        case kNumberConstant:
          Take(8);
          break;
        case kShortTextConstant:
        case kLongTextConstant:
          Text();
          break;
        default:
          good_ = false;
      }
    }
  }

  // The line of each instruction.
  std::vector<int> ReadLines(int first_line) {
    const std::string_view differences = Take(Count());
    struct Absolute {
      std::size_t instruction;
      int line;
    };
    std::vector<Absolute> absolutes(Count());
    for (Absolute& absolute : absolutes) {
      absolute.instruction = Size();
      absolute.line = static_cast<int>(Size());
    }
    std::vector<int> lines;
    int line = first_line;
    auto next = absolutes.begin();
    for (std::size_t i = 0; i < differences.size() && good_; ++i) {
      const auto difference = static_cast<std::int8_t>(differences[i]);
      if (difference != kAbsoluteLine) {
        line += difference;
      } else if (next != absolutes.end() && next->instruction == i) {
        line = next++->line;
      } else {
        good_ = false;
      }
      lines.push_back(line);
    }
    return lines;
  }

  // `written` gets the line where the function or one within it writes each of its upvalues, or 0.
  std::vector<Source> ReadFunction(int depth, std::vector<int>& written) {
    if (depth > kMaxDepth) good_ = false;
    if (!good_) return {};
    Prototype prototype;
    Text();  // the file's name
    prototype.line = static_cast<int>(Size());
    prototype.last_line = static_cast<int>(Size());
    prototype.parameters = Byte();
    prototype.vararg = Byte() != 0;
    Byte();  // stack size
    const std::vector<Write> writes = ReadCode();
    SkipConstants();
    std::vector<Source> sources(Count());
    for (Source& source : sources) {
      source.in_stack = Byte() != 0;
      source.index = Byte();
      Byte();  // kind of variable
    }
    written.assign(sources.size(), 0);
    const auto note = [&](std::size_t upvalue, int line) {
      if (upvalue >= written.size()) {
        good_ = false;
      } else if (written[upvalue] == 0 || line < written[upvalue]) {
        written[upvalue] = line;
      }
    };
    for (std::size_t count = Count(); count > 0 && good_; --count) {
      std::vector<int> inner_written;
      const std::vector<Source> inner = ReadFunction(depth + 1, inner_written);
      for (std::size_t i = 0; i < inner.size() && good_; ++i) {
        if (inner_written[i] != 0 && !inner[i].in_stack) note(inner[i].index, inner_written[i]);
      }
    }
    const std::vector<int> lines = ReadLines(prototype.line);
    for (const Write& write : writes) {
      if (write.instruction >= lines.size()) good_ = false;
      if (good_) note(write.upvalue, lines[write.instruction]);
    }
    SkipLocalNames();
    if (Count() != sources.size()) good_ = false;
    for (std::size_t i = 0; i < sources.size() && good_; ++i) {
      prototype.upvalues.push_back({std::string(Text()), written[i]});
    }
    if (good_) prototypes_.push_back(std::move(prototype));
    return sources;
  }

  void SkipLocalNames() {
    for (std::size_t count = Count(); count > 0 && good_; --count) {
      Text();
      Size();
      Size();
    }
  }

  std::string_view bytes_;
  std::vector<Prototype>& prototypes_;
  bool good_ = true;
};

int AppendBytes(lua_State*, const void* bytes, std::size_t count, void* to) {
  try {
    static_cast<std::string*>(to)->append(static_cast<const char*>(bytes), count);
    return 0;
  } catch (const std::bad_alloc&) {
    return 1;  // lua_dump ends with it
  }
}

bool InFrontOf(const Prototype& a, const Prototype& b) { return a.line < b.line; }

bool SameShape(lua_State* L, int index, const lua_Debug& function, const Prototype& prototype) {
  if (prototype.last_line != function.lastlinedefined || prototype.parameters != function.nparams) return false;
  if (prototype.vararg != (function.isvararg != 0) || prototype.upvalues.size() != function.nups) return false;
  for (int i = 0; i < static_cast<int>(prototype.upvalues.size()); ++i) {
    const char* const name = lua_getupvalue(L, index, i + 1);
    lua_pop(L, 1);
    if (prototype.upvalues[static_cast<std::size_t>(i)].name != name) return false;
  }
  return true;
}

}  // namespace

bool ReadPrototypes(lua_State* L, std::vector<Prototype>& prototypes, std::string& error) {
  std::string bytes;
  if (lua_dump(L, AppendBytes, &bytes, 0) != 0) throw std::bad_alloc();
  if (!Reader(bytes, prototypes).Read()) {
    error = "the Lua library compiles files to a format that is not known here";
    return false;
  }
  std::ranges::stable_sort(prototypes, InFrontOf);
  return true;
}

void RequireNoKeptState(lua_State* L, int index, const std::vector<Prototype>& prototypes) {
  index = lua_absindex(L, index);
  lua_Debug function;
  lua_pushvalue(L, index);
  lua_getinfo(L, ">Su", &function);
  bool known = false;
  auto candidate = std::partition_point(prototypes.begin(), prototypes.end(), [&](const Prototype& prototype) {
    return prototype.line < function.linedefined;
  });
  for (; candidate != prototypes.end() && candidate->line == function.linedefined; ++candidate) {
    if (!SameShape(L, index, function, *candidate)) continue;
    known = true;
    for (const Upvalue& upvalue : candidate->upvalues) {
      if (upvalue.written_line == 0) continue;
      lua_pushfstring(L, "%s:%d: `%s` would be kept between callbacks and lost with a handover; keep it in a property",
                      function.short_src, upvalue.written_line, upvalue.name.c_str());
      lua_error(L);
    }
  }
  if (!known) Raise(L, "%s:%d: a function that the file does not show", function.short_src, function.linedefined);
}

}  // namespace tessera::game
