// The stand-in for Abseil gives the same as Abseil, as far as the client library's sources can tell. This test is
// compiled with that folder before the system's headers.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <variant>

#include "absl/container/flat_hash_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/ids.h"

namespace tessera {
namespace {

TEST(PlainAbseilTest, TextsAndNumbersAreCatenatedAsAbseilDoes) {
  const std::string text = "s";
  EXPECT_EQ(absl::StrCat("a", text, std::string_view("v"), 1, -2, std::uint8_t{200}, true), "asv1-22001");
  EXPECT_EQ(absl::StrCat(std::numeric_limits<std::uint64_t>::max(), " ", std::numeric_limits<std::int64_t>::min()),
            "18446744073709551615 -9223372036854775808");
  EXPECT_EQ(absl::StrCat(0.1, " ", 1e9, " ", -0.5f, " ", 1e-6), "0.1 1e+09 -0.5 1e-06");
  std::string more = "x";
  absl::StrAppend(&more, 1, "y");
  EXPECT_EQ(more, "x1y");
  EXPECT_EQ(absl::CHexEscape("a\x01\"b"), "a\\x01\\\"b");
}

TEST(PlainAbseilTest, AStatusIsItsCodeAndItsText) {
  EXPECT_TRUE(absl::OkStatus().ok());
  EXPECT_EQ(absl::OkStatus().message(), "");
  const absl::Status missing = absl::NotFoundError("no such body");
  EXPECT_FALSE(missing.ok());
  EXPECT_TRUE(absl::IsNotFound(missing));
  EXPECT_EQ(static_cast<int>(missing.code()), 5);
  EXPECT_EQ(missing, absl::NotFoundError("no such body"));
  EXPECT_NE(missing, absl::InternalError("no such body"));
}

TEST(PlainAbseilTest, AStatusOrHasAValueOrAStatus) {
  absl::StatusOr<std::unique_ptr<int>> made = std::make_unique<int>(7);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(**made, 7);
  const std::unique_ptr<int> taken = *std::move(made);
  EXPECT_EQ(*taken, 7);
  const absl::StatusOr<int> failed = absl::InternalError("x");
  EXPECT_EQ(failed.status().message(), "x");
  const absl::StatusOr<std::variant<int, std::string>> wider = absl::StatusOr<int>(3);
  EXPECT_EQ(std::get<int>(*wider), 3);
  const absl::StatusOr<std::variant<int, std::string>> no_wider = absl::StatusOr<int>(absl::InternalError("y"));
  EXPECT_EQ(no_wider.status().message(), "y");
}

TEST(PlainAbseilTest, MapsFindWhatWasPutInByAnyKeyOfOurs) {
  absl::flat_hash_map<BodyId, int> by_body;
  absl::flat_hash_map<std::array<std::uint8_t, 32>, int> by_key;
  for (int i = 0; i < 1000; ++i) {
    by_body[BodyId(static_cast<std::uint64_t>(i) << 32)] = i;
    std::array<std::uint8_t, 32> key{};
    key[static_cast<std::size_t>(i % 32)] = static_cast<std::uint8_t>(1 + i / 32);
    by_key[key] = i;
  }
  EXPECT_EQ(by_body.size(), 1000u);
  EXPECT_EQ(by_key.size(), 1000u);
  EXPECT_EQ(by_body.at(BodyId(std::uint64_t{999} << 32)), 999);
}

TEST(PlainAbseilTest, AFunctionRefCallsWhatItRefersTo) {
  int calls = 0;
  const auto count = [&calls](int by) { return calls += by; };
  const absl::FunctionRef<int(int)> reference = count;
  EXPECT_EQ(reference(2), 2);
  EXPECT_EQ(reference(3), 5);
}

}  // namespace
}  // namespace tessera
