// WireReader: the fields of one message in protobuf's wire format, one after the other, without protobuf.
//
// For programs that carry no protobuf and must read a few small messages. Varints, doubles, fixed64 and bytes are all
// that our messages have. What is malformed ends the reading, and `ok()` is false from then on.
//
//   WireReader in(bytes);
//   while (in.Next()) {
//     if (in.field() == 1) region = in.U32();
//     else if (in.field() == 2) host = in.Text();
//   }                                        // fields that nobody took are passed over, as protobuf does
//   if (!in.ok()) return bad;
//
// Thread rule: one thread at a time.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/world/byte_view.h"
#include "core/world/bytes.h"
#include "core/world/utf8.h"

namespace tessera {

class WireReader {
 public:
  explicit WireReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  // Goes to the next field; false at the end and after a fault.
  bool Next() {
    if (!ok() || in_.remaining() == 0) return false;
    const std::uint64_t tag = in_.Varint();
    field_ = static_cast<std::uint32_t>(tag >> 3);
    if (tag > 0xffffffff || field_ == 0) in_.Fail("no field");
    type_ = static_cast<Type>(tag & 7);
    number_ = 0;
    bytes_ = {};
    switch (type_) {
      case Type::kVarint:
        number_ = in_.Varint();
        break;
      case Type::kFixed64:
        number_ = in_.U64();
        break;
      case Type::kBytes:
        bytes_ = in_.Block(in_.remaining());
        break;
      case Type::kFixed32:
        number_ = in_.U32();
        break;
      default:
        in_.Fail("no wire type");
    }
    return ok();
  }
  bool ok() const { return in_.ok() && ok_; }

  std::uint32_t field() const { return field_; }
  // The value of this field; a zero or nothing where the field is of another type, which protobuf passes over.
  std::uint64_t U64() const { return type_ == Type::kVarint ? number_ : 0; }
  std::uint32_t U32() const { return static_cast<std::uint32_t>(U64()); }
  bool Flag() const { return U64() != 0; }
  double Real() const { return type_ == Type::kFixed64 ? std::bit_cast<double>(number_) : 0; }
  std::span<const std::uint8_t> Bytes() const { return bytes_; }
  // A text that is not UTF-8 is a fault of the whole message.
  std::string Text() {
    if (!IsUtf8(AsText(bytes_))) ok_ = false;
    return std::string(AsText(bytes_));
  }
  // A message within this one: `read` takes its fields.
  template <class Read>
  void Message(const Read& read) {
    WireReader within(bytes_);
    while (within.Next()) read(within);
    if (!within.ok()) ok_ = false;
  }

 private:
  enum class Type : std::uint8_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

  ByteReader in_;
  std::uint32_t field_ = 0;
  Type type_ = Type::kVarint;
  std::uint64_t number_ = 0;
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace tessera
