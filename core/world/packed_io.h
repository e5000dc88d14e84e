// PackWriter and PackReader: one description of each part of a scene serves to write it and to read it.
//
// A description is a template over the two, which have the same calls: `io.Real("mass_kg", body.mass_kg, 0, 1e9)`
// writes the number, or reads it and refuses what lies outside. So the two sides cannot differ. Numbers are written as
// core/world/bytes.h has them; a part that has its usual value is left out by a bit of a mask (`Parts`).
//
// The reader never reads past its end, makes room for no more than the bytes that are there can fill, keeps the first
// failure with its place ("bodies[12].mass_kg: 0 is not within 1e-06 and 1e+09") and gives zeros after it.
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "core/world/scene.h"

namespace tessera::packed {

// Whether two values are the same to the bit, so that what is left out comes back to the bit, -0 included.
inline bool SameBits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
inline bool SameBits(Vec3d a, Vec3d b) { return SameBits(a.x, b.x) && SameBits(a.y, b.y) && SameBits(a.z, b.z); }
inline bool SameBits(Vec3f a, Vec3f b) { return SameBits(Vec3d(a), Vec3d(b)); }
inline bool SameBits(Quatd a, Quatd b) {
  return SameBits(a.x, b.x) && SameBits(a.y, b.y) && SameBits(a.z, b.z) && SameBits(a.w, b.w);
}
inline bool SameBits(const Pose& a, const Pose& b) {
  return SameBits(a.position, b.position) && SameBits(a.orientation, b.orientation);
}

class PackWriter {
 public:
  static constexpr bool kReads = false;

  bool ok() const { return true; }
  void Fail(const char*, const std::string&) {}
  void Real(const char*, double v, double, double) { out_.F64(v); }
  void Real(const char*, float v, double, double) { out_.F32(v); }
  void Flag(const char*, bool v) { out_.U8(v ? 1 : 0); }
  template <std::size_t kCount>
  void Digest(const char*, const std::array<std::uint8_t, kCount>& v) {
    out_.Bytes(v);
  }
  template <class U>
  void Number(const char*, U v, std::uint64_t, std::uint64_t) {
    out_.Varint(v);
  }
  template <class Tag, class U>
  void Number(const char*, Id<Tag, U> v, std::uint64_t, std::uint64_t) {
    out_.Varint(v.value());
  }
  template <class E>
  void Choice(const char*, E v, E) {
    out_.U8(static_cast<std::uint8_t>(v));
  }
  void Text(const char*, const std::string& v, std::size_t) { out_.Block(v); }
  void Block(const char*, const std::vector<std::uint8_t>& v, std::size_t) { out_.Block(v); }
  void Vector(const char*, Vec3d v, double) { out_.V(v); }
  void Vector(const char*, Vec3f v, double) { out_.V(v); }
  void Turn(const char*, Quatd v) { out_.Q(v); }
  // Gives the mask of those that are true, in their order from bit 0 on.
  std::uint32_t Parts(const char*, std::initializer_list<bool> present) {
    std::uint32_t mask = 0, bit = 1;
    for (const bool one : present) {
      if (one) mask |= bit;
      bit <<= 1;
    }
    out_.Varint(mask);
    return mask;
  }
  template <class T, class Each>
  void List(const char*, const std::vector<T>& list, std::size_t, std::size_t, std::size_t, const Each& each) {
    out_.Varint(list.size());
    for (const T& one : list) each(one);
  }

  // Appends the bytes of another writer.
  void Raw(std::span<const std::uint8_t> bytes) { out_.Bytes(bytes); }
  std::vector<std::uint8_t> Take() { return out_.Take(); }

 private:
  ByteWriter out_;
};

class PackReader {
 public:
  static constexpr bool kReads = true;

  explicit PackReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  bool ok() const { return error_.empty(); }
  const std::string& error() const { return error_; }
  std::size_t remaining() const { return in_.remaining(); }

  void Fail(const char* field, const std::string& why) {
    if (!ok()) return;
    for (const auto& [list, index] : path_) absl::StrAppend(&error_, list, "[", index, "].");
    absl::StrAppend(&error_, field, ": ", why);
  }
  void Real(const char* field, double& v, double low, double high) { v = Within(field, in_.F64(), low, high); }
  void Real(const char* field, float& v, double low, double high) {
    v = static_cast<float>(Within(field, double{in_.F32()}, low, high));
  }
  void Flag(const char* field, bool& v) {
    const std::uint8_t byte = in_.U8();
    if (Read(field) && byte > 1) Fail(field, "is neither 0 nor 1");
    v = ok() && byte == 1;
  }
  template <std::size_t kCount>
  void Digest(const char* field, std::array<std::uint8_t, kCount>& v) {
    in_.Fill(v);
    (void)Read(field);
  }
  template <class U>
  void Number(const char* field, U& v, std::uint64_t low, std::uint64_t high) {
    const std::uint64_t number = in_.Varint();
    if (Read(field) && (number < low || number > high)) {
      Fail(field, absl::StrCat(number, " is not within ", low, " and ", high));
    }
    v = ok() ? static_cast<U>(number) : U{};
  }
  template <class Tag, class U>
  void Number(const char* field, Id<Tag, U>& v, std::uint64_t low, std::uint64_t high) {
    U number{};
    Number(field, number, low, high);
    v = Id<Tag, U>(number);
  }
  // Numbers of which none is above `high`, for what comes in millions. False: nothing was read; Number says what is
  // wrong with which.
  template <std::size_t kCount>
  bool Numbers(std::array<std::uint32_t, kCount>& numbers, std::uint64_t high) {
    ByteReader ahead = in_;
    for (std::uint32_t& number : numbers) {
      const std::uint64_t read = ahead.Varint();
      if (read > high) return false;
      number = static_cast<std::uint32_t>(read);
    }
    if (!ok() || !ahead.ok()) return false;
    in_ = ahead;
    return true;
  }
  template <class E>
  void Choice(const char* field, E& v, E last) {
    const std::uint8_t choice = in_.U8();
    if (Read(field) && choice > static_cast<std::uint8_t>(last)) Fail(field, absl::StrCat("has no choice ", choice));
    v = ok() ? static_cast<E>(choice) : E{};
  }
  void Text(const char* field, std::string& v, std::size_t most) {
    const auto bytes = in_.Block(most);
    if (Read(field)) v.assign(bytes.begin(), bytes.end());
  }
  void Block(const char* field, std::vector<std::uint8_t>& v, std::size_t most) {
    const auto bytes = in_.Block(most);
    if (Read(field)) v.assign(bytes.begin(), bytes.end());
  }
  void Vector(const char* field, Vec3d& v, double limit) {
    v.x = Within(field, in_.F64(), -limit, limit);
    v.y = Within(field, in_.F64(), -limit, limit);
    v.z = Within(field, in_.F64(), -limit, limit);
  }
  void Vector(const char* field, Vec3f& v, double limit) {
    for (float* part : {&v.x, &v.y, &v.z}) *part = static_cast<float>(Within(field, double{in_.F32()}, -limit, limit));
  }
  void Turn(const char* field, Quatd& v) {
    v = in_.Q();
    if (Read(field) && !(std::abs(Length(v) - 1) <= kUnitTolerance)) Fail(field, "its length is not 1");
    if (!ok()) v = {};
  }
  std::uint32_t Parts(const char* field, std::initializer_list<bool> present) {
    const std::uint64_t mask = in_.Varint();
    if (Read(field) && mask >> present.size() != 0) Fail(field, absl::StrCat("has parts that are not known, ", mask));
    return ok() ? static_cast<std::uint32_t>(mask) : 0;
  }
  // `low` to `most` things, each of which takes at least `min_bytes`.
  template <class T, class Each>
  void List(const char* field, std::vector<T>& list, std::size_t low, std::size_t most, std::size_t min_bytes,
            const Each& each) {
    std::size_t left = BeginList(field, low, most, min_bytes);
    list.clear();
    list.reserve(left);
    ListOn(list, left, ~std::size_t{0}, each);
  }

  // The same in goes: `BeginList` gives how many there are, 0 after a failure; `ListOn` reads some of them, about
  // `bytes`, and gives whether it has come to the end.
  std::size_t BeginList(const char* field, std::size_t low, std::size_t most, std::size_t min_bytes) {
    const std::size_t count = in_.Count(min_bytes);
    if (Read(field) && (count < low || count > most)) {
      Fail(field, absl::StrCat(count, " of them, not within ", low, " and ", most));
    }
    path_.emplace_back(field, 0);
    return ok() ? count : 0;
  }
  template <class T, class Each>
  bool ListOn(std::vector<T>& list, std::size_t& left, std::size_t bytes, const Each& each) {
    const std::size_t begin = remaining();
    for (; left > 0 && ok(); --left) {
      if (begin - remaining() >= bytes) return false;
      each(list.emplace_back());
      NextOfList();
    }
    EndList();
    return true;
  }
  // For a list that is read by hand.
  void NextOfList() {
    if (ok()) ++path_.back().second;
  }
  void EndList() { path_.pop_back(); }

 private:
  // False after a failure, which is named by the field under way.
  bool Read(const char* field) {
    if (ok() && !in_.ok()) Fail(field, in_.error());
    return ok();
  }
  double Within(const char* field, double v, double low, double high) {
    if (Read(field) && !(v >= low && v <= high)) {
      Fail(field, absl::StrCat(v, " is not within ", low, " and ", high));
    }
    return ok() ? v : 0;
  }

  ByteReader in_;
  std::string error_;
  std::vector<std::pair<const char*, std::size_t>> path_;
};

template <class Io, class P>
void PoseOf(Io& io, const char* field, P& pose, double limit) {
  io.Vector(field, pose.position, limit);
  io.Turn(field, pose.orientation);
}

}  // namespace tessera::packed
