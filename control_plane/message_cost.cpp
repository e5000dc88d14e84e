#include "control_plane/message_cost.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>

#include "absl/container/flat_hash_map.h"

namespace tessera::control {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::io::CodedInputStream;
using Wire = google::protobuf::internal::WireFormatLite;

// A string that is not empty has an object of its own beside its bytes; an entry of a repeated field a pointer; a field
// that is not known a string in a list.
constexpr std::size_t kStringBytes = sizeof(std::string), kEntryBytes = sizeof(void*), kNumberBytes = 8;

class Counter {
 public:
  explicit Counter(std::size_t limit) : left_(limit) {}

  // Whether all that `in` has up to its limit is within ours.
  bool Count(CodedInputStream& in, const Descriptor& type, int depth) {
    if (!Take(SizeOf(type))) return false;
    while (const std::uint32_t tag = in.ReadTag()) {
      const FieldDescriptor* field = type.FindFieldByNumber(Wire::GetTagFieldNumber(tag));
      switch (Wire::GetTagWireType(tag)) {
        case Wire::WIRETYPE_LENGTH_DELIMITED:
          if (!CountBlock(in, field, depth)) return false;
          break;
        case Wire::WIRETYPE_START_GROUP:
          return false;  // no message of ours has one, and one that is not known nests as deep as it likes
        default:
          if ((field == nullptr || field->is_repeated()) && !Take(kNumberBytes)) return false;
          if (!Wire::SkipField(&in, tag)) return true;
      }
    }
    return true;
  }

 private:
  bool CountBlock(CodedInputStream& in, const FieldDescriptor* field, int depth) {
    std::uint32_t size = 0;
    if (!in.ReadVarint32(&size) || size > std::numeric_limits<int>::max()) return true;
    const bool is_message = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
    if (is_message && depth > 0) {
      const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(size));
      const bool within = Take(kEntryBytes) && Count(in, *field->message_type(), depth - 1);
      in.Skip(std::max(in.BytesUntilLimit(), 0));  // after a fault
      in.PopLimit(outer);
      return within;
    }
    const bool is_text = field == nullptr || field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
    if (!Take(is_text ? kEntryBytes + kStringBytes + size : BytesOfNumbers(*field, size))) return false;
    in.Skip(static_cast<int>(size));
    return true;
  }
  // A list's numbers that lie one after the other in so many bytes.
  static std::size_t BytesOfNumbers(const FieldDescriptor& field, std::size_t size) {
    const auto type = static_cast<Wire::FieldType>(field.type());
    if (Wire::WireTypeForFieldType(type) != Wire::WIRETYPE_VARINT) return size;
    const bool wide =
        field.cpp_type() == FieldDescriptor::CPPTYPE_INT64 || field.cpp_type() == FieldDescriptor::CPPTYPE_UINT64;
    return size * (wide ? sizeof(std::uint64_t) : sizeof(std::uint32_t));  // a byte each, at the least
  }
  bool Take(std::size_t bytes) {
    if (bytes > left_) return false;
    left_ -= bytes;
    return true;
  }
  std::size_t SizeOf(const Descriptor& type) {
    auto [known, is_new] = sizes_.try_emplace(&type, 0);
    if (is_new) {
      const auto* made = google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type);
      known->second = made == nullptr ? kStringBytes : made->SpaceUsedLong();
    }
    return known->second;
  }

  std::size_t left_;
  absl::flat_hash_map<const Descriptor*, std::size_t> sizes_;
};

}  // namespace

bool TakesAtMost(google::protobuf::io::ZeroCopyInputStream& bytes, const Descriptor& type, std::size_t limit) {
  CodedInputStream in(&bytes);
  return Counter(limit).Count(in, type, CodedInputStream::GetDefaultRecursionLimit());
}

bool TakesAtMost(std::string_view bytes, const Descriptor& type, std::size_t limit) {
  google::protobuf::io::ArrayInputStream stream(
      bytes.data(), static_cast<int>(std::min<std::size_t>(bytes.size(), std::numeric_limits<int>::max())));
  return TakesAtMost(stream, type, limit);
}

bool FieldsTakeAtMost(google::protobuf::io::ZeroCopyInputStream& bytes, const Descriptor& type,
                      const LimitOfField& limit_of) {
  CodedInputStream in(&bytes);
  while (const std::uint32_t tag = in.ReadTag()) {
    const int number = Wire::GetTagFieldNumber(tag);
    const FieldDescriptor* field = type.FindFieldByNumber(number);
    const bool is_message = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
                            Wire::GetTagWireType(tag) == Wire::WIRETYPE_LENGTH_DELIMITED;
    if (!is_message) {
      if (!Wire::SkipField(&in, tag)) return true;
      continue;
    }
    std::uint32_t size = 0;
    if (!in.ReadVarint32(&size) || size > std::numeric_limits<int>::max()) return true;
    const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(size));
    Counter counter(limit_of(number));
    if (!counter.Count(in, *field->message_type(), CodedInputStream::GetDefaultRecursionLimit() - 1)) return false;
    in.Skip(std::max(in.BytesUntilLimit(), 0));  // after a fault
    in.PopLimit(outer);
  }
  return true;
}

}  // namespace tessera::control
